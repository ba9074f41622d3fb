"""A recorded motion of the base -> what the mass does under it: units put on, doubtful records refused or doubted."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from frictionlab.analysis.channels import denoised, integrated
from frictionlab.analysis.signals import white_noise
from frictionlab.arrays import FloatArray
from frictionlab.errors import RecordingError
from frictionlab.recording import Channel, Quality, Recording, Source
from frictionlab.simulator import Problem, Structure
from frictionlab.simulator.record import BaseRecord, Response, respond
from frictionlab.simulator.structure import frame_of

HOLE = 1000.0  # times the usual step between two samples
QUIET = 1e-7  # of the base's range: a motion whose noise is less is clean
COARSE = 1e-3  # sampling error over Y from which it is said
ORDER_LEFT = 15.0  # 2^4 - 1: what a spline of every other sample errs more


@dataclass(frozen=True)
class RecordResponse:
    """The response to a recorded motion of the base, whose source is named.

    ``response``: dimensionless, its base's scale is Y [m]; ``recording``: the base as it was given, and the mass as
    simulated, in SI units; ``base_u_m``: rms displacement that an accelerometer's noise is integrated to, where the
    base was one; ``sampling_error``: rms error of the response over Y by what the base may do between its samples, a
    fifteenth of the difference to the response under every other sample (a spline errs with the fourth power of the
    interval).
    """

    source: str
    response: Response
    recording: Recording
    natural_frequency_hz: float
    stiffness_n_per_m: float | None
    sampling_error: float
    warnings: tuple[str, ...]
    base_u_m: float | None = None

    def __repr__(self) -> str:
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        at = f"{len(self.recording)} samples, {self.natural_frequency_hz:.4g} Hz"
        return f"<RecordResponse to {self.source}: {at}, {self.response.problem!r}{said}>"

    @property
    def contact_force(self) -> tuple[FloatArray, str]:
        """Force of the contact on the mass (n,) and its unit: N, or m (over the stiffness) where that is not known."""
        scale = self.response.base.scale
        if self.stiffness_n_per_m is None:
            return self.response.contact_force * scale, "m"
        return self.response.contact_force * (scale * self.stiffness_n_per_m), "N"

    def row(self) -> dict[str, object]:
        """The keys of a line of JSON or of a table."""
        r, scale, k = self.response, self.response.base.scale, self.stiffness_n_per_m
        omega, peaks = 2.0 * math.pi * self.natural_frequency_hz, self.response.peaks
        return {
            "source": self.source,
            "status": "ok",
            "reason": None,
            "warnings": self.warnings,
            "natural_frequency_hz": self.natural_frequency_hz,
            "base_largest_m": scale,
            "base_u_m": self.base_u_m,
            "beta": r.problem.beta,
            "wall": r.problem.wall,
            "law": r.problem.law.name,
            "parameters": r.problem.parameters,
            "solver": r.solver,
            "samples": len(r.time),
            "duration_s": self.recording.duration_s,
            "energy": r.energy,
            "energy_j": None if k is None else r.energy * k * scale**2,
            "friction_energy": r.friction_energy,
            "closure_error": r.closure_error,
            "path": r.path,
            "path_m": r.path * scale,
            "stops": r.stops,
            "time_stuck_s": r.stuck_of(0) / omega,
            "stuck_fraction": r.stuck_fraction,
            "peak_displacement": peaks["displacement"],
            "peak_displacement_m": peaks["displacement"] * scale,
            "peak_relative_displacement": peaks["relative_displacement"],
            "peak_velocity_m_per_s": peaks["velocity"] * scale * omega,
            "peak_contact_force": peaks["contact_force"],
            "peak_contact_force_n": None if k is None else peaks["contact_force"] * scale * k,
            "peak_displacements": np.abs(r.displacements).max(axis=0).tolist(),
            "contacts": [r.row_of(contact) for contact in range(len(r.frame.contacts))],
            "sampling_error": self.sampling_error,
        }


def respond_to(
    recording: Recording,
    what: Problem | Callable[[float], Problem | Structure],
    *,
    natural_frequency_hz: float,
    stiffness_n_per_m: float | None = None,
    source: str = "",
    highpass_hz: float | None = None,
) -> RecordResponse:
    """Simulate one mass, or a frame of several, from rest, under the motion of a recording's base.

    A wall that moves with the base feels its acceleration. Where that was recorded nothing is integrated: Y is its
    largest size over omega_n^2, and the mass's displacement is that from the base. A fixed wall needs the base's
    displacement: an acceleration is integrated twice, without what is slower than `highpass_hz`.

    ``recording``: its base drives, by its displacement or, where that is absent, its acceleration; its mass is not
    looked at. ``what`` moves, as `frictionlab.respond` says, whose refusals are raised here; ``natural_frequency_hz``:
    of the frame, of several masses that of the first storey alone; ``stiffness_n_per_m``: gives newtons and joules;
    ``source``: what the result calls its base.
    """
    sketch = what if isinstance(what, Problem) else what(1.0)
    follows = frame_of(sketch).follows_base
    (part, warnings), is_acceleration = sound_base(recording), "base_displacement" not in recording.measured()
    y, u = part.base_acceleration if is_acceleration else part.base_displacement, None
    omega = 2.0 * math.pi * natural_frequency_hz
    tau = omega * (part.time - part.time[0])
    if is_acceleration and follows:
        warnings.append(
            f"base: an acceleration, up to {np.abs(y).max():.4g} m/s^2, drives the wall as it is: Y is that over"
            " omega_n^2, and the mass's displacement is that from the base"
        )
        base, base_m = BaseRecord(tau, y / omega**2, quantity="acceleration"), 0.0 * y
    elif is_acceleration:
        y, u = _integrated(part, highpass_hz, warnings)
        base, base_m = BaseRecord(tau, y), y
    else:
        noise = white_noise(y) if follows and len(y) >= 16 else 0.0
        if noise > QUIET * float(np.ptp(y)):
            warnings.append(
                f"base: its noise of {1e6 * noise:.3g} um rms was smoothed away: a wall that moves with the base feels"
                " the base's acceleration, and noise would drown it"
            )
            y = denoised(y, noise)
        base, base_m = BaseRecord(tau, y), part.base_displacement
    moves = what if isinstance(what, Problem) else what(base.scale)
    response, error = respond(moves, base), 0.0
    if len(base.time) >= 9:  # by the response under every other sample
        every = slice(None, None, 2)
        half = BaseRecord(
            base.time[every], base.displacement[every], rest=base.rest, scale=base.scale, quantity=base.quantity
        )
        coarse = respond(moves, half, x0=response.displacements[0], v0=response.velocities[0])
        error = math.sqrt(float(np.mean((coarse.displacements - response.displacements[every]) ** 2))) / ORDER_LEFT
    problem = response.problem
    if error > COARSE:
        warnings.append(
            f"base: its motion between the samples is not known and may change the response by {error:.2g}"
            f" Y rms; do: sample faster than {part.sampling_rate_hz:.4g} Hz, or smooth its noise"
        )
    made_by = {"made_by": "frictionlab simulate --base-motion", "law": problem.law.name}
    origin = Source(
        files=part.source.files,
        dialect={**made_by, **problem.parameters},
        options={"natural_frequency_hz": natural_frequency_hz, "wall": problem.wall},
        warnings=tuple(warnings),
    )
    mass, *more = response.displacements.T * base.scale
    others = (Channel(f"mass_{number}_displacement", x) for number, x in enumerate(more, 2))
    made = Recording(part.time, mass, base_m, part.quality, origin, part.experiment, others)
    return RecordResponse(source, response, made, natural_frequency_hz, stiffness_n_per_m, error, tuple(warnings), u)


def _integrated(part: Recording, highpass_hz: float | None, warnings: list[str]) -> tuple[FloatArray, float]:
    """The base's displacement (n,) from its acceleration, and the rms that the sensor's noise makes of it [m]."""
    a, rate = part.base_acceleration, part.sampling_rate_hz
    if highpass_hz is None or not 0.0 < highpass_hz < 0.25 * rate:
        raise RecordingError(
            "base: an acceleration; for a fixed wall it is integrated twice; expected --highpass HZ, the slowest motion"
            f" that is kept, less than {0.25 * rate:.4g}; got {highpass_hz or 'none'}; do: give one, or --wall base"
        )
    y, u, said = integrated(a, rate, highpass_hz)
    warnings.append(f"base: an acceleration, integrated twice: {said}")
    return y, u


def sound_base(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording whose base can drive a simulation from its first sample to its last, and what to say of it.

    Raises
    ------
    RecordingError
        It has a gap or held values: named by time.
    """
    gaps, parts = recording.gaps, recording.stretches()
    if not parts:
        raise RecordingError("base: no two sound samples follow each other")
    part, lost = parts[0], len(recording) - len(parts[0])
    steps = np.diff(part.time)
    at = int(np.argmax(steps))
    if not gaps and steps[at] > HOLE * float(np.median(steps)):  # without a flag, as in recordings of others
        gaps = ((float(part.time[at]), float(part.time[at + 1])),)
    if gaps:
        raise RecordingError(
            f"base: no samples from {gaps[0][0]:.6g} s to {gaps[0][1]:.6g} s: nothing is simulated across a gap;"
            " do: cut the record there, or bridge longer holes when it is read (bridge_s in [log])"
        )
    said = list(part.source.warnings)
    bridged = int(np.count_nonzero(part.quality & np.uint8(Quality.INTERPOLATED)))
    if bridged:
        said.append(f"base: {bridged} of {len(part)} samples are straight lines over short holes, not measured")
    if lost:
        said.append(f"base: {lost} samples with a repeated stamp or without a value are left out")
    return part, said
