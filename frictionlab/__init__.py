r"""Friction damping, from the laser's log to the report.

The way of the data::

    logs (CSV ...) --ingest--> recording (HDF5) --analyze--> measurement (one row) --campaign--> tables, figures, report
                                       \                          |
                                        \--- compare-numeric ---- + <--- simulator (knows no files, no plots)

Each arrow is one verb, the same in a notebook as on the command line::

    import frictionlab as fl

    recording = fl.ingest("steel.csv", "scene.toml")
    measurement = fl.analyze(recording, "scene.toml", cycles="all")
    comparison = fl.compare(measurement, "scene.toml")

The names below are the public ones. Importing the package loads nothing; each name is loaded when it is first used.
"""

from importlib import import_module

__version__ = "0.2.0"

# Module -> the public names that come from it. A new one is a word here and a line in __init__.pyi.
_NAMES = {
    "verbs.one_test": "ingest analyze compare explain free_vibration modes",
    "verbs.evaluate": "evaluate publish",
    "verbs.chain": "Batch batch",
    "verbs.simulating": "simulate respond predict plan synthesize",
    "verbs.starting": "init",
    "figures": "plot",
    "recording": "Recording",
    "analysis.measurement": "Measurement",
    "inference.comparison": "Comparison",
    "inference.material_law": "MaterialLaw read_material_law",
    "inference.predictive": "Prediction",
    "campaign": "Campaign",
    "planning.plan": "Plan",
    "base_motion": "RecordResponse",
    "scene": "Scene LogOptions read_scene scene_from_tables",
    "hdf5": "read_recording write_recording",
    "tables": "read_rows write_rows",
    "simulator": "Problem SteadyState StateMap steady_state sweep",
    "errors": "FrictionlabError AnalysisError LogError OutputError RecordingError SceneError SimulationError"
    " UsageError",
}
_INSTEAD = {"campaign": "evaluate, then publish", "compare_numeric": "compare", "read_log": "ingest"}
_HOMES = {name: home for home, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        from difflib import get_close_matches  # noqa: PLC0415 - the package itself loads nothing

        meant = _INSTEAD.get(name) or ", ".join(get_close_matches(name, _HOMES))
        hint = f"did you mean {meant}" if meant else f"`dir({__name__})` lists its names"
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}: {hint}")
    found: object = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*_HOMES, "__version__"])
