"""The tables of a scene: every key with its type, its limits, its default and the sentence that documents it.

``[rig]`` and ``[synthetic]`` stand in ``rig``. What is wrong with a scene is said in one sentence a fault, with its
line, its key path and the key that was meant. What a scene does not name is neither simulated nor paid for: ``[model]``
switches physics on by naming it.
"""

import difflib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import BaseModel, Field, PrivateAttr, ValidationError, field_validator, model_validator

from frictionlab.errors import SceneError
from frictionlab.log_options import LogOptions
from frictionlab.scene.rig import LawName, NonNegative, Positive, Rig, SceneTable, Synthetic, check_parameters, key

Padding = Annotated[int, Field(ge=1, le=1024)]
Order = Annotated[int, Field(ge=1, le=8)]
Two = Annotated[list[float], Field(min_length=2, max_length=2)]
Pair = Annotated[list[Positive], Field(min_length=2, max_length=2)]
Solver = Literal["auto", "closed-form", "exact", "numeric", "thesis"]
Level = Literal["material", "test"]
Lines = Mapping[tuple[str, ...], int]
LEVELS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "fast": {"padding": 1, "least_points": 64, "most_points": 64},
        "balanced": {"padding": 4, "least_points": 64, "most_points": None},
        "exact": {"padding": 16, "least_points": 1024, "most_points": None},
    }
)
"""What the levels of accuracy set in ``[analysis]``; `tradeoff` measures what each costs and brings."""


WORDS = {
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "string_type": "expected a text in quotes",
    "bool_type": "expected true or false",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "list_type": "expected a list",
    "finite_number": "expected a finite number",
    "greater_than": "expected more than {gt:g}",
    "greater_than_equal": "expected {ge:g} or more",
    "less_than_equal": "expected {le:g} or less",
    "too_short": "expected at least {min_length} values",
    "too_long": "expected at most {max_length} values",
    "literal_error": "expected {expected}",
    "missing": "is not given, and has no default",
}
"""What pydantic finds, in the words that all refusals use."""
_UNION = re.compile(r"^(?:str|int|float|bool|constrained-.*|list\[.*)$")  # pydantic's names of a union's branches


class Experiment(SceneTable):
    """``[experiment]``: the facts of one test, or where the facts of many tests come from."""

    material: str | None = key("Material of the contact.")
    normal_force_n: Positive | None = key("Force that presses the contact together.")
    normal_force_n_u: NonNegative | None = key("Standard uncertainty of the normal force.")
    base_amplitude_m: Positive | None = key("Amplitude of the base, for a table over frequency that lacks it.")
    nominal_frequency_ratio: Positive | None = key("Frequency ratio that was asked of the drive.")
    duration_s: Positive | None = key("Length that was asked of the test.")
    repeat: int | str | None = key("Number or name of a repetition.")
    operator: str | None = key("Who ran the test.")
    date: str | None = key("When it was run.")
    note: str | None = key("Anything else; it is kept in the recording.")
    name_pattern: str | None = key(
        'Facts from names of logs, like "{material}_N{normal_force_n}_r{nominal_frequency_ratio}".'
    )
    sheet: str | None = key("Facts from a CSV beside the scene, with a `log` column.")
    broken_off: list[str] = key(
        'Logs of tests that were broken off, by names or patterns like "*_aborted.csv": that they fail is no fault.', []
    )
    taps: list[str] = key('Free decays among the logs, which are no tests: names or patterns like "tap*.csv".', [])


CYCLES = "'last', 'all' or 'window:SECONDS' (like 'window:15')"


def window_of(rule: str) -> float | None:
    """Return the window of a rule, s; None for ``last`` and ``all``, which have none.

    Raises
    ------
    ValueError
        It is no rule: what was expected, and what came.

    Examples
    --------
    >>> window_of("window:15"), window_of("last")
    (15.0, None)
    >>> window_of("window:-3")
    Traceback (most recent call last):
    ValueError: expected 'last', 'all' or 'window:SECONDS' (like 'window:15'); got 'window:-3'
    """
    found = re.fullmatch(r"last|all|window:(\d+\.?\d*(?:[eE][+-]?\d+)?)", rule, re.ASCII)
    seconds = float(found[1]) if found and found[1] else None
    if found is None or (seconds is not None and not 0.0 < seconds < math.inf):
        msg = f"expected {CYCLES}; got {rule!r}"
        raise ValueError(msg)
    return seconds


class Analysis(SceneTable):
    """``[analysis]``: which part of a recording is measured, and how finely."""

    transient_s: NonNegative | None = key("Cut from the beginning; by default until the motion settles (thesis: 20 s).")
    cycles: str = key('Cycles the energy is of: "all", "last" (thesis), or "window:15", of the last 15 s.', "all")
    accuracy: Literal["fast", "balanced", "exact"] = key(
        'Level that trades speed for accuracy: "fast", "balanced" or "exact"; padding wins over it.', "balanced"
    )
    padding: Padding | None = key("Length of the FFT over the record's; by default, by level, 1, 4 or 16.")

    @field_validator("cycles")
    @classmethod
    def _known_rule(cls, rule: str) -> str:
        window_of(rule)
        return rule

    @property
    def knobs(self) -> dict[str, Any]:
        """Padding, as given, and points of a cycle: as the level of accuracy has them."""
        return {**LEVELS[self.accuracy], **({} if self.padding is None else {"padding": self.padding})}

    @property
    def planned_transient_s(self) -> float:
        """What a test that is not made yet reserves for its transient: the thesis's 20 s where nothing is given."""
        return 20.0 if self.transient_s is None else self.transient_s


class Model(SceneTable):
    """``[model]``: the physics a prediction pays for; each key switches one thing on."""

    wall: Literal["fixed", "base"] = key(
        'What the mass rubs against: "fixed", or "base", a wall that moves with the base.', "fixed"
    )
    static_ratio: float = key("Static over kinetic friction, mu.", 1.0, ge=1, allow_inf_nan=False)
    law: LawName = key('Contact law, a sum of terms that starts with coulomb: "coulomb+place+speed".', "coulomb")
    parameters: dict[str, float] = key("The law's parameters held fixed, not fitted: [model.parameters].", {})
    damping: bool | None = key("false leaves the rig's damping_ratio out; true insists that it is given.")
    base_harmonics: int = key("Harmonics of the measured base motion, 1 to 9; 1 is a pure cosine.", 1, ge=1, le=9)
    solver: Solver = key('"auto", "closed-form", "exact", "numeric" or "thesis".', "auto")

    @model_validator(mode="after")
    def _parameters_can_be(self) -> Self:
        law = self.law if "law" in self.model_fields_set else None
        check_parameters(self.parameters, law, breaks_away=self.static_ratio != 1.0)
        return self


class Sensors(SceneTable):
    """``[sensors]``: what the laboratory knows of its two sensors; what is left out gets its stated default."""

    gain_error: NonNegative = key("Relative standard uncertainty of each sensor's gain.", 0.001)
    linearity: NonNegative = key("Standard uncertainty by curvature, as a share of the measuring range.", 0.0005)
    lag_s: float = key("The base's channel is behind the mass's: at t it shows the base at t - lag_s.", 0.0)
    lag_s_u: NonNegative | None = key(
        "Standard uncertainty of that lag; by default half a sampling interval either way; fits allow three times that."
    )
    filter_hz: Positive | None = key("Cut-off of both channels' low-pass filters; it is corrected for.")
    filter_order: int = key("Order of those filters.", 1, ge=1, le=8)
    mass_filter_hz: Positive | None = key("Cut-off of the mass's filter, where the two channels differ.")
    base_filter_hz: Positive | None = key("Cut-off of the base's filter, where the two channels differ.")
    mass_filter_order: Order | None = key("Order of the mass's filter, where the two channels differ.")
    base_filter_order: Order | None = key("Order of the base's filter, where the two channels differ.")
    crosstalk: NonNegative = key("Share of one channel that may stand in the other.", 0.0)
    force_inertia_kg: NonNegative = key("Mass between contact and load cell: its inertia is taken off the force.", 0.0)


class Infer(SceneTable):
    """``[infer]``: what is known before of the law's parameters, and which tests share one value of them.

    Of sensors and rig ``[sensors]`` and ``[rig]`` say it.
    """

    levels: dict[str, Level] = key(
        'Parameter of the law -> what has one value of it, "material" or "test": {gradient = "material"}.', {}
    )
    priors: dict[str, Two] = key(
        "Parameter of the law -> [value, standard deviation] known before: {contact_damping_ratio = [0.02, 0.005]}.", {}
    )

    @model_validator(mode="after")
    def _of_laws(self) -> Self:
        check_parameters(dict.fromkeys(self.levels, 1.0), None, table="levels")
        check_parameters({name: mean for name, (mean, _) in self.priors.items()}, None, table="priors")
        for name, value in self.priors.items():
            if value[1] <= 0.0:
                raise ValueError(f"priors.{name}: expected [value, standard deviation > 0]; got {value}")
        return self


class PlanTable(SceneTable):
    """``[plan]``: the tests that a laboratory could run next, and how well it measures them."""

    frequency_ratios: list[Positive] = key(
        "Frequency ratios that the drive can run.", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.2, 1.4, 1.7, 2.0]
    )
    normal_forces_n: list[Positive] = key("Normal forces that the rig can set.", [])
    base_amplitudes_m: list[Positive] = key("Amplitudes of the base that the rig can set.", [1.8e-3])
    duration_s: Positive = key("Length of a test, its transient included.", 60.0)
    repeatability: NonNegative = key("Relative rms of friction from test to test; cycles do not average it out.", 0.0)
    expected: dict[str, float] = key("What to expect of the law's other parameters: {gradient = 0.03}.", {})
    sampling_rate_hz: Positive = key("Samples per second.", 250.0)
    noise_m: NonNegative = key("Noise of each sensor, rms.", 0.8e-6)
    step_m: NonNegative = key("Smallest step of the sensors.", 0.0)
    cycle_scatter: NonNegative = key("Relative rms of the friction force from cycle to cycle.", 0.003)
    model_error: NonNegative = key("Share of the cycle (rms) that no law explains; cycles do not average it out.", 0.0)
    friction_coefficient: Pair | None = key("Friction coefficient known before: [value, standard error].")
    largest_response_m: Positive | None = key("Displacement of the mass that the rig allows.")
    avoid_frequency_ratios: Pair | None = key("Frequency ratios to keep away from: [low, high].")


@dataclass(frozen=True)
class Origin:
    """Where a scene stands, and the file it was read from; the same scene from another file is the same scene."""

    folder: Path = field(default=Path(), compare=False)
    file: Path | None = field(default=None, compare=False)


class Scene(SceneTable):
    """Everything a job needs to know that is not in its logs.

    Examples
    --------
    >>> Scene().analysis.cycles
    'all'
    >>> Scene(rig=Rig(mass_kg=3.0799, stiffness_n_per_m=1191.0)).rig.natural_frequency
    3.129...
    """

    rig: Rig = Rig()
    experiment: Experiment = Experiment()
    log: LogOptions = LogOptions()
    analysis: Analysis = Analysis()
    model: Model = Model()
    sensors: Sensors = Sensors()
    infer: Infer = Infer()
    plan: PlanTable = PlanTable()
    synthetic: Synthetic = Synthetic()
    _origin: Origin = PrivateAttr(default=Origin())

    @classmethod
    def of(
        cls, tables: Mapping[str, object], origin: Origin, *, name: str = "scene", lines: Lines | None = None
    ) -> Self:
        """The scene of these tables; raises a `SceneError` that names all faults, with the ``lines`` they stand in."""
        try:
            return cls.model_validate(tables, context=origin)
        except ValidationError as error:
            raise refusal(error, cls, name=name, lines=lines) from error

    def model_post_init(self, context: Any) -> None:
        """Keep where it stands."""
        self._origin = context or Origin()

    @property
    def folder(self) -> Path:
        """Where the scene stands; a sheet is looked for there."""
        return self._origin.folder

    @property
    def files(self) -> tuple[Path, ...]:
        """What was read to know all this, or will be: the scene's file and the sheet of its tests, once it is there.

        A plan writes the sheet that its scene already names.
        """
        sheet = self.folder / self.experiment.sheet if self.experiment.sheet else None
        named = (self._origin.file, sheet if sheet is not None and sheet.exists() else None)
        return tuple(path for path in named if path is not None)

    @property
    def frame_damping_ratio(self) -> float:
        """Damping ratio of the frame that is simulated: the rig's, unless ``[model] damping = false``."""
        return 0.0 if self.model.damping is False else self.rig.damping or 0.0

    @property
    def accuracy(self) -> str:
        """The level of accuracy: ``fast``, ``balanced`` or ``exact``."""
        return self.analysis.accuracy

    @model_validator(mode="after")
    def _damping_is_known(self) -> Self:
        if self.model.damping and self.rig.damping is None:
            raise ValueError("model.damping = true needs rig.damping_ratio: `frictionlab free-vibration` measures it")
        return self

    def changed(self, **tables: Mapping[str, object]) -> Self:
        """Return this scene with other settings: each table's keys as they would stand in a file; all the rest stays.

        Parameters
        ----------
        **tables : mapping
            Name of a table and the keys to set in it.

        Raises
        ------
        SceneError
            Unknown keys and impossible values, all of them.

        Examples
        --------
        >>> scene = Scene().changed(analysis={"transient_s": 5.0}, rig={"natural_frequency_hz": 3.13})
        >>> scene.analysis.cycles, scene.analysis.transient_s
        ('all', 5.0)
        """
        now = self.model_dump(exclude_unset=True)
        merged = {name: {**now.get(name, {}), **keys} for name, keys in tables.items()}
        return self.of({**now, **merged}, self._origin, name="setting")


def refusal(
    error: ValidationError, root: type[BaseModel], *, name: str = "scene", lines: Lines | None = None
) -> SceneError:
    """The error that names all faults, one an argument and so one a line.

    ``root`` is the model of the whole scene, ``name`` what the faults are of, ``lines`` where which key stands.
    """
    found: dict[tuple[str, ...], list[str]] = {}
    for fault in error.errors():
        path = tuple(str(part) for part in fault["loc"] if not _UNION.match(str(part)))
        found.setdefault(path, []).append(_sentence(path, dict(fault), root))
    faults = []
    for path, texts in found.items():
        above = (path[:n] for n in range(len(path), 0, -1))  # the key's line, or that of the table it belongs to
        line = next((lines[part] for part in above if part in lines), None) if lines else None
        where = f"{name}: " if line is None else f"{name}, line {line}: "
        said = f"{'.'.join(path)}: {' or '.join(dict.fromkeys(texts))}" if path else texts[0]
        faults.append((math.inf if line is None else line, where + said))
    return SceneError(*(said for _, said in sorted(faults, key=lambda fault: fault[0])))


def _sentence(path: tuple[str, ...], fault: Mapping[str, Any], root: type[BaseModel]) -> str:
    text = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        table = root
        for part in path[:-1]:  # the model of the table at that path
            field = table.model_fields.get(part)
            table = table if field is None else next(tables_in(field.annotation), table)
        known = list(table.model_fields)
        near = [name for name in known if name.startswith(f"{path[-1]}_")]
        near = near or difflib.get_close_matches(path[-1], known, n=1)
        return f"unknown key; {f'did you mean {near[0]}? ' if near else ''}expected one of {', '.join(known)}"
    if fault["type"] in WORDS:
        text = WORDS[fault["type"]].format(**fault.get("ctx", {}))
    got = "" if fault["type"] in ("value_error", "missing") else f"; got {fault['input']!r}"
    return f"{text[0].lower()}{text[1:]}{got}"


def tables_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables that a key may hold, by its annotation, in lists too."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from tables_in(inner)
