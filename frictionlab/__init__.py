r"""Friction damping, from the laser's log to the report.

The way of the data::

    logs (CSV ...) --ingest--> recording (HDF5) --analyze--> measurement (one row) --campaign--> tables, figures, report
                                       \                          |
                                        \--- compare-numeric ---- + <--- simulator (knows no files, no plots)

Each arrow is one verb, the same in a notebook as on the command line. Importing the package loads nothing heavy: a
verb is imported from the room that owns it, for example ``from frictionlab.simulator import Problem, steady_state``.
"""

__version__ = "0.1.0"
