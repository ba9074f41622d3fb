"""The public names, as editors and type checkers see them; `__init__.py` loads each when it is first used."""

from frictionlab.analysis.measurement import Measurement as Measurement
from frictionlab.base_motion import RecordResponse as RecordResponse
from frictionlab.campaign import Campaign as Campaign
from frictionlab.errors import AnalysisError as AnalysisError
from frictionlab.errors import FrictionlabError as FrictionlabError
from frictionlab.errors import LogError as LogError
from frictionlab.errors import OutputError as OutputError
from frictionlab.errors import RecordingError as RecordingError
from frictionlab.errors import SceneError as SceneError
from frictionlab.errors import SimulationError as SimulationError
from frictionlab.errors import UsageError as UsageError
from frictionlab.hdf5 import read_recording as read_recording
from frictionlab.hdf5 import write_recording as write_recording
from frictionlab.identification import Comparison as Comparison
from frictionlab.planning import Plan as Plan
from frictionlab.recording import Recording as Recording
from frictionlab.scene import LogOptions as LogOptions
from frictionlab.scene import Scene as Scene
from frictionlab.scene import read_scene as read_scene
from frictionlab.scene import scene_from_tables as scene_from_tables
from frictionlab.simulator import Problem as Problem
from frictionlab.simulator import StateMap as StateMap
from frictionlab.simulator import SteadyState as SteadyState
from frictionlab.simulator import steady_state as steady_state
from frictionlab.simulator import sweep as sweep
from frictionlab.tables import read_rows as read_rows
from frictionlab.tables import write_rows as write_rows
from frictionlab.verbs.chain import Batch as Batch
from frictionlab.verbs.chain import batch as batch
from frictionlab.verbs.evaluate import evaluate as evaluate
from frictionlab.verbs.judging import compare as compare
from frictionlab.verbs.judging import explain as explain
from frictionlab.verbs.measuring import analyze as analyze
from frictionlab.verbs.measuring import free_vibration as free_vibration
from frictionlab.verbs.measuring import ingest as ingest
from frictionlab.verbs.plan import plan as plan
from frictionlab.verbs.presenting import plot as plot
from frictionlab.verbs.presenting import publish as publish
from frictionlab.verbs.simulating import respond as respond
from frictionlab.verbs.simulating import simulate as simulate
from frictionlab.verbs.simulating import synthesize as synthesize
from frictionlab.verbs.starting import init as init

__version__: str
