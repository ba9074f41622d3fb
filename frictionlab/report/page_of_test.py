"""A page of one test: its motion, its loop, the force of its contact, its cycles, and what is to be warned of."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign
from frictionlab.campaign.files import is_page, measured_again
from frictionlab.campaign.friction import Verdict
from frictionlab.campaign.trials import Trial, short_name
from frictionlab.figures.materials import at_lag
from frictionlab.files import make_folder, write_whole
from frictionlab.inference.comparison import contact_force
from frictionlab.inference.observations import base_of
from frictionlab.report.charts import TEMPLATES, ChartLine, chart
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.uncertainty import Estimate

CYCLES = 8  # of the time response, the last ones


def sheet_name(number: int, trial: Trial) -> str:
    """File name of a test's page: any source becomes a plain one.

    Examples
    --------
    >>> sheet_name(7, Trial(source="a/<b> c.h5"))
    'test-0007-b_c.html'
    """
    stem = re.sub(r"[^A-Za-z0-9.-]+", "_", short_name(trial.source)).strip("_.")[:60]
    return f"test-{number:04d}-{stem or 'test'}.html"


def write_sheets(campaign: Campaign, folder: Path, *, force: bool = False) -> None:
    """Write a page per test into a folder, with what its recording shows; `OutputError`: one cannot be written."""
    make_folder(folder)
    fitted = {} if campaign.joint is None else campaign.joint.problems()
    verdicts, lag, scene = campaign.verdicts, at_lag(campaign), campaign.scene
    for number, trial in enumerate(campaign.trials, 1):
        measured = None if trial.failed else measured_again(trial, campaign.folders, scene)
        seen = (trial, scene, verdicts.get(trial.source), fitted.get(trial.source), measured)
        text = sheet_page(*seen, lag=lag)
        write_whole(folder / sheet_name(number, trial), text.encode(), replace=force or is_page)


def sheet_page(
    trial: Trial,
    scene: Scene,
    verdict: Verdict | None = None,
    fitted: tuple[Problem, float] | None = None,
    measurement: Measurement | None = None,
    *,
    lag: str = "",
) -> str:
    """The page of a test; whatever stood in a log is escaped by the template.

    ``verdict``: what the campaign's fit says of it; ``fitted``: what the fit of all tests simulates for this one, and
    the phase (rad) by which its base's channel is late; ``measurement``: where the recording is at hand; ``lag``: in
    words, that its energies are those at the lag found.
    """
    charts = () if measurement is None else _charts(measurement, scene, fitted, trial)
    return TEMPLATES.get_template("sheet.html").render(
        trial=trial,
        title=short_name(trial.source),
        warnings=dict.fromkeys((*trial.warnings, *(measurement.warnings if measurement else ()))),
        verdict=verdict,
        lag=lag,
        force=Estimate(trial.normal_force_n),
        base=Estimate(trial.base_amplitude_m).scaled(1e3),
        joules=trial.energy_joules.scaled(1e3),
        is_at_hand=measurement is not None,
        is_fitted=fitted is not None,
        charts=[(title, svg) for title, svg in charts if svg],
    )


def _charts(
    measured: Measurement, scene: Scene, fitted: tuple[Problem, float] | None, trial: Trial
) -> Iterator[tuple[str, str]]:
    """Titles, by which the template has captions, and charts."""
    stiffness = scene.rig.stiffness
    unit, drive = 1e3 * (measured.base_amplitude.value or np.nan), measured.drive.value or np.nan  # Y in mm; Hz
    cycle, series, layout = measured.cycle, measured.series, measured.layout
    last = np.arange(len(layout))[-CYCLES:]
    time, both = layout.moments(last), (("base", layout.base, "other"), ("mass", layout.mass, "measured"))
    lines = [ChartLine(time, unit * cycles[last].ravel(), label, kind) for label, cycles, kind in both]
    yield "Time response", chart(lines[1:] if trial.is_given else lines, "time [s]", "displacement [mm]")
    if trial.is_given:
        if cycle.force is not None:
            speed = 2.0 * np.pi * drive * unit * cycle.mass_velocity
            x, label = "displacement [mm]", "measured force [N]"
            yield "Measured force over displacement", chart([_loop(unit * cycle.mass_smooth, cycle.force)], x, label)
            yield "Measured force over speed", chart([_loop(speed, cycle.force)], "speed [mm/s]", label)
        return
    x, y = "mass displacement x [mm]", "base displacement y [mm]"
    yield "Loop", chart([_loop(unit * cycle.mass, unit * cycle.base)], x, y)
    if measured.frequency_ratio is not None:
        base = base_of(cycle, measured.base_amplitude_m_se / measured.base_amplitude_m)
        problem, late = fitted or (Problem(measured.frequency_ratio, 0.0, base=base), 0.0)
        newtons, name = (1.0, "k Y") if stiffness is None else (1e-3 * stiffness * unit, "N")
        force, label = newtons * contact_force(measured.cycle, problem, late), f"friction force [{name}]"
        yield "Force over displacement", chart([_loop(unit * cycle.mass_smooth, force)], x, label)
        speed = 2.0 * np.pi * drive * unit * cycle.mass_velocity
        yield "Force over speed", chart([_loop(speed, force)], "mass speed [mm/s]", label)
    cycles = [
        ChartLine(series.time[part], series.energy[part], label, kind, dots=True)
        for part, label, kind in ((~series.used, "not used", "other"), (series.used, "used", "measured"))
    ]
    yield "Cycles", chart(cycles, "time [s]", "energy per cycle [k Y²]")


def _loop(x: FloatArray, y: FloatArray) -> ChartLine:
    return ChartLine(np.append(x, x[:1]), np.append(y, y[:1]), "mean cycle")
