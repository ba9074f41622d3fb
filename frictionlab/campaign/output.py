"""The tables of a campaign as files: the contract's columns first, then what else helps."""

from collections.abc import Iterator
from pathlib import Path

from frictionlab.campaign import Campaign, Drift, FrictionFit, Rank, Trial, Verdict
from frictionlab.errors import OutputError
from frictionlab.tables import Row, write_rows

FRICTION = (
    "material", "normal_force_n", "tests", "friction_ratio", "friction_ratio_se", "friction_force_n",
    "friction_force_n_se", "friction_coefficient", "friction_coefficient_se",
    "friction_coefficient_low", "friction_coefficient_high", "tests_used", "scatter",
    "amontons_p", "note",
)  # fmt: skip
RANKING = ("criterion", "rank", "material", "value", "value_se", "unit", "tied_with", "evidence")
DRIFT = (
    "source", "material", "normal_force_n", "frequency_ratio", "duration_s", "slope_per_hour", "slope_per_hour_se",
    "slope_per_hour_low", "slope_per_hour_high", "relative_slope_per_hour", "relative_slope_per_hour_se",
    "friction_slope_per_hour", "friction_slope_per_hour_se", "verdict", "note",
)  # fmt: skip
MEASUREMENTS_FIRST = ("source", "status", "reason", "warnings", "material", "normal_force_n")
MEASUREMENTS_LAST = (
    "irregularity_low", "irregularity_high",
    "test_friction_ratio", "test_friction_ratio_se", "predicted_energy_per_cycle", "predicted_response_amplitude",
    "predicted_stops_per_cycle", "energy_residual", "left_out_of_fit",
)  # fmt: skip
FIRST_COLUMNS = {
    "measurements.csv": ",".join(MEASUREMENTS_FIRST),
    "friction.csv": ",".join(FRICTION[:9]),
    "ranking.csv": ",".join(RANKING[:5]),
    "drift.csv": ",".join(DRIFT[:5]),
}
TABLES = tuple(FIRST_COLUMNS)
REPORT = "report.html"
MARK = '<meta name="generator" content="frictionlab'


def check_folder(folder: Path, *, force: bool = False) -> None:
    """Make the output folder, and refuse one that holds files of these names which are not an earlier campaign's.

    Raises
    ------
    OutputError
        It cannot be made, or the files in it may not be replaced.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "figures").mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made ({error.strerror}): give another folder") from error
    there = [name for name in (*TABLES, REPORT) if (folder / name).exists()]
    if there and not force and not _is_ours(folder / there[0]):
        raise OutputError(
            f"{folder / there[0]}: exists and was not written by frictionlab campaign: choose another folder, or give"
            " --force"
        )


def _is_ours(path: Path) -> bool:
    head = path.read_bytes()[:4000].decode(errors="replace")
    return MARK in head if path.name == REPORT else head.startswith(FIRST_COLUMNS[path.name])


def write_tables(campaign: Campaign, folder: Path) -> tuple[Path, ...]:
    """Write ``measurements.csv``, ``friction.csv``, ``ranking.csv`` and ``drift.csv`` into a folder.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    p = {test.material: test.p for test in campaign.amontons}
    tables: tuple[tuple[str, tuple[str, ...], list[Row]], ...] = (
        ("measurements.csv", measurement_columns(campaign), list(measurement_rows(campaign))),
        ("friction.csv", FRICTION, [{**friction_row(f), "amontons_p": p[f.material]} for f in campaign.fits]),
        ("ranking.csv", RANKING, [ranking_row(rank) for rank in campaign.ranking]),
        ("drift.csv", DRIFT, [drift_row(drift) for drift in campaign.drifts]),
    )
    for name, columns, rows in tables:
        write_rows(rows, folder / name, columns)
    return tuple(folder / name for name, _, _ in tables)


def measurement_columns(campaign: Campaign) -> tuple[str, ...]:
    """Columns of ``measurements.csv``: all that any measurement holds, and what the fits say of each test."""
    found = dict.fromkeys(key for trial in campaign.trials for key in trial.row)
    middle = (key for key in found if key not in (*MEASUREMENTS_FIRST, *MEASUREMENTS_LAST))
    return (*MEASUREMENTS_FIRST, *middle, *MEASUREMENTS_LAST)


def measurement_rows(campaign: Campaign) -> Iterator[Row]:
    """One row per test, failed ones too."""
    verdicts = campaign.verdicts
    for trial in campaign.trials:
        yield {**_told(trial), **_judged(verdicts.get(trial.source))}


def _told(trial: Trial) -> Row:
    status = "failed" if trial.failed else trial.row.get("status") or "ok"
    low, high = trial.irregularity_interval
    own = {"source": trial.source, "status": status, "reason": trial.reason}
    return {**trial.row, **own, "irregularity_low": low, "irregularity_high": high}


def _judged(verdict: Verdict | None) -> Row:
    if verdict is None:
        return {}
    predicted = verdict.predicted
    return {
        "test_friction_ratio": verdict.friction_ratio,
        "test_friction_ratio_se": verdict.friction_ratio_se,
        "predicted_energy_per_cycle": predicted.energy if predicted else None,
        "predicted_response_amplitude": predicted.amplitude if predicted else None,
        "predicted_stops_per_cycle": predicted.stops if predicted else None,
        "energy_residual": verdict.residual,
        "left_out_of_fit": verdict.excluded,
    }


def friction_row(fit: FrictionFit) -> dict[str, object]:
    """One row of ``friction.csv``."""
    direct = {key: getattr(fit, key) for key in FRICTION if hasattr(fit, key)}
    short = [v for v in fit.verdicts if not v.trial.is_long]
    low, high = fit.coefficient_interval
    return {
        **direct,
        "tests": len(short or fit.verdicts),
        "friction_coefficient_low": low,
        "friction_coefficient_high": high,
        "tests_used": len(fit.used),
    }


def ranking_row(rank: Rank) -> Row:
    """One row of ``ranking.csv``."""
    row = {key: getattr(rank, key) for key in RANKING}
    return {**row, "tied_with": ", ".join(rank.tied_with) or None}


def drift_row(drift: Drift) -> Row:
    """One row of ``drift.csv``; slopes per hour, relative ones as fractions per hour."""
    trial = drift.trial
    return {
        "source": trial.source,
        "material": trial.material,
        "normal_force_n": trial.normal_force_n,
        "frequency_ratio": trial.frequency_ratio,
        "duration_s": trial.duration_s,
        "slope_per_hour": drift.slope_per_hour,
        "slope_per_hour_se": drift.slope_per_hour_se,
        "slope_per_hour_low": drift.low,
        "slope_per_hour_high": drift.high,
        "relative_slope_per_hour": drift.relative_per_hour,
        "relative_slope_per_hour_se": drift.relative_per_hour_se,
        "friction_slope_per_hour": drift.friction_per_hour,
        "friction_slope_per_hour_se": drift.friction_per_hour_se,
        "verdict": drift.verdict,
        "note": drift.note,
    }
