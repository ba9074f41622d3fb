"""Many logs, each through its whole chain; only what changed is done again.

- ``names``: which files are logs, and under which name the results of each stand
- ``stamps``: what the results of a log were made of, so that a change is seen
- ``steps``: one log -> recording -> measurement -> comparison, with their figures

Nothing is imported here: who wants names does not pay for figures.
"""
