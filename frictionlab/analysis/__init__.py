"""Arrays in, numbers out: what a recording says about friction, each number with its standard error.

The kernels (`spectrum`, `cycles`, `smoothing`, `energy`, `irregularity`, `stops`, `steadiness`, `drift`,
`free_vibration`, `noise`) know only arrays. `measure` alone knows recordings and scenes and composes them.
"""
