"""All knobs, family by family."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import MappingProxyType

from frictionlab.tradeoff import contacts, files, signals, simulation
from frictionlab.tradeoff.setting import Setting

Knob = Callable[[], tuple[Setting, ...]]

FAMILIES: Mapping[str, tuple[Knob, ...]] = MappingProxyType(
    {
        "simulator": (
            simulation.solver_of_continuous_motion,
            simulation.solver_of_stick_slip,
            simulation.cycles_waited,
            simulation.physics,
        ),
        "contacts": tuple(partial(contacts.tolerance_of, name) for name in contacts.CONTACTS),
        "frequency": (signals.padding,),
        "cycle": (
            signals.points_per_cycle,
            signals.cycles_averaged,
            signals.sampling_rate,
        ),
        "files": (files.storage, files.csv_reader),
        "levels": (signals.accuracy_of_analyze, signals.accuracy_of_compare_numeric),
    }
)
"""Knobs by what they are about; one figure each."""


def measure_trade() -> Iterator[tuple[str, tuple[Setting, ...]]]:
    """Measure all knobs: yields (family, the settings of one knob) as they are done; about a minute in all."""
    for family, knobs in FAMILIES.items():
        for knob in knobs:
            yield family, knob()
