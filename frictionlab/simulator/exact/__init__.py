"""The exact flow: one engine for every contact that is piecewise linear, any number of masses, any motion of the base.

`phase.py` is a phase's linear motion in modal coordinates, `motion.py` that motion at any time, `flow.py` the events
and the derivative of a run, `orbit.py` what repeats, `account.py` its energies, ranges and stops, `answer.py` a steady
state as a row of numbers and a motion along a sampled base, `solve.py` the door from Python. All but the door is
compiled by numba, on records whose fields have names; ``NUMBA_DISABLE_JIT=1`` leaves it plain Python.
"""
