"""One log -> recording -> measurement -> comparison, each in its file, with their figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from frictionlab.analysis.measurement import Measurement
from frictionlab.chain.stamps import Stamp, is_fresh, stamp_of, write_stamp
from frictionlab.errors import OutputError, UsageError
from frictionlab.files import make_folder
from frictionlab.scene import Scene
from frictionlab.tables import Row, read_rows, write_rows
from frictionlab.verbs.analyze import analyze
from frictionlab.verbs.compare import compare
from frictionlab.verbs.failures import FAILED
from frictionlab.verbs.ingest import ingest
from frictionlab.verbs.plot import plot

MEASURE, COMPARE = ("ingest", "analyze"), ("ingest", "analyze", "compare-numeric")


@dataclass(frozen=True)
class Chain:
    """What is done to each log, here or where a worker is.

    Parameters
    ----------
    scene
        What it is done with.
    folder
        Holds ``recordings/NAME.h5``, ``measurements/NAME.jsonl`` and, with the step compare-numeric,
        ``comparisons/NAME.jsonl`` and ``figures/NAME.measurement.png``, ``figures/NAME.comparison.png``; in ``made/``
        what each was made of.
    names
        The name of each log's results.
    steps
        `MEASURE` or `COMPARE`.
    """

    scene: Scene
    folder: Path
    names: Mapping[Path, str]
    steps: tuple[str, ...] = COMPARE

    def results(self, log: Path) -> dict[str, Path]:
        """Where the results of a log stand, in the order in which they are made."""
        name = self.names[log]
        measured = {
            "recording": self.folder / "recordings" / f"{name}.h5",
            "measurement": self.folder / "measurements" / f"{name}.jsonl",
        }
        if self.steps == MEASURE:
            return measured
        figures = self.folder / "figures"
        return measured | {
            "measurement figure": figures / f"{name}.measurement.png",
            "comparison": self.folder / "comparisons" / f"{name}.jsonl",
            "comparison figure": figures / f"{name}.comparison.png",
        }

    def row_file(self, log: Path) -> Path:
        """The file of the row that a log comes to: its comparison, or its measurement where none is compared."""
        return self.results(log)["measurement" if self.steps == MEASURE else "comparison"]

    def is_fresh(self, log: Path) -> bool:
        """Whether the results of a log are there and nothing they were made of has changed."""
        return is_fresh(self._stamp_file(log), self._stamp(log), self.results(log).values())

    def __call__(self, log: Path) -> Row:
        """Make all results of a log and give its row; what an earlier run made and this one cannot is removed."""
        stamp = self._stamp(log)
        left = self.results(log)
        try:
            row = self._made(log, left)
        except UsageError as error:  # a file that is not ours stands where a result belongs: only this log is concerned
            raise OutputError(str(error)) from error
        finally:
            self._clear(log, left)
        write_stamp(self._stamp_file(log), stamp)
        return row

    def _clear(self, log: Path, left: Mapping[str, Path]) -> None:
        """Remove what an earlier run made and this one did not; without its stamp a file is not known to be ours."""
        if left and self._stamp_file(log).exists():
            for stale in (*left.values(), self._stamp_file(log)):
                stale.unlink(missing_ok=True)

    def _made(self, log: Path, left: dict[str, Path]) -> Row:
        """Make the results one by one, taking each from what is left when it stands."""
        for place in left.values():
            make_folder(place.parent)
        place = left["recording"]
        recording = ingest(log, self.scene, output=place)
        del left["recording"]
        measurement = analyze(recording, self.scene)
        row: Row = {**measurement.row(), "source": str(place)}
        write_rows([row], left["measurement"])
        del left["measurement"]
        return row if self.steps == MEASURE else self._compared(measurement, place, left)

    def _compared(self, measurement: Measurement, recording: Path, left: dict[str, Path]) -> Row:
        plot(measurement, left["measurement figure"], title=recording.name)
        del left["measurement figure"]
        comparison = compare(measurement, self.scene)
        row: Row = {**comparison.row(), "source": str(recording)}
        plot(comparison, left["comparison figure"])
        del left["comparison figure"]
        write_rows([row], left["comparison"])
        del left["comparison"]
        return row

    def row(self, log: Path) -> Row | None:
        """The row that stands in a log's file, its recording named from here; None if there is none."""
        path = self.row_file(log)
        if not path.exists():
            return None
        row = read_rows(path)[0]
        return row if row.get("status") == FAILED else {**row, "source": str(self.results(log)["recording"])}

    def keep_failure(self, log: Path, row: Row) -> None:
        """Write the row of a failed log where its measurement would stand: a campaign tells it, and misses none."""
        if self.steps == MEASURE and row.get("status") == FAILED:
            path = self.row_file(log)
            make_folder(path.parent)
            write_rows([row], path, force=True)

    def _stamp(self, log: Path) -> Stamp:
        return stamp_of(log, self.scene, self.steps)

    def _stamp_file(self, log: Path) -> Path:
        return self.folder / "made" / f"{self.names[log]}.json"
