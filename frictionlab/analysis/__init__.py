"""Arrays in, numbers out: what a recording says about friction, each number with its standard error.

The modules know only arrays; `measure` alone knows recordings and scenes and composes them.
"""
