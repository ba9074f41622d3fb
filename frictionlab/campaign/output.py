"""The tables of a campaign as files: the contract's columns first, then what else helps."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from frictionlab.campaign import Campaign, Drift, FrictionFit, LawEvidence, LawParameter, Rank, Trial, Verdict
from frictionlab.errors import OutputError
from frictionlab.files import make_folder, refuse_inputs, refuse_protected
from frictionlab.inference.material_law import is_material_law
from frictionlab.schema import DRIFTS, FRICTION, LAW_PARAMETERS, LEFT_OUT, MATERIAL_LAWS, RANKING, TESTS, Table
from frictionlab.tables import Row, is_table, write_rows

TABLES: Mapping[str, Table] = {
    "measurements.csv": TESTS,
    "friction.csv": FRICTION,
    "ranking.csv": RANKING,
    "drift.csv": DRIFTS,
    "laws.csv": MATERIAL_LAWS,
    "parameters.csv": LAW_PARAMETERS,
    "left_out.csv": LEFT_OUT,
}
REPORT = "report.html"
MARK = '<meta name="generator" content="frictionlab'


def check_folder(folder: Path, *, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Make the output folder, and refuse one that holds files of these names which are not an earlier campaign's.

    Raises
    ------
    OutputError
        It cannot be made, or the files in it may not be replaced.
    UsageError
        One of them is an input.
    """
    refuse_inputs((folder / name for name in (*TABLES, REPORT)), inputs)
    for name in (*TABLES, REPORT):
        refuse_protected(folder / name, force=force)
    make_folder(folder / "figures")
    there = [name for name in (*TABLES, REPORT) if (folder / name).exists()]
    strange = [name for name in there if not _is_ours(folder / name)]
    if strange and not force:
        raise OutputError(
            f"{folder / strange[0]}: exists and was not written by frictionlab campaign: choose another folder, or give"
            " --force"
        )


def _is_ours(path: Path) -> bool:
    if path.name in TABLES:
        return is_table(path, TABLES[path.name])
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return MARK in file.read(4000).decode(errors="replace")


def write_tables(campaign: Campaign, folder: Path) -> tuple[Path, ...]:
    """Write `TABLES`, and the law of each material, ``law_MATERIAL.toml``; laws of an earlier campaign go.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    rows = rows_of(campaign)
    for name, table in TABLES.items():
        write_rows(rows[name], folder / name, table, force=True)
    laws = {law_file(law.material): law for law in campaign.material_laws}
    for old in set(folder.glob("law_*.toml")) - {folder / name for name in laws}:
        if is_material_law(old):
            old.unlink()
    for name, law in laws.items():
        law.write(folder / name)
    return (*(folder / name for name in TABLES), *(folder / name for name in laws))


def law_file(material: str) -> str:
    """Return the name of a material's law; what stands badly in a file's name is an underscore.

    Examples
    --------
    >>> law_file("brass on steel/2")
    'law_brass_on_steel_2.toml'
    """
    plain = re.sub(r"[^\w.+-]", "_", material)
    return f"law_{plain}.toml"


def rows_of(campaign: Campaign) -> Mapping[str, list[Row]]:
    """The rows of each table of a campaign, by the name of its file."""
    p = {test.material: test.p for test in campaign.amontons}
    return {
        "measurements.csv": list(measurement_rows(campaign)),
        "friction.csv": [{**friction_row(f), "amontons_p": p[f.material]} for f in campaign.fits],
        "ranking.csv": [ranking_row(rank) for rank in campaign.ranking],
        "drift.csv": [drift_row(drift) for drift in campaign.drifts],
        "laws.csv": [law_row(law) for law in campaign.laws],
        "parameters.csv": [parameter_row(parameter) for parameter in campaign.parameters],
        "left_out.csv": [{key: getattr(test, key) for key in LEFT_OUT.names} for test in campaign.left_out],
    }


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
        "test_friction_ratio_u": verdict.alone.u,
        "test_misfit": verdict.misfit,
        "predicted_energy_per_cycle": predicted.energy_per_cycle if predicted else None,
        "predicted_response_amplitude": predicted.response_amplitude if predicted else None,
        "predicted_stops_per_cycle": predicted.stops_per_cycle if predicted else None,
        "energy_residual": verdict.residual,
        "left_out_of_fit": verdict.excluded.sentence if verdict.excluded else None,
        "left_out_code": verdict.excluded.cause.value if verdict.excluded else None,
    }


def friction_row(fit: FrictionFit) -> dict[str, object]:
    """One row of ``friction.csv``."""
    direct = {key: getattr(fit, key) for key in FRICTION.names if hasattr(fit, key)}
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
    row = {key: getattr(rank, key) for key in RANKING.names}
    return {**row, "tied_with": ", ".join(rank.tied_with) or None}


def law_row(law: LawEvidence) -> Row:
    """One row of ``laws.csv``."""
    return {key: getattr(law, key) for key in MATERIAL_LAWS.names}


def parameter_row(parameter: LawParameter) -> Row:
    """One row of ``parameters.csv``."""
    return {key: getattr(parameter, key) for key in LAW_PARAMETERS.names}


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
