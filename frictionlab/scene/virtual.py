"""``[synthetic]``: the virtual rig, how its base may move, and what its contacts are like."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from frictionlab.scene.faults import LawName, NonNegative, Positive, SceneTable, check_held


class VirtualBase(SceneTable):
    """``[[synthetic.bases]]``: a motion of the virtual base; a group of tests takes it by its name."""

    name: str
    """What tests call it; it ends the names of their logs."""
    motion: Literal["sine", "sweep", "random", "file"] = "sine"
    """"sine" at each frequency ratio, "sweep", "random", or "file": as recorded."""
    ramp_s: NonNegative = 0.0
    """The motor starts up within this time: its amplitude grows smoothly from 0."""
    amplitude_wander: NonNegative = 0.0
    """Relative rms of a wandering amplitude."""
    amplitude_wander_s: Positive = 5.0
    """Correlation time of that: after it, e^-1 is left."""
    frequency_wander: NonNegative = 0.0
    """Relative rms of a wandering frequency: of a sine or a sweep."""
    frequency_wander_s: Positive = 5.0
    """Correlation time of that."""
    sweep_hz: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
    """First and last frequency of a sweep, which lasts as long as the test."""
    sweep_scale: Literal["linear", "log"] = "linear"
    """"linear": so many Hz a second; "log": so many octaves a second."""
    band_hz: Annotated[list[NonNegative], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest frequency of a random motion, equally strong between."""
    spectrum: list[Annotated[list[NonNegative], Field(min_length=2, max_length=2)]] | None = None
    """Or its power density as [[frequency in Hz, m^2/Hz], ...], straight lines between, nothing beyond."""
    rms_m: Positive | None = None
    """Rms of a random motion; by default the spectrum's own, or base_amplitude_m over the root of 2 with a band."""
    file: str | None = None
    """A recording, a log or a table beside the scene: its base moves so, from its first value."""
    column: str | None = None
    """Of a table: the base's column, by its name or its number from 1."""
    unit: str | None = None
    """Unit of that column, where the table does not say it."""
    factor: float = Field(default=1.0, allow_inf_nan=False)
    """The recorded motion is made so many times as large."""

    @model_validator(mode="after")
    def _has_what_it_needs(self) -> Self:
        needs = {"sweep": ("sweep_hz",), "random": ("band_hz", "spectrum"), "file": ("file",)}
        for motion, keys in needs.items():
            given = [key for key in keys if getattr(self, key) is not None]
            if motion == self.motion and len(given) != 1:
                raise ValueError(
                    f"motion = {motion!r} needs {' or '.join(keys)}, one of them; got {' and '.join(given) or 'none'}"
                )
            if motion != self.motion and given:
                raise ValueError(f"{given[0]} belongs to motion = {motion!r}; got motion = {self.motion!r}")
        if self.band_hz and not self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz: expected the lowest frequency first; got {self.band_hz}")
        self._check_spectrum()
        return self

    def _check_spectrum(self) -> None:
        places = [place for place, _ in self.spectrum or []]
        if self.spectrum is not None and (len(places) < 2 or sorted(set(places)) != places):
            raise ValueError(f"spectrum: expected at least two frequencies that increase; got {places}")
        if self.spectrum is not None and not any(density for _, density in self.spectrum):
            raise ValueError("spectrum: expected a density above 0 somewhere; got none")

    @property
    def is_plain(self) -> bool:
        """Whether it is a sine that begins at once and keeps amplitude and frequency."""
        return self.motion == "sine" and not (self.ramp_s or self.amplitude_wander or self.frequency_wander)


class VirtualTests(SceneTable):
    """``[[synthetic.tests]]``: one material over normal forces x frequency ratios, and how it behaves.

    The friction force is ``friction_coefficient * normal_force``; the behaviours below default to plain Coulomb.
    """

    material: str
    """Material of these tests; it names their logs."""
    normal_forces_n: Annotated[list[Positive], Field(min_length=1)]
    """Normal forces, each with each frequency ratio."""
    frequency_ratios: list[Positive] = Field(default=[])
    """Frequency ratios of a sine, each with each normal force."""
    base: str | None = None
    """Name of the base's motion, one of [[synthetic.bases]]; by default a sine at each frequency ratio."""
    friction_coefficient: NonNegative
    """True friction coefficient."""
    law: LawName | None = None
    """True contact law of this material, like "coulomb+place"; by default [model] law and [model.parameters]."""
    parameters: dict[str, float] = Field(default={})
    """Parameters of that law other than beta, dimensionless: {gradient = 0.05}."""
    physical: dict[str, float] = Field(default={})
    """The same in newtons, metres and seconds, alike in each test: {gradient = 28.0} is 28 1/m."""
    label: str | None = None
    """Ends the log's name, to tell apart tests of the same material, force and ratio."""
    duration_s: Positive | None = None
    """Length of these tests; by default [synthetic] duration_s."""
    friction_drift_per_hour: float = 0.0
    """Relative change of the friction force in an hour of running."""
    friction_scatter: NonNegative = 0.0
    """Relative rms of the friction force from cycle to cycle."""
    friction_wander: NonNegative = 0.0
    """Relative rms of the friction force's slow wandering."""
    friction_wander_s: Positive = 300.0
    """Correlation time of that: after it, e^-1 is left."""
    jump_s: Positive | None = None
    """At this time the friction force changes for good."""
    jump_factor: NonNegative = 1.0
    """By this factor it changes then."""

    @model_validator(mode="after")
    def _parameters_can_be(self) -> Self:
        check_held(self.parameters, self.law, breaks_away=True)
        return self


VirtualChannel = Literal[
    "contact_force", "normal_force", "mass_velocity", "base_velocity", "mass_acceleration", "base_acceleration"
]


class Synthetic(SceneTable):
    """``[synthetic]``: a virtual rig watched by two virtual lasers."""

    seed: Annotated[int, Field(ge=0)] = 0
    """Of the random numbers; the same seed gives the same bytes."""
    sampling_rate_hz: Positive = 250.0
    """Samples per second."""
    duration_s: Positive = 60.0
    """Length of a test."""
    base_amplitude_m: Positive = 1.8e-3
    """Amplitude of the base."""
    noise_m: NonNegative = 0.8e-6
    """Noise of each sensor, rms."""
    step_m: NonNegative = 1.02 * 0.05 / 65520
    """Smallest step of the sensors (optoNCDT 1420 at 50 mm measuring range: 0.778 um)."""
    channels: list[VirtualChannel] = Field(default=[])
    """What is measured beside the two displacements: ["contact_force", "normal_force", "mass_velocity", ...]."""
    channel_noise: NonNegative = 1e-3
    """Noise of each further channel, rms over its own rms."""
    start: Literal["rest", "steady"] = "rest"
    """"rest", or "steady": from the steady state."""
    bases: list[VirtualBase] = Field(default=[])
    """Motions of the base, as [[synthetic.bases]]."""
    tests: list[VirtualTests] = Field(default=[])
    """The tests, as [[synthetic.tests]]."""

    @model_validator(mode="after")
    def _bases_are_known(self) -> Self:
        names = [base.name for base in self.bases]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"bases: expected a name each; {', '.join(twice)} stands twice")
        for number, group in enumerate(self.tests):
            if group.base is not None and group.base not in names:
                known = ", ".join(names) or "none is given"
                raise ValueError(
                    f"tests.{number}.base: expected a name in [[synthetic.bases]] ({known}); got {group.base!r}"
                )
            sine = self.base_of(group).motion == "sine"
            if sine != bool(group.frequency_ratios):
                msg = f"tests.{number}.frequency_ratios: " + (
                    "expected at least one: a sine moves at them"
                    if sine
                    else "a sweep, random or recorded motion has its own frequencies: leave them out"
                )
                raise ValueError(msg)
        return self

    def base_of(self, group: VirtualTests) -> VirtualBase:
        """The motion of the base in a group of tests."""
        return next((base for base in self.bases if base.name == group.base), VirtualBase(name=""))
