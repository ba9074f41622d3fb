"""One setting of one knob, and which settings are beaten."""

import gc
import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace

ROUNDING = 1e-14  # errors below this are all the same: rounding
BETTER = 0.95  # an error is smaller if it is below this share of the other
FASTER = 0.6  # a time is shorter if it is below this share of the other: two runs differ by less
FIRST_TWICE = 1.5  # seconds; up to this a first run is repeated, for it may have loaded or compiled something
LAPS = 7  # runs of one setting, at most
WORTH_REPEATING = 0.8  # seconds spent on the repetitions of one setting, at most about


@dataclass(frozen=True)
class Setting:
    """One setting of one knob: the contract's keys, then what helps.

    ``error`` relative, of ``quantity``, against ``reference``; ``seconds``: the shortest of several runs;
    ``default``: what commands use unless told otherwise; ``dominated``: another setting of the knob beats it in both;
    ``over_bound``: the error in units of the Cramer-Rao bound; ``size_bytes``: of the file; ``None`` where it has none.
    """

    knob: str
    setting: str
    quantity: str
    error: float
    seconds: float
    default: bool = False
    dominated: bool = False
    over_bound: float | None = None
    size_bytes: int | None = None
    reference: str = ""

    def row(self) -> dict[str, object]:
        """A line of JSON or of a table."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


@dataclass(frozen=True)
class Run:
    """A setting before it is run: ``run`` does the work, ``error_of`` judges what it returned."""

    setting: str
    run: Callable[[], object]
    error_of: Callable[[object], float]
    default: bool = False


def beats(one: Setting, other: Setting) -> bool:
    """Whether one setting is better than another in both error and time, by more than rounding and a run's scatter."""
    smaller = max(one.error, ROUNDING) < BETTER * max(other.error, ROUNDING)
    return smaller and one.seconds < FASTER * other.seconds


def marked(settings: Sequence[Setting]) -> tuple[Setting, ...]:
    """Mark the settings of a knob that others beat.

    Examples
    --------
    >>> slow, fast = Setting("k", "slow", "q", 1e-3, 2.0), Setting("k", "fast", "q", 1e-6, 1.0)
    >>> [s.dominated for s in marked([slow, fast])]
    [True, False]
    """
    return tuple(replace(s, dominated=any(beats(other, s) for other in settings)) for s in settings)


def pareto_front(settings: Iterable[Setting]) -> tuple[Setting, ...]:
    """The settings that none beats, from the fastest on."""
    kept = [s for s in settings if not s.dominated]
    return tuple(sorted(kept, key=lambda s: (s.seconds, s.error)))


def run_trials(knob: str, quantity: str, reference: str, trials: Sequence[Run]) -> tuple[Setting, ...]:
    """Run all settings of a knob in turn, several rounds of them, and judge each by its result and its shortest time.

    Going round keeps a slow minute of the machine from being one setting's bad luck.
    """
    shortest = [math.inf] * len(trials)
    spent = [0.0] * len(trials)
    errors = [math.nan] * len(trials)
    for lap in range(LAPS):
        for i, trial in enumerate(trials):
            if spent[i] > (WORTH_REPEATING if lap > 1 else FIRST_TWICE):
                continue
            seconds, result = timed(trial.run)
            shortest[i], spent[i] = min(shortest[i], seconds), spent[i] + seconds
            if math.isnan(errors[i]):
                errors[i] = trial.error_of(result)
    return marked(
        [
            Setting(knob, trial.setting, quantity, error, seconds, trial.default, reference=reference)
            for trial, error, seconds in zip(trials, errors, shortest, strict=True)
        ]
    )


def timed(run: Callable[[], object]) -> tuple[float, object]:
    """Seconds that a call took, and what it returned; the collector of garbage waits."""
    gc.disable()
    try:
        start = time.perf_counter()
        result = run()
        return time.perf_counter() - start, result
    finally:
        gc.enable()
