"""A scene -> the tests that tell most."""

from collections.abc import Sequence
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.planning import Plan, plan_tests, sheet_rows
from frictionlab.tables import check_output, read_rows, write_rows
from frictionlab.verbs.inputs import AnyScene, FilePath, scene_given

TABLES = ("plan", "model", "rig", "sensors")


def plan(
    scene: AnyScene,
    *,
    law: str | None = None,
    against: str | None = None,
    tests: int = 10,
    hours: float | None = None,
    aim: Sequence[str] = (),
    measured: Sequence[FilePath] = (),
    sheet: FilePath | None = None,
    force: bool = False,
    everything: bool = False,
    **settings: object,
) -> Plan:
    """Return the tests that tell most about a contact law, or most between two, best first.

    Parameters
    ----------
    scene : Scene, str or Path
        ``[plan]``: what the rig can set, its sensors, what is known of the friction coefficient; ``[rig]``;
        ``[model]``: the law and its expected parameters.
    law : str, optional
        In place of the scene's.
    against : str, optional
        Another law: the tests are to tell the two apart.
    tests : int
        How many at most.
    hours : float, optional
        Laboratory time there is.
    aim : sequence of str
        Parameters of the law whose errors count; by default all.
    measured : sequence of str or Path
        Tables of comparisons at hand: what they told is known before.
    sheet : str or Path, optional
        Write the plan here as a sheet (CSV) for the laboratory, which ``[experiment] sheet`` reads after the tests.
    force : bool
        Replace a file that stands there.
    everything : bool
        Judge candidates that are not chosen between two laws as well.
    **settings
        Keys of ``[plan]``, ``[model]``, ``[rig]`` and ``[sensors]`` that win over the scene's: ``duration_s=90.0``.

    Raises
    ------
    SceneError
        A range is empty, the bounds forbid all, or the rig is not known.
    UsageError
        The law cannot be, or nothing tells anything about it.
    """
    known = scene_given(scene, settings, TABLES)
    inputs = [Path(path) for path in measured]
    check_sheet(sheet, inputs, force=force)
    rows = [row for path in inputs for row in read_rows(Path(path))]
    found = plan_tests(
        known, law=law, against=against, tests=tests, hours=hours, aim=aim, measured=rows, everything=everything
    )
    if sheet is not None:
        write_rows(sheet_rows(found, known), Path(sheet), force=True, inputs=inputs)
    return found


def check_sheet(sheet: FilePath | None, inputs: Sequence[Path], *, force: bool) -> None:
    """Refuse a sheet that could not be written, or that stands there: the laboratory may have filled it in."""
    if sheet is None:
        return
    check_output(Path(sheet), force=force, inputs=inputs)
    if Path(sheet).exists() and not force:
        raise UsageError(f"{sheet}: exists, and may hold what was filled in: choose another output, or give --force")
