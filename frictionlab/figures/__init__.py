"""Figures: ``draw(result, ax) -> ax``. A figure draws only what a result already holds.

matplotlib is imported here and nowhere else, always through its object interface: no pyplot, no global state.
"""
