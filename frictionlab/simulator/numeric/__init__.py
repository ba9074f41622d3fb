"""The integrated flow, for contact laws without exact slides: Stribeck, logarithm, Dahl, Bouc-Wen, LuGre, rate-state.

`radau.py` carries a state through a phase and says the motion within a step; events between phases, energies and the
search are those of the exact flow. `integrated.py` is what Python has of it. Imported when such a law is asked for.
"""
