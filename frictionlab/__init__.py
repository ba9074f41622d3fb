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

# Name -> the module it comes from. A new public name is one line here and one in __init__.pyi.
_HOMES = {
    # verbs
    "analyze": "verbs.one_test",
    "batch": "verbs.chain",
    "compare": "verbs.one_test",
    "evaluate": "verbs.evaluate",
    "explain": "verbs.one_test",
    "free_vibration": "verbs.one_test",
    "ingest": "verbs.one_test",
    "init": "verbs.starting",
    "plan": "verbs.simulating",
    "plot": "figures",
    "predict": "verbs.simulating",
    "publish": "verbs.evaluate",
    "respond": "verbs.simulating",
    "simulate": "verbs.simulating",
    "synthesize": "verbs.simulating",
    # what they take and return
    "Batch": "verbs.chain",
    "Campaign": "campaign",
    "Comparison": "inference",
    "LogOptions": "scene",
    "MaterialLaw": "inference.material_law",
    "Measurement": "analysis.measurement",
    "Problem": "simulator",
    "Plan": "planning",
    "Prediction": "inference.predictive",
    "RecordResponse": "base_motion",
    "Recording": "recording",
    "Scene": "scene",
    "SteadyState": "simulator",
    # scenes, files and tables
    "read_material_law": "inference.material_law",
    "read_recording": "hdf5",
    "read_rows": "tables",
    "read_scene": "scene",
    "scene_from_tables": "scene",
    "write_recording": "hdf5",
    "write_rows": "tables",
    # the simulator's own
    "StateMap": "simulator",
    "steady_state": "simulator",
    "sweep": "simulator",
    # what can go wrong
    "AnalysisError": "errors",
    "FrictionlabError": "errors",
    "LogError": "errors",
    "OutputError": "errors",
    "RecordingError": "errors",
    "SceneError": "errors",
    "SimulationError": "errors",
    "UsageError": "errors",
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}: `dir({__name__})` lists its names")
    found: object = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*_HOMES, "__version__"])
