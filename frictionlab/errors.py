"""What can go wrong, by whose doing. One root; each child is also the builtin a caller would expect.

A message says what happened, where (file, line, key), what was expected, what was got, and what to do. The command
line prints it as one line; nothing that stands in a file or on a command line reaches a user as a traceback.
"""


class FrictionlabError(Exception):
    """Root of every error this package raises on purpose."""


class SceneError(FrictionlabError, ValueError):
    """A scene file (TOML) cannot be used: unreadable, unknown key, wrong type, impossible value.

    Each argument is the sentence of one fault; as text they stand one a line.
    """

    def __str__(self) -> str:
        return "\n".join(str(fault) for fault in self.args)


class UsageError(FrictionlabError, ValueError):
    """The command line or the arguments of a verb contradict each other or ask for the impossible."""


class LogError(FrictionlabError, ValueError):
    """A raw log cannot be read, or can be read in more than one way."""


class RecordingError(FrictionlabError, ValueError):
    """A recording (arrays or HDF5 file) is not what it claims to be."""


class AnalysisError(FrictionlabError, ValueError):
    """A recording holds no measurement: no drive, too short, too damaged."""


class SimulationError(FrictionlabError, ArithmeticError):
    """The simulator was asked outside its domain, or an event sequence did not end."""


class ParameterError(UsageError, SimulationError):
    """A contact law or one of its parameters does not exist, is missing, or lies outside its domain."""


class OutputError(FrictionlabError, OSError):
    """A file could not be written whole; what stood at its place before is untouched."""


class ClusterError(FrictionlabError, ConnectionError):
    """A cluster does not answer, has no workers, or its workers hold another version of this package."""


DOUBTED = "the unit looks wrong"
"""Stands in each warning that doubts a unit: a campaign leaves such a test out."""
NO_FREQUENCY = (
    "the natural frequency is not known: give rig.natural_frequency_hz in the scene (--natural-frequency), or mass_kg"
    " and stiffness_n_per_m; `frictionlab free-vibration` measures it"
)
