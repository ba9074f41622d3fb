"""A test is left out by a code; the sentence is for people, and rewording it changes nothing but the words."""

import pytest

from frictionlab.campaign import FrictionFit, Rank, Trial, trial_of
from frictionlab.campaign.friction import Cause
from frictionlab.campaign.ranking import rank_all
from tests.campaign.fabricate import fit_of, row

FORCE, TRUE = 1.5, 0.6
NUMBERS = {Cause.UNSTEADY: (0.4,), Cause.ASYMMETRIC: (0.3,), Cause.UNSETTLED: (0.05,), Cause.UNEXPLAINED: (0.9, 0.6)}


def mixed(*, usable: bool) -> list[Trial]:
    """Tests that are left out for every cause, and good ones beside them."""
    odd: list[dict[str, object]] = [
        {"duration_s": 1800.0}, {"regime": "stuck"}, {"irregularity_index": 0.4}, {"asymmetry": 0.3},
        {"frequency_ratio": 1.0}, {"energy_per_cycle": 6.0},
    ]  # fmt: skip
    bad = [{**row("steel", FORCE, 0.9 + 0.1 * i, TRUE), **what, "source": f"odd {i}"} for i, what in enumerate(odd)]
    good = [row("steel", FORCE, r, TRUE, noise=0.003) for r in (0.3, 0.5, 0.7, 1.4, 1.7)] if usable else []
    slow = {**row("steel", 0.3, 0.5, TRUE, noise=0.0), "normal_force_n": FORCE, "source": "slow"}
    return [trial_of(each) for each in (*bad, *good, *([] if usable else [slow]))]


def told(*, usable: bool) -> tuple[FrictionFit, tuple[Rank, ...]]:
    fit = fit_of(mixed(usable=usable))
    return fit, rank_all([fit], [], ["steel"])


@pytest.mark.parametrize("usable", [True, False])
def test_rewording_every_sentence_changes_no_number(monkeypatch: pytest.MonkeyPatch, *, usable: bool) -> None:
    before, ranks = told(usable=usable)
    for cause in Cause:
        monkeypatch.setattr(cause, "sentence", f"stuck near a long test, unsteady or unsettled ({cause.name})")
    after, ranks_after = told(usable=usable)
    assert ranks_after == ranks
    for name in ("friction_ratio", "friction_ratio_se", "friction_coefficient", "low", "high", "scatter", "note"):
        assert getattr(after, name) == getattr(before, name)
    causes = [[v.excluded and v.excluded.cause for v in fit.verdicts] for fit in (before, after)]
    assert causes[0] == causes[1]
    assert any(causes[0])
    assert [str(v.excluded) for v in after.verdicts] != [str(v.excluded) for v in before.verdicts]


def test_each_cause_is_met() -> None:
    met = {v.excluded.cause for v in told(usable=True)[0].verdicts if v.excluded is not None}
    assert met >= {Cause.LONG, Cause.STUCK, Cause.UNSTEADY, Cause.ASYMMETRIC, Cause.NEAR_RESONANCE, Cause.UNEXPLAINED}


@pytest.mark.parametrize("cause", Cause)
def test_a_sentence_begins_with_what_it_is_about(cause: Cause) -> None:
    said = cause.because(*NUMBERS.get(cause, ()))
    assert (said.cause, str(said)) == (cause, said.sentence)
    assert cause.value in said.sentence
    assert "{" not in said.sentence
