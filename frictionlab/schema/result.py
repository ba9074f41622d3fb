"""What results of verbs have in common: rows of a table, a frame of pandas, a small page in a notebook."""

import html
import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

MOST = 20  # rows in a notebook's table


class Result:
    """A result that is one row or several: it turns itself into a frame of pandas, and shows itself in a notebook."""

    def rows(self) -> list[dict[str, object]]:
        """Its rows, with the keys of JSON; of most results one."""
        row: Any = getattr(self, "row", dict)
        return [row()]

    def to_pandas(self) -> "pd.DataFrame":
        """Return its rows as a frame."""
        import pandas as pd  # noqa: PLC0415 - a result that nobody turns into a frame does not wait for pandas

        return pd.DataFrame(self.rows())

    def _repr_html_(self) -> str:
        """A small table of what is known, and the figure where there is one."""
        frame = self.to_pandas().dropna(axis="columns", how="all")
        table = frame.T if len(frame) == 1 else frame
        shown: str = table.to_html(max_rows=MOST, max_cols=MOST // 2, header=len(frame) != 1, index=len(frame) == 1)
        return f"<p>{html.escape(repr(self))}</p>{shown}{_drawn(self)}"


def _drawn(result: object) -> str:
    """The result's figure as SVG; nothing for a result that has none."""
    import frictionlab  # noqa: PLC0415 - figures are drawn by a room above this one

    try:
        figure = frictionlab.plot(result)
    except frictionlab.UsageError:
        return ""
    image = io.StringIO()
    figure.savefig(image, format="svg")
    return "".join(image.getvalue().partition("<svg")[1:])
