"""Free vibration: natural frequency, viscous damping ratio and friction of the frame, from each tap of a record."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from frictionlab.analysis.decay import DecayFit, first_guess, fit_decay, misfit_of
from frictionlab.analysis.hum import without_high_lines
from frictionlab.analysis.signals import EVEN, stray
from frictionlab.analysis.taps import Turnings, find_taps
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Average, Estimate, average

_PER_HALF_CYCLE = 40  # samples that a fit needs; more are averaged
_ODD = 0.02  # rms left over the first swing: of another kind than viscous and Coulomb
_NO_DECAY = 0.1  # ... and no free decay at all
_DRIVEN = 0.05  # base's swing over the mass's
_NOT_AT_REST = 0.005
_DOUBT = 3.0  # standard errors below 0
_WORDS = {"zeta": "viscous damping", "friction": "friction"}


@dataclass(frozen=True)
class Swing:
    """What was fitted: ``time`` (n,) s, ``measured`` and ``fitted`` displacement of the mass (n,) m."""

    time: FloatArray
    measured: FloatArray
    fitted: FloatArray


@dataclass(frozen=True)
class FreeVibration:
    """One free decay.

    Parameters
    ----------
    start_s
        When the part fitted begins: the second turning point after the release.
    natural_frequency_hz, damped_frequency_hz
        Without and with the viscous damping.
    damping_ratio
        Viscous, of the dashpot between mass and base.
    friction_m
        Friction force over stiffness, F/k [m].
    natural_frequency_hz_se, damping_ratio_se, friction_m_se
        Standard errors; ``None`` for what came out negative and is held at 0.
    damping_ratio_upper, friction_m_upper
        The one-sided 95 % limit of what is held at 0; else ``None``.
    friction_over_swing
        F / (k a), with ``a`` the first swing.
    amplitude_m
        That first swing.
    half_cycles
        How many were fitted.
    misfit
        Rms of what the fit leaves over the first swing.
    cubic_share, cubic_share_se
        Share of the spring's force at the first swing that grows with its cube, and its standard error; 0 and ``None``
        where none shows. Natural frequency, damping and friction are then of small swings.
    warnings
        Sentences.
    swing
        The samples and the fit.
    """

    start_s: float
    natural_frequency_hz: float
    natural_frequency_hz_se: float
    damped_frequency_hz: float
    damping_ratio: float
    damping_ratio_se: float | None
    damping_ratio_upper: float | None
    friction_m: float
    friction_m_se: float | None
    friction_m_upper: float | None
    friction_over_swing: float
    amplitude_m: float
    half_cycles: int
    misfit: float
    cubic_share: float
    cubic_share_se: float | None
    warnings: tuple[str, ...]
    swing: Swing

    def __repr__(self) -> str:
        frequency = Estimate(self.natural_frequency_hz, self.natural_frequency_hz_se)
        damping = Estimate(self.damping_ratio, self.damping_ratio_se)
        friction = Estimate(1e6 * self.friction_m, None if self.friction_m_se is None else 1e6 * self.friction_m_se)
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        return (
            f"<FreeVibration at {self.start_s:.3g} s: {frequency} Hz, damping ratio {damping}, F/k {friction} um{said}>"
        )


def free_vibrations(
    time: FloatArray, displacement: FloatArray, base: FloatArray | None = None, *, pendulum: bool = False
) -> tuple[FreeVibration, ...]:
    """Fit the exact decay under viscous and Coulomb damping to each tap of a record, hum taken out.

    Parameters
    ----------
    time, displacement : (n,) arrays
        s, increasing; the mass, m (a pendulum: rad). May begin before the release and go on after the motion died.
    base : (n,) array, optional
        The base, m: what moves there is no free vibration.
    pendulum : bool
        The restoring force is the sine of an angle.

    Raises
    ------
    AnalysisError
        No decay of six half-cycles; a motion that is driven or grows; or none of the decays follows the two dampings.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.004)
    >>> decay = 5e-3 * np.exp(-0.01 * 2 * np.pi * 3.0 * t) * np.cos(2 * np.pi * 3.0 * np.sqrt(1 - 1e-4) * t)
    >>> tap = free_vibrations(t, decay)[0]
    >>> print(f"{tap.natural_frequency_hz:.3f} {tap.damping_ratio:.4f} {tap.friction_m < 1e-9}")
    3.000 0.0100 True
    """
    step = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if stray(time, step) < EVEN:
        displacement = without_high_lines(displacement, step)
        base = None if base is None else without_high_lines(base, step)
    taps = find_taps(time, displacement)
    shares = [0.0 if base is None else _base_share(tap, time, base) for tap in taps]
    if max(shares) > _DRIVEN:
        raise AnalysisError(
            f"free vibration: a driven motion: the base moves by {max(shares):.0%} of the mass's swing: expected a base"
            " at rest: hold it, tap the mass, record until it rests"
        )
    found = [
        _free_vibration(time, displacement, tap, share, pendulum=pendulum)
        for tap, share in zip(taps, shares, strict=True)
    ]
    good = tuple(tap for tap in found if tap.misfit <= _NO_DECAY)
    if not good:
        raise AnalysisError(
            "free vibration: no motion under viscous and friction damping fits (an rms of "
            f"{min(t.misfit for t in found):.0%} of the first swing is left): expected a mass that swings freely: "
            "displace it, let go, touch nothing"
        )
    return good


def _base_share(tap: Turnings, time: FloatArray, base: FloatArray) -> float:
    """Swing of the base (sqrt 2 times its rms) while the mass swings freely, over the mass's first swing."""
    part = base[(time >= tap.time[0]) & (time <= tap.time[-1])]
    return math.sqrt(2.0) * float(np.std(part)) / float(tap.swing[0]) if len(part) > 1 else 0.0


def _free_vibration(time: FloatArray, x: FloatArray, tap: Turnings, share: float, *, pendulum: bool) -> FreeVibration:
    inside = (time >= tap.time[0]) & (time <= tap.time[-1])
    guess = replace(first_guess(tap.time, tap.height), pendulum=pendulum)
    t, seen = _thinned(time[inside], x[inside], guess.half_period, guess.rest)
    fit = fit_decay(t, seen, guess)
    decay, se = fit.decay, fit.se
    return FreeVibration(
        start_s=decay.start,
        natural_frequency_hz=decay.omega / (2.0 * math.pi),
        natural_frequency_hz_se=se.omega / (2.0 * math.pi),
        damped_frequency_hz=0.5 / decay.half_period,
        damping_ratio=decay.zeta,
        damping_ratio_se=None if "zeta" in fit.held else se.zeta,
        damping_ratio_upper=fit.limits.get("zeta"),
        friction_m=decay.friction,
        friction_m_se=None if "friction" in fit.held else se.friction,
        friction_m_upper=fit.limits.get("friction"),
        friction_over_swing=decay.friction / abs(decay.swing),
        amplitude_m=abs(decay.swing),
        half_cycles=len(tap.swing),
        misfit=misfit_of(fit),
        cubic_share=decay.cubic * decay.swing**2,
        cubic_share_se=se.cubic * decay.swing**2 if decay.cubic else None,
        warnings=tuple(_warnings(fit, share)),
        swing=Swing(t, seen, seen - fit.residual),
    )


def _thinned(time: FloatArray, x: FloatArray, half_period: float, rest: float) -> tuple[FloatArray, FloatArray]:
    """Means of so many neighbours that enough are left; what averaging takes from a sinusoid is given back."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    size = int(half_period / step / _PER_HALF_CYCLE)
    if size < 2:
        return time, x
    count = len(time) // size
    t, mean = (values[: count * size].reshape(count, size).mean(axis=1) for values in (time, x))
    angle = 0.5 * math.pi * step / half_period
    kept = math.sin(size * angle) / (size * math.sin(angle))
    return t, rest + (mean - rest) / kept


def _warnings(fit: DecayFit, base_share: float) -> list[str]:
    said = []
    if base_share > _NOT_AT_REST:
        said.append(
            f"the base moves by {base_share:.1%} of the mass's swing: hold it still: frequency and damping found here"
            " are of mass and base together"
        )
    if fit.decay.cubic:
        share, error = (100.0 * d.cubic * fit.decay.swing**2 for d in (fit.decay, fit.se))
        said.append(
            f"the spring is not linear: its force at the first swing is {share:+.2g} +- {error:.1g} % off, growing with"
            " the cube: natural frequency, damping and friction are of small swings: test with smaller motions"
        )
    if fit.doubt > _DOUBT:
        names = " and ".join(_WORDS[name] for name in fit.held)
        said.append(
            f"{names} would come out negative by {fit.doubt:.2g} standard errors and is held at 0: the damping is of "
            "another kind than viscous and Coulomb"
        )
    misfit = misfit_of(fit)
    if misfit > _ODD:
        said.append(
            f"viscous and Coulomb damping leave {misfit:.1%} of the first swing unexplained: stiffness or damping of "
            "another kind, or a second mode; its share of the errors is in the bars only as far as it scatters"
        )
    return said


def averages(taps: Sequence[FreeVibration]) -> dict[str, Average]:
    """Average over taps of natural frequency, damping ratio and friction, each with its error.

    What is held at 0 counts as 0 with the error that its 95 % limit stands for.

    Raises
    ------
    AnalysisError
        No taps.
    """
    if not taps:
        raise AnalysisError("free vibration: expected at least one tap to average over; got none")
    errors = {
        "natural_frequency_hz": [tap.natural_frequency_hz_se for tap in taps],
        "damping_ratio": [_error(tap.damping_ratio_se, tap.damping_ratio_upper) for tap in taps],
        "friction_m": [_error(tap.friction_m_se, tap.friction_m_upper) for tap in taps],
    }
    return {name: average([getattr(tap, name) for tap in taps], error) for name, error in errors.items()}


def _error(se: float | None, upper: float | None) -> float:
    return se if se is not None else (upper or 0.0) / 1.645


def scene_snippet(means: dict[str, Average]) -> str:
    """The lines of a scene that say what was found, to paste.

    Examples
    --------
    >>> found = {"natural_frequency_hz": Average(3.1261, 2e-4, None), "damping_ratio": Average(0.0055, 1e-5, None)}
    >>> print(scene_snippet(found | {"friction_m": Average(5e-06, 1e-07, None)}))
    [rig]
    natural_frequency_hz = 3.1261
    natural_frequency_hz_u = 0.0002
    damping_ratio = 0.0055
    damping_ratio_u = 1e-05
    # friction of the frame itself, F/k: 5e-06 m, standard error 1e-07 m
    """
    lines = ["[rig]"]
    for name in ("natural_frequency_hz", "damping_ratio"):
        found = means[name]
        lines += [f"{name} = {_digits(found)}", f"{name}_u = {max(found.se, 1e-12):.2g}"]
    friction = means["friction_m"]
    lines.append(f"# friction of the frame itself, F/k: {friction.mean:.4g} m, standard error {friction.se:.2g} m")
    return "\n".join(lines)


def _digits(found: Average) -> str:
    """A mean with two digits of its error."""
    if not found.se > 0.0 or not abs(found.mean) > found.se:
        return f"{found.mean:.4g}"
    return f"{found.mean:.{min(12, 2 + math.ceil(math.log10(abs(found.mean) / found.se)))}g}"
