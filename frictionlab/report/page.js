"use strict";
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const key = (row, column) => {
    const cell = row.cells[column];
    return cell.classList.contains("n") ? parseFloat(cell.dataset.v ?? "NaN") : cell.textContent.toLowerCase();
  };
  const compare = (a, b) => {
    if (typeof a === "string") return a < b ? -1 : a > b ? 1 : 0;
    if (Number.isNaN(a) || Number.isNaN(b)) return Number.isNaN(a) - Number.isNaN(b);
    return a - b;
  };
  table.querySelectorAll("th").forEach((head, column) => {
    head.querySelector("button").addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      table.querySelectorAll("th").forEach((other) => other.setAttribute("aria-sort", "none"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const known = (row) => !Number.isNaN(key(row, column));
      const order = (a, b) => {
        if (known(a) !== known(b)) return known(a) ? -1 : 1;
        return (up ? 1 : -1) * compare(key(a, column), key(b, column));
      };
      body.append(...rows.sort(order));
    });
  });
  const words = document.getElementById("filter-words");
  const chosen = Array.from(document.querySelectorAll("select[data-column]"));
  const count = document.getElementById("filter-count");
  const filter = () => {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      const fits = chosen.every((s) => !s.value || row.cells[s.dataset.column].textContent === s.value);
      row.hidden = !(fits && wanted.every((word) => text.includes(word)));
      shown += !row.hidden;
    }
    count.textContent = `${shown} of ${rows.length} tests`;
  };
  words.addEventListener("input", filter);
  chosen.forEach((s) => s.addEventListener("change", filter));
  filter();
}
