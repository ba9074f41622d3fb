"""A page of one test: its motion, its loop, the force of its contact, its cycles, and what is to be warned of."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign
from frictionlab.campaign.files import is_page
from frictionlab.campaign.friction import Verdict
from frictionlab.campaign.trials import Trial, short_name
from frictionlab.figures.materials import at_lag
from frictionlab.files import write_whole
from frictionlab.inference.comparison import contact_force
from frictionlab.inference.observations import base_of
from frictionlab.report.charts import TEMPLATES, ChartLine, chart
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.uncertainty import Estimate

CYCLES = 8  # of the time response, the last ones


@dataclass(frozen=True)
class PageOfTest:
    """What a page of one test shows; ``measurement``: where the recording is at hand.

    ``verdict``: what the campaign's fit says of it; ``fitted``: what the fit of all tests simulates for this one, and
    the phase (rad) by which its base's channel is late; ``at_lag``: in words, that its energies are those at the lag
    found.
    """

    trial: Trial
    scene: Scene
    verdict: Verdict | None = None
    fitted: tuple[Problem, float] | None = None
    at_lag: str = ""
    measurement: Measurement | None = None

    @property
    def title(self) -> str:
        """The test's name."""
        return short_name(self.trial.source)

    @property
    def warnings(self) -> tuple[str, ...]:
        """All that is to be warned of, each once."""
        again = () if self.measurement is None else self.measurement.warnings
        return tuple(dict.fromkeys((*self.trial.warnings, *again)))


def sheet_name(number: int, trial: Trial) -> str:
    """File name of a test's page: any source becomes a plain one.

    Examples
    --------
    >>> sheet_name(7, Trial(source="a/<b> c.h5"))
    'test-0007-b_c.html'
    """
    stem = re.sub(r"[^A-Za-z0-9.-]+", "_", short_name(trial.source)).strip("_.")[:60]
    return f"test-{number:04d}-{stem or 'test'}.html"


def write_sheet(sheet: PageOfTest, path: Path, *, back: str | None = None, force: bool = False) -> None:
    """Write a page into an existing folder; ``back``: link to the page of all tests. May raise `OutputError`."""
    write_whole(path, sheet_page(sheet, back=back).encode(), replace=force or is_page)


def sheet_page(sheet: PageOfTest, *, back: str | None = None) -> str:
    """The page's text; whatever stood in a log is escaped by the template."""
    trial = sheet.trial
    shares = (share or 0.0 for share in trial.systematic)
    means = [mean.widened(share) if mean.u is None else mean for mean, share in zip(trial.means, shares, strict=False)]
    energy, mean = trial.energy.value, trial.means[0].value
    return TEMPLATES.get_template("sheet.html").render(
        sheet=sheet,
        back=back,
        force=Estimate(trial.normal_force_n),
        base=Estimate(trial.base_amplitude_m).scaled(1e3),
        means=means,
        joules=trial.energy_joules.scaled(1e3 * mean / energy if energy and mean else None),
        charts=[(title, svg) for title, svg in _charts(sheet) if svg],
    )


def _charts(sheet: PageOfTest) -> Iterator[tuple[str, str]]:
    """Titles, by which the template has captions, and charts."""
    measured, stiffness = sheet.measurement, sheet.scene.rig.stiffness
    if measured is None:
        return
    unit, drive = 1e3 * (measured.base_amplitude.value or np.nan), measured.drive.value or np.nan  # Y in mm; Hz
    cycle, series, layout = measured.cycle, measured.series, measured.layout
    last = np.arange(len(layout))[-CYCLES:]
    time, both = layout.moments(last), (("base", layout.base, "other"), ("mass", layout.mass, "measured"))
    lines = [ChartLine(time, unit * cycles[last].ravel(), label, kind) for label, cycles, kind in both]
    yield "Time response", chart(lines, "time [s]", "displacement [mm]")
    x, y = "mass displacement x [mm]", "base displacement y [mm]"
    yield "Loop", chart([_loop(unit * cycle.mass, unit * cycle.base)], x, y)
    if measured.frequency_ratio is not None:
        base = base_of(cycle, measured.base_amplitude_m_se / measured.base_amplitude_m)
        problem, late = sheet.fitted or (Problem(measured.frequency_ratio, 0.0, base=base), 0.0)
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


def sheets_of(campaign: Campaign) -> list[PageOfTest]:
    """The pages of a campaign, in the order of its tests, without what their recordings would add."""
    fitted = {} if campaign.joint is None else campaign.joint.problems()
    verdicts, lag = campaign.verdicts, at_lag(campaign)
    return [PageOfTest(t, campaign.scene, verdicts.get(t.source), fitted.get(t.source), lag) for t in campaign.trials]
