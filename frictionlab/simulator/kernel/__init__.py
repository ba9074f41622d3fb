"""The event loop: every formula of the exact simulator, once, as plain scalar functions.

The equation, in the displacement ``z`` of the mass relative to the wall (README, "The equation")::

    r^2 z'' + 2 zeta r z' + z = F(tau) - beta n,    F = sum_k A_k cos(k tau) + B_k sin(k tau)

`motion` holds the formulas of a phase, `events` what ends and follows it, `shooting` Newton's method, `outlook` what
needs no search and Den Hartog's motion, `resonance` motions next to one, `settle` what a motion settles on, `orbits`
what repeats, `accounts` what is reported, `points` many steady states in one call. The functions know no
class and no array library: `math`, floats and anything that can be indexed; they pass buffers in and return codes
instead of raising. That lets `engine` run them as they stand (nothing to load) or compiled (a sweep), with the same
bits. What the tuples and buffers hold is written in `layout`.
"""
