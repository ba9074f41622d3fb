"""A frame of several masses with contacts anywhere: what moves, dimensionless by its first storey."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.errors import ParameterError
from frictionlab.simulator.laws import Friction, Law
from frictionlab.simulator.problem import COSINE, Base, Problem, Wall


@dataclass(frozen=True)
class Contact(Friction):
    """A contact between a mass and the wall, the base or another mass.

    Parameters
    ----------
    mass : int
        Number of the mass, from 1 at the base.
    against : {"wall", "base"} or int
        What it rubs against; a number: another mass.
    law : Law
    numbers : tuple of float
        Parameters of the law, as `Law.parameters` lists them: forces over k_1 Y, displacements over Y.

    Raises
    ------
    ParameterError
        Friction changes along the path faster than a spring's force.

    Examples
    --------
    >>> from frictionlab.simulator.laws import law_of
    >>> law = law_of("coulomb+place")
    >>> Contact(2, "wall", law, law.complete({"beta": 0.3, "gradient": 0.1})).parameter("gradient")
    0.1
    """

    mass: int
    against: int | str
    law: Law
    numbers: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse friction that runs away."""
        if abs(self.beta * self.parameter("gradient")) >= 1.0:
            raise ParameterError(
                f"contact of mass {self.mass}: beta |gradient|; expected less than 1: friction would change along the"
                f" path faster than the spring's force; got {abs(self.beta * self.parameter('gradient')):g}"
            )


@dataclass(frozen=True)
class Structure:
    """Masses on springs and dashpots, driven through the base; made dimensionless by the first storey.

    ``r^2 M q'' + r C q' + K q = K 1 f + r C 1 f' - sum of row_c n_c``: time is omega t, displacement over Y, force
    over k_1 Y. One mass is eq. (2.9).

    Parameters
    ----------
    r : float
        Drive over the first storey's natural frequency sqrt(k_1 / m_1).
    mass, damping, stiffness : ndarray of shape (n, n)
        M, C and K over m_1, sqrt(k_1 m_1) and k_1; a storey of damping ratio zeta alone has C = 2 zeta.
    contacts : tuple of Contact
    base : Base

    Raises
    ------
    ParameterError
        r is no finite number > 0, or a contact names a mass that is not there.

    Examples
    --------
    >>> two = Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.0, 0.0])
    >>> [round(float(f), 3) for f in two.natural_frequencies]  # over that of the first storey
    [0.618, 1.618]
    """

    r: float
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    contacts: tuple[Contact, ...] = ()
    base: Base = field(default=COSINE)

    def __post_init__(self) -> None:
        """Refuse what is no structure."""
        if not (isfinite(self.r) and 1e-3 <= self.r <= 1e3):
            raise ParameterError(f"structure: r; expected between 1e-3 and 1e3; got {self.r!r}")
        for number, contact in enumerate(self.contacts, 1):
            for mass in (contact.mass, contact.against):
                if isinstance(mass, int) and not 1 <= mass <= self.masses:
                    raise ParameterError(
                        f"structure: contact {number}: expected a mass from 1 to {self.masses}; got {mass}"
                    )

    @classmethod
    def of_storeys(
        cls,
        r: float,
        masses: ArrayLike,
        stiffness: ArrayLike,
        damping_ratios: ArrayLike,
        contacts: Sequence[Contact] = (),
        base: Base = COSINE,
    ) -> "Structure":
        """Return a frame of storeys, from the base up.

        Parameters
        ----------
        r : float
        masses, stiffness : array_like of shape (n,)
            In any one unit each: only their ratios to the first count.
        damping_ratios : array_like of shape (n,)
            Of each storey's dashpot: its coefficient over 2 sqrt(k m) of the storey's own spring and mass.
        contacts, base
            As in `Structure`.

        Raises
        ------
        ParameterError
            Lengths differ, or a mass, a stiffness or a damping ratio is outside its domain.
        """
        m, k, zeta = (np.asarray(values, dtype=np.float64).ravel() for values in (masses, stiffness, damping_ratios))
        if not len(m) == len(k) == len(zeta) >= 1:
            raise ParameterError(
                f"storeys: expected as many masses, springs and dashpots; got {len(m)}, {len(k)}, {len(zeta)}"
            )
        for name, values, good in (("mass", m, m > 0), ("stiffness", k, k > 0), ("damping ratio", zeta, zeta >= 0)):
            if not np.all(good & np.isfinite(values)):
                raise ParameterError(
                    f"storeys: {name}; expected finite numbers > 0 (damping >= 0); got {values.tolist()}"
                )
        dashpots = 2.0 * zeta * np.sqrt(k * m) / np.sqrt(k[0] * m[0])
        return cls(float(r), np.diag(m / m[0]), _chain(dashpots), _chain(k / k[0]), tuple(contacts), base)

    @property
    def masses(self) -> int:
        """Number of masses."""
        return len(self.mass)

    @property
    def is_exact(self) -> bool:
        """Whether every phase of its motion has a closed form."""
        return all(contact.law.is_exact for contact in self.contacts)

    @property
    def follows_base(self) -> bool:
        """Whether contacts are against the base, and none against the wall: then motion relative to the base is all."""
        against = {contact.against for contact in self.contacts}
        return "base" in against and "wall" not in against

    @property
    def weakens(self) -> bool:
        """Whether friction is larger at rest, falls with speed or varies along the path at some contact."""
        return any(contact.weakens for contact in self.contacts)

    @property
    def has_mirror_image(self) -> bool:
        """Whether it is its own mirror image half a cycle later."""
        return self.base.is_odd and all(contact.is_even for contact in self.contacts)

    def row(self, contact: Contact) -> FloatArray:
        """Return the row (n,) whose product with the masses' displacements is the contact's, but for the base."""
        row = np.zeros(self.masses)
        row[contact.mass - 1] = 1.0
        if isinstance(contact.against, int):
            row[contact.against - 1] = -1.0
        return row

    @cached_property
    def natural_frequencies(self) -> FloatArray:
        """Natural frequencies (n,) without contacts, over that of the first storey alone."""
        root = np.linalg.inv(np.linalg.cholesky(self.mass))
        return np.asarray(np.sqrt(np.linalg.eigvalsh(root @ self.stiffness @ root.T)))

    @property
    def first_contact(self) -> Problem:
        """The first contact as that of one mass; where there is none, without friction."""
        if not self.contacts:
            return Problem(self.r, 0.0, base=self.base)
        first = self.contacts[0]
        wall: Wall = "base" if first.against == "base" else "fixed"
        return Problem(self.r, first.beta, wall=wall, base=self.base, law=first.law, parameters=first.parameters)


def frame_of(what: Problem | Structure) -> Structure:
    """Return a problem as a frame of one mass; a structure is one."""
    if isinstance(what, Structure):
        return what
    contact, one = Contact(1, "base" if what.wall == "base" else "wall", what.law, what.numbers), np.eye(1)
    return Structure(what.r, one, 2.0 * what.frame_damping_ratio * one, one, (contact,), what.base)


def _chain(values: FloatArray) -> FloatArray:
    """Return the matrix of springs (or dashpots) in a row, the first one on the base."""
    matrix = np.diag(values.astype(np.float64))
    for i in range(1, len(values)):
        matrix[i - 1, i - 1] += values[i]
        matrix[i - 1, i] = matrix[i, i - 1] = -values[i]
    return matrix
