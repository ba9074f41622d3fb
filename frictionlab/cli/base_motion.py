"""``frictionlab simulate --base-motion``: the response to any recorded motion of the base."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.inputs import exit_status, report_rows
from frictionlab.cli.options import ANALYSIS, LOG
from frictionlab.cli.output import print_turned
from frictionlab.errors import UsageError
from frictionlab.files import refuse_inputs
from frictionlab.schema import RESPONSES
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.simulator import Problem

BaseMotion = Annotated[
    Path | None,
    typer.Option(
        "--base-motion",
        metavar="FILE",
        help="The response, from rest, to the base of a recording, a log, or one column of any table.",
    ),
]
Highpass = Annotated[
    float | None,
    typer.Option(
        "--highpass",
        metavar="HZ",
        help="A base given as an acceleration is integrated twice, without what is slower (fixed wall).",
    ),
]
SETTINGS = (
    *(s for s in ANALYSIS if s.key == "natural_frequency_hz"),
    *(s for s in LOG if s.key in ("time", "base", "unit", "time_unit", "sampling_rate_hz", "separator", "decimal")),
)
SERIES = (".h5", ".csv")
HEAD = ("time [s]", "base [m]", "mass [m]")
FORCE = "contact force"


def one_of_both(
    r: float | None,
    base_motion: Path | None,
    settings: Mapping[str, object],
    scene: Path | None,
    others: Mapping[str, object],
) -> float:
    """Return the frequency ratio to simulate at: as given, or 1 where a record of the base says its own times.

    Raises
    ------
    UsageError
        Neither or both are given, or an option of the other one.
    """
    if base_motion is None:
        stray = [setting.flag for setting in SETTINGS if setting.key in settings]
        stray += ["--scene"] if scene is not None else []
        if stray:
            raise UsageError(f"{stray[0]}: belongs to --base-motion FILE; got none")
        if r is None:
            raise UsageError("expected --r R (a steady state) or --base-motion FILE (the response to it); got neither")
        return r
    stray = [name for name, value in others.items() if value not in (None, False, "auto", "exact")]
    if r is not None:
        raise UsageError("expected --r R or --base-motion FILE; got both: a recorded base has its own times")
    if stray:
        raise UsageError(f"{stray[0]}: a recorded base is followed once, by the solver that its law has: leave it out")
    return 1.0


@dataclass(frozen=True)
class Ride:
    """What is done with the file of a base motion."""

    problem: "Problem"
    scene: Path | None
    settings: Mapping[str, object]
    output: Path | None
    plot: Path | None
    force: bool
    highpass_hz: float | None = None

    def __call__(self, path: Path) -> Row:
        """Simulate, write and draw; the row of the file."""
        from frictionlab.verbs.simulating import respond

        start = time.perf_counter()
        answer = respond(path, self.problem, self.scene, highpass_hz=self.highpass_hz, **self.settings)
        row = answer.row() | {"wall_s": time.perf_counter() - start}
        if self.output is not None:
            _write(answer, self.output, force=self.force)
        if self.plot is not None:
            from frictionlab.verbs.presenting import plot

            plot(answer, self.plot, force=self.force)
        return row


def ride(path: Path, job: Ride, *, as_json: bool, quiet: bool) -> None:
    """Simulate the response to a file's base motion, and tell it."""
    from frictionlab.verbs.rows import row_of

    _check(job, path)
    rows = report_rows(iter([row_of(job, path, folder=None)]), as_json=as_json, quiet=quiet)
    if not (as_json or quiet):
        print_turned([row for row in rows if row["status"] == "ok"], RESPONSES)
    exit_status(rows)


def _check(job: Ride, path: Path) -> None:
    """Refuse outputs that could not be written before the work."""
    from frictionlab.files import check_replaceable
    from frictionlab.hdf5 import check_writable

    output = job.output
    if output is None:
        return
    if output.suffix not in SERIES:
        raise UsageError(f"{output}: expected a recording (.h5) or a log (.csv); got {output.suffix!r}")
    refuse_inputs([output], [path, *([] if job.scene is None else [job.scene])])
    if output.suffix == ".h5":
        check_writable(output, force=job.force)
    else:
        check_replaceable(output, replace=job.force or _is_series)


def _is_series(path: Path) -> bool:
    """Whether a file is a log that this command wrote."""
    try:
        with path.open(encoding="utf-8") as file:
            head, _, last = file.readline(1000).rpartition(",")
    except (OSError, UnicodeDecodeError):
        return False
    return head == ",".join(HEAD) and last.startswith(FORCE)


def _write(answer: "RecordResponse", output: Path, *, force: bool) -> None:
    force_, unit = answer.contact_force
    name = FORCE if unit == "N" else f"{FORCE} over stiffness"
    if output.suffix == ".h5":
        from frictionlab.hdf5 import write_recording
        from frictionlab.recording import Channel

        contact = Channel("contact_force", force_, f"{name}, on the mass", unit)
        write_recording(answer.recording.changed(channels=(contact,)), output, force=force)
        return
    from frictionlab.files import write_whole

    write_whole(output, _lines(answer, f"{name} [{unit}]", force_.tolist()), replace=force or _is_series)


def _lines(answer: "RecordResponse", name: str, contact_force: list[float]) -> Iterator[bytes]:
    part = answer.recording
    yield (",".join((*HEAD, name)) + "\n").encode()
    columns = (part.time.tolist(), part.base_displacement.tolist(), part.mass_displacement.tolist(), contact_force)
    for t, y, x, n in zip(*columns, strict=True):
        yield f"{t!r},{y!r},{x!r},{n!r}\n".encode()
