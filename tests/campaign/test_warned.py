"""Warnings of many tests: each kind once, no test forgotten."""

import re
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from frictionlab.tables import write_rows
from frictionlab.tables.texts import kinds_of
from tests.campaign.fabricate import row
from tests.desk import ROOT, invoke

SAID = st.tuples(st.sampled_from("abcd"), st.sampled_from(["lag: 3 s", "lag: 0.4 s", "no unit", "beats every 1e-3 s"]))


@given(st.lists(SAID))
def test_every_warning_of_every_test_is_in_exactly_one_kind(said: list[tuple[str, str]]) -> None:
    kinds = kinds_of(said)
    numbers = re.compile(r"[\d.e-]+( to [\d.e-]+)? s")
    told = {(source, numbers.sub("# s", sentence)) for sentence, sources in kinds for source in sources}
    assert told == {(source, numbers.sub("# s", sentence)) for source, sentence in said}
    assert len(told) == sum(len(sources) for _, sources in kinds)


def test_a_campaign_tells_a_kind_once_on_screen_and_in_its_report(tmp_path: Path) -> None:
    rows = [
        {**row("steel", 1.0, r, 0.6), "warnings": [f"stops_per_cycle: {r:g} in some cycles", "odd"][: 1 + (r < 0.4)]}
        for r in (0.3, 0.5, 0.7)
    ]
    write_rows(rows, tmp_path / "m.jsonl")
    done = invoke("campaign", tmp_path / "m.jsonl", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    shown = done.stdout.splitlines()
    assert shown[0].startswith("material")
    assert not any(line.startswith("by ") for line in shown), "one material is not ranked"
    told = [line for line in done.stderr.splitlines() if "warning (" in line]
    assert told == [
        "frictionlab: warning (3 tests): stops_per_cycle: 0.3 to 0.7 in some cycles",
        "frictionlab: warning (steel_N1_r0.3): odd",
    ]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").partition('<section id="warnings">')[2]
    assert page.count("in some cycles") == 1
    assert page.count("steel_N1_r0.5") == page.count("steel_N1_r0.7") == 1


def test_heads_of_a_long_table_are_printed_on_each_page() -> None:
    """A browser draws no button a second time: in print the head's words stand without theirs."""
    style = (ROOT / "frictionlab" / "report" / "page.css").read_text(encoding="utf-8")
    assert "th button { display: contents; }" in style.partition("@media print")[2]
