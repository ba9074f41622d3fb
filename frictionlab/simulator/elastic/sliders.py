"""The sliders of a law: Jenkins's one, or Iwan's many, whose slip lengths are distributed as a power."""

from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.structure import Contact


def iwan_sliders(stiffness: float, beta: float, count: int, chi: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and strength of sliders whose slip lengths phi have the density R phi^chi up to phi_max.

    Total stiffness and strength are those of the whole distribution,
    ``kappa = R phi_max^(chi + 1) / (chi + 1)`` and ``beta = R phi_max^(chi + 2) / (chi + 2)``, hence
    ``phi_max = beta (chi + 2) / (kappa (chi + 1))`` (D. J. Segalman's four-parameter model without its jump).
    The distribution is cut at ``phi_max (i / N)^(2 / (chi + 2))``; each piece becomes one slider with the piece's own
    stiffness and strength. So the force of a first loading is met exactly at each cut, and its largest error between
    two cuts, about R phi^chi width^2 / 8, is about the same in all pieces: ``beta / (2 (chi + 2) N^2)``.

    Parameters
    ----------
    stiffness, beta : float
        All sliders together, over k and over k Y.
    count : int
    chi : float
        Exponent, -1 < chi <= 0.

    Returns
    -------
    stiffness, strength : tuple of float

    Examples
    --------
    >>> stiffness, strength = iwan_sliders(100.0, 0.4, 4, 0.0)
    >>> stiffness, [round(share, 6) for share in strength]
    ((25.0, 25.0, 25.0, 25.0), [0.025, 0.075, 0.125, 0.175])
    """
    cuts = [(i / count) ** (2.0 / (chi + 2.0)) for i in range(count + 1)]
    springs = [cut ** (chi + 1.0) for cut in cuts]
    limits = [cut ** (chi + 2.0) for cut in cuts]
    return (
        tuple(stiffness * (springs[i + 1] - springs[i]) for i in range(count)),
        tuple(beta * (limits[i + 1] - limits[i]) for i in range(count)),
    )


def sliders_of(problem: Problem | Contact) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and strength of the sliders of a problem, or of a contact of a structure.

    Raises
    ------
    SimulationError
        Another solver answers for the law.
    """
    law, kappa = problem.law, problem.parameter("stiffness_ratio")
    if law.kind != "elastic":
        raise SimulationError(f"simulation: law {law.name}: the elastic solver does not know it")
    if law.has("iwan"):
        return iwan_sliders(kappa, problem.beta, round(problem.parameter("sliders")), problem.parameter("chi"))
    return (kappa,), (problem.beta,)
