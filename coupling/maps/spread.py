"""Contact forces spread over a fixed radius, and the indentation that they still make subtracted from the
motion.

Hertz's law contains the indentation of both partners. A grid whose cells are not much larger than the contact
resolves part of that indentation under the force on a few nodes, without bound as the cells get smaller, and
it is counted twice. Spread over a radius the force indents the solid by what belongs to the radius, whatever
the cells, and the wall follows the mean motion there: by the transpose of the same matrix, so that sum,
moment and work of the forces stay what they are. How deep that indentation is, is known
(``compliance_in_space``, ``compliance_in_plane``): the wall is moved out by it, and the force not changed.
"""
from typing import Any, Callable, Optional, Sequence

import numpy as np
from scipy.sparse import csr_matrix, vstack

from .mapping import Mapping, share

CONE = 0.69  # mean displacement of a half space under a unit force times E'L, weights of both fall linearly
BAR = 2.63  # radius over width at which such weights indent a plane strip no more than a point a bar in space


def compliance_in_space(radius: float, E: float, nu: float) -> float:
    """Compliance [m/N] of an elastic half space under a force spread over ``radius`` [m], 0 for no radius."""
    return CONE * (1.0 - nu**2) / (E * radius) if radius else 0.0


def compliance_in_plane(radius: float, E: float, width: float) -> float:
    """Compliance [m/N] of a plane scene of ``width`` [m] across it, under a force spread over ``radius`` [m],
    beyond that of the bar that it stands for, under a point force in the middle of its width: 2 ln(BAR
    width/radius) / (pi E width), not below 0, and 0 for no radius. E: Young's modulus in plane stress, E / (1
    - nu^2) in plane strain [Pa]."""
    return max(2.0 * np.log(BAR * width / radius) / (np.pi * E * width), 0.0) if radius else 0.0


def indentation_compliance(radius: float, E: float, nu: float, width: Optional[float] = None,
                           plane: str = "stress") -> float:
    """Compliance [m/N] that a solid still has under a force spread over ``radius`` [m], and that Hertz's law
    contains, too: in space, or of a plane scene of ``width`` [m] in plane "stress" or "strain".

    >>> from coupling import indentation_compliance
    >>> round(1e9 * indentation_compliance(3e-3, 2e11, 0.3), 4)
    1.0465
    >>> round(1e9 * indentation_compliance(3e-3, 2e11, 0.3, width=0.01), 4)
    0.691
    """
    if width is None:
        return compliance_in_space(radius, E, nu)
    return compliance_in_plane(radius, E if plane == "stress" else E / (1 - nu**2), width)


class Spread(Mapping):
    """A map whose wall nodes follow the mean motion around them; ``indentation`` is what the solid gives way
    there, see above, by its ``compliance`` [m/N]. inner: this rank's rows of the matrix (wall nodes, wall
    nodes) that sums up what belongs to one contact."""

    def __init__(self, rows: Any, mapping: Mapping, compliance: float, inner: Any) -> None:
        super().__init__(rows, mapping.x_solid, mapping.x_wall, mapping.comm)
        self.compliance, self._inner = compliance, inner
        self.is_copy = self.is_copy and not compliance  # a copy may be resampled, these rows may not

    def indentation(self, wall_force: np.ndarray) -> np.ndarray:
        """Displacement of the wall nodes [m] under ``wall_force`` [N], shape (m, dim) both."""
        return self.compliance * self._whole(self._inner @ wall_force, self._wall_bounds)


def spread(mapping: Mapping, radius: float, compliance: float = 0.0) -> Mapping:
    """``mapping`` with the motion of each wall node averaged over its neighbours within ``radius`` [m], of
    the places at the start, and the forces spread alike; 0: as it is. compliance: of the indentation under
    such a force that the contact law contains already [m/N], to be subtracted from the motion. Collective.
    ValueError for negative values.

    >>> x = np.column_stack([np.arange(5.0), np.zeros(5)])
    >>> one = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 4.0], [0.0, 0.0], [0.0, 0.0]])
    >>> spread(nearest(x, x), radius=2.0).force(one)[:, 1].round(12).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    if not 0.0 <= radius < np.inf:
        raise ValueError(f"spread is {radius} m: give the radius over which a contact force is spread, or 0")
    if not 0.0 <= compliance < np.inf:
        raise ValueError(f"compliance is {compliance} m/N: give the one to subtract from the motion, or 0")
    if not radius:
        return mapping
    H, x = vstack(mapping.comm.allgather(mapping.rows)), mapping.x_wall
    mine = share(len(x), mapping.comm)[0]
    near = Neighbours(x, radius, range(mine.start, mine.stop))
    return Spread(near.means() @ H, mapping, compliance, near.sums())


class Neighbours:
    """Of the places x [m], shape (m, dim), numbered ``rows``: those within ``radius`` [m]."""

    def __init__(self, x: np.ndarray, radius: float, rows: Sequence[int]) -> None:
        from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

        self._near = cKDTree(x).query_ball_point(x[list(rows)], radius) if len(rows) else []
        self._arms = [(x[around] - x[i]) / radius for i, around in zip(rows, self._near)]
        self._shape = len(rows), len(x)

    def _matrix(self, weights: Callable[[np.ndarray], np.ndarray]) -> Any:
        """Sparse, with ``weights`` (arms in radii) of the neighbours of each row."""
        values, columns = ([np.concatenate([np.zeros(0), *parts]) for parts in
                            ([weights(arm) for arm in self._arms], self._near)])
        start = np.cumsum([0, *map(len, self._near)])
        return csr_matrix((values, columns.astype(int), start), self._shape)

    def means(self) -> Any:
        """Averages, with weights that fall linearly to zero at the radius and are corrected so that linear
        fields stay as they are (moving least squares)."""
        def weights(arm: np.ndarray) -> np.ndarray:
            weight = np.maximum(1.0 - np.linalg.norm(arm, axis=1), 0.0)
            moment = (weight[:, None] * arm).T @ arm
            tilt = np.linalg.pinv(moment, rcond=1e-6, hermitian=True) @ (weight @ arm)
            weight *= 1.0 - arm @ tilt
            return weight / weight.sum()

        return self._matrix(weights)

    def sums(self) -> Any:
        """Sums over half the radius, and with falling weights over the rest."""
        return self._matrix(lambda arm: np.clip(2.0 - 2.0 * np.linalg.norm(arm, axis=1), 0.0, 1.0))
