"""Recordings that try to mislead the identification, drawn at random and judged by their truth.

Run: ``make adversary N=300 SEED=7`` or ``python -m tests.benchmarks.adversary --count 300 --seed 7``; ``--only K`` runs
one draw of a seed again and prints what is found, ``--kind cubic`` draws that kind alone, ``--each`` prints a line for
every draw. ``--of whole`` fits whole records, from their first sample, in place of mean cycles, ``--of campaigns`` four
tests of one material on each rig that is drawn, ``--of decays`` free decays. The motion comes from an integrator that
shares no code with the simulator (Runge-Kutta steps of fourth order, events by bisection). Laws inside and outside the
family are drawn, and what a laboratory does to a recording: lag, gain, noise, hum, steps, a natural frequency that is
not the scene's, a base that is no sine, few samples a cycle, friction that scatters.

Units inside: time in 1 / omega_n, displacement over Y, forces over k Y.
"""

import argparse
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

import frictionlab as fl
from frictionlab.analysis.free_vibration import free_vibrations
from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.campaign import evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.inference.observations import observe
from frictionlab.uncertainty import Estimate

Floats = NDArray[np.float64]
NATURAL_HZ, BASE_M, MASS_KG = 3.13, 1.818e-3, 3.0799
STIFFNESS = MASS_KG * (2.0 * math.pi * NATURAL_HZ) ** 2
FAR = 3.0  # stated uncertainties: an error beyond is counted
STEP_M, NOISE_M = 7.784e-7, 0.8e-6  # of a sensor
STEP = 0.01  # of the integrator, at most: its error is 1e-9 of an amplitude
AHEAD = 1e-6  # over which a limit is differentiated

# What the integrator reads, in this order; a term that is not drawn does nothing.
NAMES = (
    "beta", "gradient", "contact_damping", "static_up", "static_down", "contact_stiffness", "fall", "fall_speed",
    "frame_damping", "cubic", "play", "asymmetry", "second_mass", "second_frequency", "load_by_base", "ripple",
    "ripple_number", "scatter", "scatter_seed",
)  # fmt: skip
NEUTRAL: Mapping[str, float] = dict.fromkeys(NAMES, 0.0) | {
    "static_up": 1.0, "static_down": 1.0, "fall_speed": 1.0, "second_frequency": 1.0, "ripple_number": 1.0,
}  # fmt: skip
DRAW: Mapping[str, Callable[[np.random.Generator], dict[str, float]]] = {
    "place": lambda g: {"gradient": float(g.uniform(0.02, 0.1) * g.choice([-1.0, 1.0]))},
    "speed": lambda g: {"contact_damping": float(g.uniform(0.01, 0.08))},
    "breakaway": lambda g: {f"static_{way}": float(g.uniform(1.0, 1.3)) for way in ("up", "down")},
    "compliance": lambda g: {"contact_stiffness": _log_uniform(g, 10.0, 300.0)},
    "stribeck": lambda g: {"fall": float(g.uniform(0.05, 0.5)), "fall_speed": float(g.uniform(0.02, 0.3))},
    "cubic": lambda g: {"cubic": float(g.uniform(0.003, 0.08) * g.choice([-1.0, 1.0]))},
    "play": lambda g: {"play": float(g.uniform(5e-6, 50e-6) / 2.0 / BASE_M)},
    "asymmetry": lambda g: {"asymmetry": float(g.uniform(0.02, 0.15))},
    "second mass": lambda g: {
        "second_mass": float(g.uniform(0.02, 0.3)),
        "second_frequency": float(g.uniform(2.0, 6.0)),
    },
    "load by base": lambda g: {"load_by_base": float(g.uniform(0.02, 0.2))},
    "ripple": lambda g: {"ripple": float(g.uniform(0.02, 0.2)), "ripple_number": float(g.uniform(2.0, 20.0))},
    "frequency": lambda g: {"declared_hz": NATURAL_HZ * (1.0 + _log_uniform(g, 0.005, 0.4) * g.choice([-1.0, 1.0]))},
    "lag": lambda g: {"lag_s": float(g.uniform(-0.012, 0.012))},
}
"""Terms of laws, then what is outside the family: numbers of the contact, of the scene or of the recording."""
INSIDE = ("coulomb", "speed", "place", "breakaway", "compliance", "stribeck", "place+speed")
OUTSIDE = ("cubic", "play", "asymmetry", "second mass", "load by base", "ripple", "frequency", "lag")
FEW_SAMPLES = "few samples"  # Coulomb above resonance: drawn where it is asked for
DECAYS = ("plain", "hum", "cubic", "scatter", "cubic+hum", "scatter+hum")
FORCES = (0.8, 1.0, 1.0, 1.25)  # normal forces of a campaign's tests, N
SHIFT = 1e-9  # frequency of a base that stands displaced
CAUSES: Mapping[str, tuple[str, ...]] = {
    "cubic": ("cubic", "spring"),
    "play": ("play", "spring"),
    "asymmetry": ("direction", "asymmetr", "breakaway", "offset"),
    "second mass": ("second mass", "natural frequency"),  # a mass that follows lowers it
    "load by base": ("normal force", "acceleration"),
    "ripple": ("path", "place"),
    "frequency": ("natural_frequency", "natural frequency"),
    "lag": ("lag_s",),
}
"""Words of which a warning has at least one when it names the cause; one that begins so names none, for it has all:"""
LISTS = "Sensors and rig as", "Standard errors", "Assumed", "friction that is larger", "law coulomb", "laws "


def _log_uniform(g: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(g.uniform(math.log(low), math.log(high))))


@njit(cache=True)
def _base(t: float, lines: Floats, drive: float) -> tuple[float, float, float]:
    """Displacement, velocity and acceleration of the base."""
    y = v = a = 0.0
    for k in range(lines.shape[0]):
        w = (k + 1) * drive
        c, s = math.cos(w * t), math.sin(w * t)
        y += lines[k, 0] * c + lines[k, 1] * s
        v += w * (lines[k, 1] * c - lines[k, 0] * s)
        a -= w * w * (lines[k, 0] * c + lines[k, 1] * s)
    return y, v, a


@njit(cache=True)
def _pull(t: float, s: Floats, p: Floats, lines: Floats, drive: float) -> float:
    """What frame and second mass exert on the mass, without the contact."""
    y, v, _ = _base(t, lines, drive)
    d: float = s[0] - y
    if p[10] > 0.0:
        d = d - p[10] if d > p[10] else (d + p[10] if d < -p[10] else 0.0)
    force: float = -d - p[9] * d * d * d - 2.0 * p[8] * (s[1] - v)
    force += p[12] * p[13] ** 2 * (s[2] - s[0])
    return force


@njit(cache=True)
def _limit(t: float, s: Floats, side: float, p: Floats, lines: Floats, drive: float) -> float:
    """Friction force of a contact that slides to a side."""
    _, _, a = _base(t, lines, drive)
    strength: float = p[0] * (1.0 + p[1] * s[0]) * (1.0 + p[15] * math.cos(p[16] * s[0])) * (1.0 + p[11] * side)
    strength *= (1.0 + p[14] * a / (drive * drive)) * (1.0 + p[6] * math.exp(-abs(s[1]) / p[7]))
    strength *= 1.0 + s[5]
    return strength


@njit(cache=True)
def _rates(t: float, s: Floats, mode: int, p: Floats, lines: Floats, drive: float, out: Floats) -> None:
    """Derivatives of the state x, v, x2, v2, contact force, by how much friction is off its mean.

    The mode: +-1 slides, 0 stands, 2 is held elastically.
    """
    push = _pull(t, s, p, lines, drive)
    if mode == 0:
        out[0] = out[1] = out[4] = 0.0
    elif mode == 2:
        out[0], out[1], out[4] = s[1], push - s[4], p[5] * s[1]
    else:
        n = mode * _limit(t, s, mode, p, lines, drive) + 2.0 * p[2] * s[1]
        out[0], out[1], out[4] = s[1], push - n, 0.0
    out[2] = s[3]
    out[3] = -(p[13] ** 2) * (s[2] - s[0]) - 0.02 * p[13] * (s[3] - s[1])
    out[5] = 0.0


@njit(cache=True)
def _step(
    t: float, h: float, s: Floats, mode: int, p: Floats, lines: Floats, drive: float, k: Floats, new: Floats
) -> None:
    """One classical Runge-Kutta step into `new`."""
    _rates(t, s, mode, p, lines, drive, k[0])
    _rates(t + 0.5 * h, s + 0.5 * h * k[0], mode, p, lines, drive, k[1])
    _rates(t + 0.5 * h, s + 0.5 * h * k[1], mode, p, lines, drive, k[2])
    _rates(t + h, s + h * k[2], mode, p, lines, drive, k[3])
    new[:] = s + h / 6.0 * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3])


@njit(cache=True)
def _over(t: float, s: Floats, mode: int, p: Floats, lines: Floats, drive: float) -> float:
    """Positive where the mode has ended."""
    over: float = -mode * s[1]
    if abs(mode) == 1 and p[5] > 0.0:  # behind a spring the contact slides by less, where its limit grows
        later = s.copy()
        later[0] += AHEAD * s[1]
        grows = _limit(t + AHEAD, later, mode, p, lines, drive) - _limit(t, s, mode, p, lines, drive)
        over += grows / (AHEAD * p[5])
    if mode == 0:
        push = _pull(t, s, p, lines, drive)
        side = 1.0 if push > 0.0 else -1.0
        over = abs(push) - (p[3] if push > 0.0 else p[4]) * _limit(t, s, side, p, lines, drive)
    if mode == 2:
        over = abs(s[4]) - _limit(t, s, 1.0 if s[4] > 0.0 else -1.0, p, lines, drive)
    return over


@njit(cache=True)
def _next_mode(t: float, s: Floats, mode: int, p: Floats, lines: Floats, drive: float) -> int:
    """The mode after an event; the state is put right in place, and friction scatters anew."""
    if p[17] > 0.0:
        s[5] = p[17] * np.random.standard_normal()  # noqa: NPY002 - what compiled code knows; seeded by `integrate`
    if mode == 0:
        return 1 if _pull(t, s, p, lines, drive) > 0.0 else -1
    if mode == 2:
        return 1 if s[4] > 0.0 else -1
    if p[5] > 0.0:
        s[4] = mode * _limit(t, s, mode, p, lines, drive)
        return 2
    s[1] = 0.0
    if _over(t, s, 0, p, lines, drive) <= 0.0:
        return 0
    return 1 if _pull(t, s, p, lines, drive) > 0.0 else -1


@njit(cache=True)
def integrate(times: Floats, p: Floats, lines: Floats, drive: float, longest: float) -> Floats:
    """Displacement of the mass at the times, from rest at time 0."""
    out = np.empty(len(times))
    s, new, k = np.zeros(6), np.zeros(6), np.zeros((4, 6))
    np.random.seed(int(p[18]))  # noqa: NPY002 - as above
    t, mode = 0.0, 2 if p[5] > 0.0 else 0
    for i in range(len(times)):
        while times[i] - t > 1e-13:
            h = min(longest, times[i] - t)
            _step(t, h, s, mode, p, lines, drive, k, new)
            if _over(t + h, new, mode, p, lines, drive) > 0.0:
                low, high = 0.0, h
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    _step(t, middle, s, mode, p, lines, drive, k, new)
                    if _over(t + middle, new, mode, p, lines, drive) > 0.0:
                        high = middle
                    else:
                        low = middle
                _step(t, high, s, mode, p, lines, drive, k, new)
                t, s[:] = t + high, new
                mode = _next_mode(t, s, mode, p, lines, drive)
            else:
                t, s[:] = t + h, new
        out[i] = s[0]
    return out


@dataclass(frozen=True)
class Draw:
    """One recording that was drawn: its contact, its rig, what the sensors do, and what the scene declares."""

    number: int
    law: str
    kind: str
    r: float
    values: Mapping[str, float]
    base: Floats
    rate_hz: float
    seconds: float
    lag_s: float = 0.0
    gains: tuple[float, float] = (1.0, 1.0)
    noise_m: float = NOISE_M
    hum_m: float = 0.0
    declared_hz: float = NATURAL_HZ
    seed: list[int] = field(default_factory=list)

    def recording(self) -> fl.Recording:
        """What the two sensors write down."""
        noise = np.random.default_rng([*self.seed, 1])
        t = np.arange(int(self.seconds * self.rate_hz)) / self.rate_hz
        omega = 2.0 * math.pi * NATURAL_HZ
        x = integrate(omega * t, contact_of(self.values), self.base, self.r, STEP)
        y = np.array([_base(omega * (s - self.lag_s), self.base, self.r)[0] for s in t])
        seen = [
            read(gain * BASE_M * values, t, self.hum_m, self.noise_m, noise)
            for values, gain in zip((x, y), self.gains, strict=True)
        ]
        return fl.Recording(t, seen[0], seen[1])

    def scene(self) -> fl.Scene:
        """What the laboratory declares."""
        rig = {"natural_frequency_hz": self.declared_hz, "stiffness_n_per_m": STIFFNESS, "damping_ratio": 0.0055}
        return fl.scene_from_tables({"rig": rig, "analysis": {"transient_s": 0.4 * self.seconds, "cycles": "all"}})


def contact_of(values: Mapping[str, float]) -> Floats:
    """Return what the integrator reads; a term that is not named does nothing."""
    return np.array([values.get(name, NEUTRAL[name]) for name in NAMES])


def read(metres: Floats, t: Floats, hum_m: float, noise_m: float, noise: np.random.Generator) -> Floats:
    """Return what a sensor reads of a motion: hum, noise and its step."""
    hum = hum_m * np.sin(2.0 * math.pi * 50.0 * t + noise.uniform(0.0, 6.0))
    return np.asarray(np.round((metres + hum + noise.normal(0.0, noise_m, len(t))) / STEP_M) * STEP_M)


def drawn(seed: int, number: int, kind: str | None = None) -> Draw:
    """Return the recording of a seed and a number, of any kind or of the one that is asked for."""
    g = np.random.default_rng([seed, number])
    law = str(g.choice(INSIDE))
    any_kind = str(g.choice([*OUTSIDE, *[""] * len(OUTSIDE)]))
    kind, few = any_kind if kind is None else kind, kind == FEW_SAMPLES
    law = "coulomb" if few else law
    values = {"beta": float(g.uniform(0.1, 0.65)), "frame_damping": 0.0055}
    for term in law.split("+"):
        values |= DRAW[term](g) if term in DRAW else {}
    r = _log_uniform(g, 1.1 if few else 0.08, 1.6)
    drawn_too = DRAW[kind](g) if kind in DRAW else {}
    more = {name: drawn_too.pop(name) for name in ("declared_hz", "lag_s") if name in drawn_too}
    values |= drawn_too
    harmonics = np.zeros((3, 2))
    harmonics[0, 0] = 1.0
    harmonics[1:] = g.normal(0.0, 0.006, (2, 2)) * g.choice([0.0, 1.0])
    cycle_s = 1.0 / (r * NATURAL_HZ)
    samples = _log_uniform(g, 11.0, 20.0 if few else 400.0)
    rate = float(np.clip(samples / cycle_s, 10.0, 1000.0))
    return Draw(
        number, law, kind, r, values, harmonics, rate, float(np.clip(g.integers(8, 30) * cycle_s, 8.0, 90.0)),
        gains=(float(g.normal(1.0, 0.001)), float(g.normal(1.0, 0.001))),
        hum_m=float(g.choice([0.0, g.uniform(0.0, 5e-6)])), seed=[seed, number], **more,
    )  # fmt: skip


def by_test(draw: Draw, fit: Literal["cycle", "whole"]) -> dict[str, Any]:
    """Identify one recording under `--law auto`: its mean cycle, or the whole of it."""
    found = fl.compare(draw.recording(), draw.scene(), law="auto", fit=fit)
    told = {"verdict": str(found.verdict), "law": found.law, "said": found.warnings}
    return over(found.friction, draw.values["beta"]) | told


def measured_tests(draw: Draw, count: int = len(FORCES)) -> list[Measurement]:
    """Measure so many tests of one material on the drawn rig, each with its own normal force and frequency ratio."""
    g, tests = np.random.default_rng([*draw.seed, 2]), list[Measurement]()
    for i, force in enumerate(FORCES[:count]):
        own = {"beta": force * draw.values["beta"]} | (DRAW["place"](g) if "gradient" in draw.values else {})
        r = float(np.clip(draw.r * g.uniform(0.7, 1.3), 0.08, 1.6))
        test = replace(draw, r=r, values={**draw.values, **own}, seed=[*draw.seed, 3 + i])
        measured = measure(test.recording(), draw.scene())
        tests.append(replace(measured, source=f"{i}", material="steel", normal_force_n=force))
    return tests


def by_campaign(draw: Draw) -> dict[str, Any]:
    """Identify four tests of one material on the drawn rig: the normal force whose friction is farthest off."""
    known, tests = draw.scene(), measured_tests(draw)
    trials = [trial_of({**measured.row(), "warnings": []}) for measured in tests]
    observations = {measured.source: observe(measured, known) for measured in tests}
    found = evaluate(trials, known, observations=observations, find_law=True)
    said = *found.notes, *(fit.note for fit in found.fits)
    each = [over(fit.friction, fit.normal_force_n * draw.values["beta"]) for fit in found.fits]
    verdict = "misfit" if any("does not explain" in one for one in said) else "explained"
    told = {"verdict": verdict, "law": str(found.fits[0].law), "said": said}
    return max(each, key=lambda one: abs(one["ratio"] - 1.0) / one["u"]) | told


def over(found: Estimate, truth: float) -> dict[str, Any]:
    """Return a number over its truth, with the error that is stated; what is not found is not off."""
    return {"ratio": (found.value or truth) / truth, "u": (found.u or math.inf) / truth}


@dataclass(frozen=True)
class Judged:
    """What came of a draw: the number over its truth, its stated error, verdict, law, and all that is said.

    ``words`` of what was drawn.
    """

    number: int
    words: str
    kind: str
    seconds: float
    ratio: float = 1.0
    u: float = math.inf
    verdict: str = "refused"
    law: str = ""
    said: tuple[str, ...] = ()

    @property
    def named(self) -> bool:
        """Whether a warning names the cause; of a decay any warning does."""
        words = CAUSES.get(self.kind, ("",) if self.kind.startswith("decay") else ())
        return any(word in said for word in words for said in self.said if not said.startswith(LISTS))

    @property
    def is_far(self) -> bool:
        """Whether the number is far off by what is stated."""
        return abs(self.ratio - 1.0) > FAR * self.u

    @property
    def is_wrong(self) -> bool:
        """Explained, far off, and no warning names the cause."""
        return self.verdict == "explained" and self.is_far and not self.named

    @property
    def line(self) -> str:
        """Error, stated uncertainty, verdict and cause in a line."""
        told = "named" if self.named else "not named" if self.kind in CAUSES else ""
        number = f"{100 * self.ratio - 100:+8.2f} % u {100 * self.u:6.2f} %"
        return f"{self.number:4} {self.words} {number}  {self.verdict:9} {told:9} {self.law} {self.seconds:.1f} s"


def judge(seed: int, number: int, kind: str | None = None, of: str = "cycles") -> Judged:
    """Draw, identify, and hold what is found against the truth."""
    began, found = time.process_time(), dict[str, Any]()
    if of == "decays":
        kind, worst, errors, said = judge_decay(seed, number)
        kind, words = f"decay {kind}", f"{kind:12}"
        if worst != "refused":
            found = {"ratio": 1.0 + 0.01 * errors, "u": 0.01, "verdict": "explained", "law": worst, "said": said}
    else:
        draw = drawn(seed, number, kind)
        try:
            found = by_campaign(draw) if of == "campaigns" else by_test(draw, "whole" if of == "whole" else "cycle")
        except fl.FrictionlabError as error:
            found = {"said": (str(error),)}
        kind, cause = draw.kind, f"{draw.values[draw.kind]:.3g}" if draw.kind in draw.values else ""
        words = f"{draw.law:12} {kind or 'as declared':12} {cause:8} r {draw.r:.3f}"
    return Judged(number, words, kind, time.process_time() - began, **found)


def report(again: str, rows: list[Judged], faults: list[str]) -> str:
    """Counts, the worst draws and how to run each of them again: by a command that lacks the number."""
    wrong = [row for row in rows if row.is_wrong]
    share, longest = 100 * len(wrong) / max(len(rows), 1), max((row.seconds for row in rows), default=0.0)
    lines = [
        f"{len(rows) + len(faults)} draws: {len(faults)} program faults, longest {longest:.1f} s of CPU",
        f"explained, more than {FAR:g} u off and the cause not named: {len(wrong)} ({share:.1f} %)",
    ]
    for kind in sorted({row.kind for row in rows}):
        own = [row for row in rows if row.kind == kind]
        verdicts = ", ".join(f"{verdict} {n}" for verdict, n in sorted(Counter(r.verdict for r in own).items()))
        far, named, bad = (sum(getattr(row, name) for row in own) for name in ("is_far", "named", "is_wrong"))
        told = f"beyond {FAR:g} u {far}, named {named}, wrong {bad}"
        lines.append(f"{kind or 'as declared':20} {len(own):4}: {verdicts}; {told}")
    for row in sorted(wrong, key=lambda row: -abs(row.ratio - 1.0) / row.u)[:12]:
        lines += [f"  {(row.ratio - 1.0) / row.u:+8.1f} u {row.line}", f"    {again} {row.number}"]
    return "\n".join([*lines, *faults])


def decay(seed: int, number: int) -> tuple[str, Mapping[str, float], Floats, Floats]:
    """Return a free decay that is drawn: its kind, its truth, times and what the sensor reads."""
    g = np.random.default_rng([seed, number])
    kind, first = str(g.choice(DECAYS)), float(g.uniform(1e-3, 6e-3))
    zeta, friction = _log_uniform(g, 1e-3, 2e-2), float(g.uniform(0.0, 0.01)) * first
    values = {"frame_damping": zeta, "beta": friction / BASE_M, "scatter_seed": float(number)}
    if "cubic" in kind:
        values["cubic"] = float(g.uniform(0.003, 0.08) * g.choice([-1.0, 1.0])) * (BASE_M / first) ** 2
    if "scatter" in kind:
        values["scatter"] = float(g.uniform(0.02, 0.3))
    rate, omega = _log_uniform(g, 60.0, 1000.0), 2.0 * math.pi * NATURAL_HZ
    t = np.arange(int(g.uniform(8.0, 40.0) * rate)) / rate
    x = integrate(omega * t, contact_of(values), np.array([[first / BASE_M, 0.0]]), SHIFT, STEP)
    hum = float(g.uniform(1e-6, 2e-5)) if "hum" in kind else 0.0
    truth = {"natural_frequency_hz": NATURAL_HZ, "damping_ratio": zeta, "friction_m": friction}
    return kind, truth, t, read(BASE_M * x, t, hum, NOISE_M, g)


def judge_decay(seed: int, number: int) -> tuple[str, str, float, tuple[str, ...]]:
    """Return the kind of a drawn decay, the worst number found, how many errors it is off, and what is warned of."""
    kind, truth, t, x = decay(seed, number)
    try:
        tap = free_vibrations(t, x)[0]
    except fl.FrictionlabError as error:
        return kind, "refused", 0.0, (str(error),)
    off = {}
    for name, true in truth.items():
        se = getattr(tap, f"{name}_se") or getattr(tap, f"{name}_upper", 0.0) / 1.645
        off[name] = (getattr(tap, name) - true) / se
    worst = max(off, key=lambda name: abs(off[name]))
    return kind, worst, off[worst], tap.warnings


def main() -> None:
    """Draw, identify, judge, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=7)
    options.add_argument("--only", type=int)
    options.add_argument("--kind", choices=[*OUTSIDE, FEW_SAMPLES])
    options.add_argument("--of", choices=["cycles", "whole", "campaigns", "decays"], default="cycles")
    options.add_argument("--each", action="store_true", help="print a line for every draw")
    given = options.parse_args()
    kind = f" --kind '{given.kind}'" if given.kind else ""
    again = f"python -m tests.benchmarks.adversary --seed {given.seed} --of {given.of}{kind} --only"
    if given.only is not None:
        print(*(row := judge(given.seed, given.only, given.kind, given.of)).said, row.line, sep="\n")
        return
    rows, faults = list[Judged](), list[str]()
    for number in range(given.count):
        try:
            rows.append(judge(given.seed, number, given.kind, given.of))
        except Exception as error:  # noqa: BLE001 - a program fault is what is counted here
            faults.append(f"  FAULT {type(error).__name__}: {error}: {again} {number}")
        else:
            print(*([rows[-1].line] if given.each else []), sep="\n", end="\n" if given.each else "", flush=True)
    print(report(again, rows, faults))


if __name__ == "__main__":
    main()
