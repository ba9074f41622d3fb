"""Many logs, each through its whole chain; only what changed is done again.

- ``names``: which files are logs, and under which name the results of each stand
- ``stamps``: what the results of a log were made of, so that a change is seen
- ``steps``: one log -> recording -> measurement -> comparison, with their figures
"""

from frictionlab.chain.names import logs_of, names_of
from frictionlab.chain.steps import Chain

__all__ = ["Chain", "logs_of", "names_of"]
