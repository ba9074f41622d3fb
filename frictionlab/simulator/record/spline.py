"""The slopes of a sampled motion: what makes samples a smooth curve."""

from frictionlab.simulator.record.layout import Buffer

__all__ = ["few", "spline_slopes"]


def spline_slopes(times: Buffer, values: Buffer, slopes: Buffer, work: Buffer) -> None:
    """Fill `slopes` with those of the cubic spline through the samples; its ends are not-a-knot.

    Tridiagonal in the slopes: ``h1 d0 + 2 (h0 + h1) d1 + h0 d2 = 3 (h1 s0 + h0 s1)``, with h the steps and s the
    secants left and right (C. de Boor, A Practical Guide to Splines, ch. IV). Fewer than four samples: the parabola or
    the line.
    """
    n = len(times)
    if n < 4:
        few(times, values, slopes)
        return
    h0, h1 = times[1] - times[0], times[2] - times[1]
    s0, s1 = (values[1] - values[0]) / h0, (values[2] - values[1]) / h1
    both = h0 + h1
    work[0] = both / h1
    slopes[0] = ((h0 + 2.0 * both) * h1 * s0 + h0 * h0 * s1) / both / h1
    for i in range(1, n - 1):
        h0, h1 = times[i] - times[i - 1], times[i + 1] - times[i]
        s0, s1 = (values[i] - values[i - 1]) / h0, (values[i + 1] - values[i]) / h1
        pivot = 2.0 * (h0 + h1) - h1 * work[i - 1]
        work[i] = h0 / pivot
        slopes[i] = (3.0 * (h1 * s0 + h0 * s1) - h1 * slopes[i - 1]) / pivot
    both = h0 + h1
    last = (h1 * h1 * s0 + (2.0 * both + h1) * h0 * s1) / both
    slopes[n - 1] = (last - both * slopes[n - 2]) / (h0 - both * work[n - 2])
    for i in range(n - 2, -1, -1):
        slopes[i] -= work[i] * slopes[i + 1]


def few(times: Buffer, values: Buffer, slopes: Buffer) -> None:
    """Fill the slopes of the line through two samples or of the parabola through three."""
    h0 = times[1] - times[0]
    s0 = (values[1] - values[0]) / h0
    slopes[0], slopes[1] = s0, s0
    if len(times) == 3:
        h1 = times[2] - times[1]
        s1 = (values[2] - values[1]) / h1
        bend = (s1 - s0) / (h0 + h1)
        slopes[0], slopes[1], slopes[2] = s0 - h0 * bend, s0 + h0 * bend, s1 + h1 * bend
