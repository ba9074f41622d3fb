"""Logs -> recordings, measurements, comparisons and figures in one folder; only what changed is made again.

What the results of a log were made of stands in ``made/NAME.json``: size and time of last change of its files, the
facts of its test, the scene, the law, this version. A log that was replaced by an older file is seen too.
"""

import contextlib
import hashlib
import json
import os
import tempfile
from collections import Counter
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from frictionlab import __version__
from frictionlab.errors import OutputError, UsageError
from frictionlab.experiment import base_log_of, facts_of, without_base_logs
from frictionlab.files import make_folder, write_whole
from frictionlab.scene import Scene
from frictionlab.schema import COMPARISONS, MEASUREMENTS
from frictionlab.tables import Row, check_output, read_rows, write_rows
from frictionlab.verbs import inputs
from frictionlab.verbs.inputs import FAILED, AnyScene, FilePath

SETTINGS = ("analysis", "rig", "model")
NOT_MEASURED_BY = {"synthetic", "plan"}  # tables of a scene that no result of a log depends on
Stamp = Mapping[str, object]


@dataclass(frozen=True, repr=False)
class Batch:
    """A plan of what is to be done: all logs, and those of them whose results are not up to date.

    ``logs``: all, in order; ``due``: those that are new, have changed, or lack a result; ``folder`` holds
    ``recordings/NAME.h5``, ``measurements/NAME.jsonl`` and, where they are compared (``compares``, by ``law`` in place
    of the scene's), ``comparisons/NAME.jsonl``, ``figures/NAME.measurement.png`` and ``figures/NAME.comparison.png``;
    in ``made/`` what each was made of. ``copies``: logs of a campaign that are left out, each with the one of the same
    bytes: it would count twice.
    """

    logs: tuple[Path, ...]
    due: tuple[Path, ...]
    scene: Scene
    folder: Path
    compares: bool = True
    law: str | None = None
    names: Mapping[Path, str] = field(default_factory=dict)  # of each log's results
    copies: Mapping[Path, Path] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<Batch: {len(self.due)} of {len(self.logs)} logs to be done into {self.folder}: .run() does the work>"

    @property
    def steps(self) -> tuple[str, ...]:
        """The commands that a log goes through."""
        return ("ingest", "analyze", *(("compare-numeric",) if self.compares else ()))

    def run(self, *, workers: int | None = None, scheduler: str | None = None) -> list[Row]:
        """Do what is due; return the rows of all logs, in order; one that fails has its reason in its row."""
        made = dict(zip(self.due, self.each(workers=workers, scheduler=scheduler), strict=True))
        return [row for log in self.logs if (row := made.get(log) or self.row(log)) is not None]

    def each(self, *, workers: int | None = None, scheduler: str | None = None) -> Generator[Row, None, None]:
        """Do what is due and yield the row of each such log as it is done, in order."""
        made = self.folder / "made"
        make_folder(made)
        with tempfile.TemporaryDirectory(dir=made, prefix="part.", ignore_cleanup_errors=True) as parts:
            make = partial(self._make, parts=Path(parts))  # of this run: a worker may be ended amid its log
            with contextlib.closing(inputs.rows_of(self.due, make, workers=workers, scheduler=scheduler)) as rows:
                for log, row in zip(self.due, rows, strict=True):
                    place = self.results(log)["measurement"]
                    if not self.compares and row.get("status") == FAILED and not self._stamp_file(log).exists():
                        # a campaign lists it, and misses none; results with their stamp stay: it was the disk
                        with contextlib.suppress(OSError):
                            make_folder(place.parent)
                            write_rows([row], place, force=True)
                    yield row

    def rows(self) -> list[Row]:
        """The rows of all logs that have one, in order."""
        return [row for log in self.logs if (row := self.row(log)) is not None]

    def row(self, log: Path) -> Row | None:
        """The row that stands in a log's file, its recording named from here; None if there is none."""
        results = self.results(log)
        path = results["comparison" if self.compares else "measurement"]
        if not path.exists():
            return None
        row = read_rows(path)[0]
        return row if row.get("status") == FAILED else {**row, "source": str(results["recording"])}

    def results(self, log: Path) -> dict[str, Path]:
        """Where the results of a log stand, in the order in which they are made."""
        name = self.names[log]
        measured = {
            "recording": self.folder / "recordings" / f"{name}.h5",
            "measurement": self.folder / "measurements" / f"{name}.jsonl",
        }
        if not self.compares:
            return measured
        figures = self.folder / "figures"
        return measured | {
            "measurement figure": figures / f"{name}.measurement.png",
            "comparison": self.folder / "comparisons" / f"{name}.jsonl",
            "comparison figure": figures / f"{name}.comparison.png",
        }

    def is_fresh(self, log: Path) -> bool:
        """Whether the results of a log are there and nothing they were made of has changed."""
        made = stamp_at(self._stamp_file(log)) == self._stamp(log)
        return made and all(result.exists() for result in self.results(log).values())

    def _make(self, log: Path, *, parts: Path) -> Row:
        """Make all results of a log in ``parts``, put them in place together, give its row; of a failed log none."""
        stamp, places, stamp_file = self._stamp(log), self.results(log), self._stamp_file(log)
        for place in places.values():
            make_folder(place.parent)
        try:
            self._check(places)
            with tempfile.TemporaryDirectory(dir=parts) as part:
                made = {kind: Path(part) / f"{kind}{place.suffix}" for kind, place in places.items()}
                row = self._make_parts(log, made, places["recording"])
                for kind, place in places.items():
                    made[kind].replace(place)
        except UsageError as error:  # a file that is not ours stands where a result belongs: only this log is concerned
            raise OutputError(str(error)) from error
        except OSError:
            raise
        except Exception:
            for stale in (*places.values(), stamp_file) if stamp_file.exists() else ():
                stale.unlink(missing_ok=True)
            raise
        write_stamp(stamp_file, stamp)
        return row

    def _check(self, places: Mapping[str, Path]) -> None:
        """Refuse to replace what is not ours; without its stamp a file is not known to be ours."""
        from frictionlab.hdf5 import check_writable

        check_writable(places["recording"])
        check_output(places["measurement"], MEASUREMENTS)
        if self.compares:
            from frictionlab.figures import check_figures

            check_output(places["comparison"], COMPARISONS)
            check_figures([places["measurement figure"], places["comparison figure"]])

    def _make_parts(self, log: Path, made: Mapping[str, Path], recording: Path) -> Row:
        """Make the results in the order of the steps; rows name the recording by its place."""
        from frictionlab.verbs.one_test import analyze, ingest

        measurement = analyze(ingest(log, self.scene, output=made["recording"]), self.scene)
        row: Row = {**measurement.row(), "source": str(recording)}
        write_rows([row], made["measurement"])
        if not self.compares:
            return row
        from frictionlab.figures import plot
        from frictionlab.verbs.one_test import compare

        plot(measurement, made["measurement figure"], title=recording.name)
        comparison = compare(measurement, self.scene, law=self.law)
        plot(comparison, made["comparison figure"])
        compared: Row = {**comparison.row(), "source": str(recording)}
        write_rows([compared], made["comparison"])
        return compared

    def _stamp(self, log: Path) -> Stamp:
        """What the results of a log would be made of now; a log that is not there has no size and time."""
        facts, known = facts_of(self.scene, log).values, dict[str, list[int]]()
        for file in filter(None, (log, base_log_of(facts, log))):
            known[file.name] = [-1, -1]
            with contextlib.suppress(OSError):
                known[file.name] = [(state := file.stat()).st_size, state.st_mtime_ns]
        return {
            "sizes_and_times": known,
            "facts": dict(facts),
            "scene": made_by(self.scene),
            "steps": list(self.steps),
            "law": self.law,
            "frictionlab_version": __version__,
        }

    def _stamp_file(self, log: Path) -> Path:
        return self.folder / "made" / f"{self.names[log]}.json"


def digest(thing: object) -> str:
    """A number for a tree of plain values: SHA-256 of its JSON."""
    return hashlib.sha256(json.dumps(thing, sort_keys=True, default=str).encode()).hexdigest()


def made_by(scene: Scene) -> str:
    """A number for what results of logs depend on in a scene."""
    return digest(scene.model_dump(mode="json", exclude=NOT_MEASURED_BY))


def stamp_at(path: Path) -> dict[str, Any]:
    """The stamp that stands there; an empty one where none can be read, so that its results are made again."""
    with contextlib.suppress(OSError, ValueError):
        return dict(json.loads(path.read_text(encoding="utf-8")))
    return {}


def write_stamp(path: Path, stamp: Stamp) -> None:
    """Write a stamp, after the results it speaks for."""
    write_whole(path, json.dumps(stamp, indent=1).encode())


def copies_among(files: Iterable[Path]) -> dict[Path, Path]:
    """Files that hold the same bytes as one before them, each with that one; empty ones are no copies."""
    sizes = {path: path.stat().st_size for path in files if path.is_file()}
    many, seen = Counter(sizes.values()), dict[bytes, Path]()
    alike = [path for path, size in sizes.items() if size and many[size] > 1]
    first = {path: seen.setdefault(hashlib.sha256(path.read_bytes()).digest(), path) for path in alike}
    return {path: one for path, one in first.items() if one is not path}


def batch(
    logs: FilePath | Iterable[FilePath],
    scene: AnyScene = None,
    *,
    output: FilePath = "build",
    compare: bool = True,
    law: str | None = None,
    again: bool = False,
    **settings: object,
) -> Batch:
    """Plan what a folder of logs needs: what is new or has changed, log by log; ``run`` does it.

    Parameters
    ----------
    logs : str, Path or iterable of them
        Logs, or folders of them.
    scene : Scene, str, Path or None
        A change of it makes all results again, a change of a test's facts those of that test.
    output : str or Path
        Folder of the results: ``recordings``, ``measurements``, ``comparisons`` and ``figures``.
    compare : bool
        Whether each measurement is compared with its prediction; a campaign compares them all together instead.
    law : str, optional
        Contact law of the comparisons, in place of the scene's; "auto" finds one for each test.
    again : bool
        Make everything again.
    **settings
        Keys of ``[analysis]``, ``[rig]`` and ``[model]`` that win over the scene's: ``transient_s=5.0``.

    Raises
    ------
    SceneError
        The scene, its sheet or a setting is refused; a log that fails is a row of ``run``, and raises nothing.
    UsageError
        There is no log, or no such setting.
    """
    scene = inputs.scene_given(scene, settings, SETTINGS)
    places = list(map(Path, [logs] if isinstance(logs, (str, PathLike)) else logs))
    others = [scene.folder / scene.experiment.sheet] if scene.experiment.sheet else []
    others += [tap for pattern in scene.experiment.taps for tap in scene.folder.glob(pattern)]
    beside = {os.path.realpath(path) for path in others}  # they stand among the logs and are none
    every = without_base_logs(scene, inputs.files_of(places, inputs.logs_in))
    found = tuple(log for log in every if os.path.realpath(log) not in beside)
    strange = [place for place in places if not (place.exists() or inputs.is_log_name(place))]
    if strange:
        raise UsageError(f"no logs in {strange[0]}: there is no such file or folder: {inputs.EXPECTED_LOGS}")
    if not found:
        raise UsageError(f"no logs in {', '.join(map(str, places))}: {inputs.EXPECTED_LOGS}")
    copies: dict[Path, Path] = {}
    if not compare:  # of copies the one that says most counts, and none is left out that says something else
        facts = {log: facts_of(scene, log).values.items() for log in found}
        alike = copies_among(sorted(found, key=lambda log: -len(facts[log])))
        copies = {copy: log for copy, log in alike.items() if facts[copy] <= facts[log]}
    found = tuple(log for log in found if log not in copies)
    work = Batch(found, found, scene, Path(output), compare, law, inputs.names_of(found), copies)
    return work if again else replace(work, due=tuple(log for log in found if not work.is_fresh(log)))
