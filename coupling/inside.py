"""Whether the grains of a run start where its solid can come, and not in it."""
from typing import Any, Iterator, List, NamedTuple, Tuple

import numpy as np

PRESSED = 0.25  # overlap with a ball, in its radius, that grains lying on it may have at the start
SUNK = 0.1  # the same with the material points of a body without balls, in the radius of the grain


def check_inside(scene: Any, solid: Any) -> None:
    """ValueError for a particle of the ``scene`` that lies outside the grid of the ``solid``, whose material
    points it is to meet: none can ever come there."""
    box, rocks = solid.grid.box, _spheres(scene)
    lower, upper = (np.asarray(end, float) for end in (box.lower, box.upper))
    R = rocks.radius[:, None]
    near = ((rocks.x + R >= lower) & (rocks.x - R <= upper)).all(axis=1)
    owners = np.unique(rocks.owner)
    far = owners[~np.isin(owners, rocks.owner[near])]  # none of whose spheres comes near
    if len(far):
        k = int(np.argmax(rocks.owner == far[0]))
        raise ValueError(f"{rocks.name(k)} at {rocks.x[k].tolist()} m lies outside the grid of the soil, "
                         f"{box.lower} to {box.upper} m, where no soil can come: move it, or enlarge the "
                         "grid")


def check_apart(scene: Any, solid: Any) -> None:
    """ValueError for a particle of the ``scene`` that overlaps the bodies of the ``solid`` at the start, by
    more than what presses there: its balls, or the material points of a body that has none. Collective."""
    if not hasattr(solid, "matter"):
        return
    rocks, nothing = _spheres(scene), (0.0, "")
    worst = max(_overlaps(rocks, solid.matter()), default=nothing) if len(rocks.x) else nothing
    deepest, sentence = max(solid.comm.allgather(worst))
    if deepest > 1.0:
        raise ValueError(sentence)


class _Spheres(NamedTuple):
    """All spheres of a scene, those of clusters too: centres ``x`` [m], shape (n, dim), ``radius`` [m] and
    ``owner``, shape (n,): particles in the order of the scene, the ``single`` spheres first."""

    x: np.ndarray
    radius: np.ndarray
    owner: np.ndarray
    single: int

    def name(self, k: int) -> str:
        """Of the particle that sphere k belongs to."""
        n = int(self.owner[k])
        return f"sphere {n + 1}" if n < self.single else f"cluster {n - self.single + 1}"


def _spheres(scene: Any) -> _Spheres:
    dim, single, clusters = scene.wall.nodes.shape[1], len(scene.spheres.x), scene.clusters
    x = [scene.spheres.x, *(cluster.places[:, :dim] for cluster in clusters)]
    radius = [scene.spheres.radius, *(np.broadcast_to(cluster.radii, len(cluster.places))
                                      for cluster in clusters)]
    count = [1] * single + [len(cluster.places) for cluster in clusters]
    owner = np.repeat(np.arange(len(count)), count)
    return _Spheres(np.concatenate(x), np.concatenate(radius), owner, single)


def _overlaps(rocks: _Spheres, bodies: List[Any]) -> Iterator[Tuple[float, str]]:
    """With each body that has points here: deepest overlap in what is allowed, and a sentence."""
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    x, R = rocks.x, rocks.radius
    lower, upper = (x - R[:, None]).min(axis=0), (x + R[:, None]).max(axis=0)
    for number, body in enumerate(bodies):
        ball = body.ball
        near = body.x[((body.x > lower - ball) & (body.x < upper + ball)).all(axis=1)]
        if len(near):
            overlap = R + ball - cKDTree(near).query(x)[0]
            share = overlap / (PRESSED * ball if ball else SUNK * R)
            k = int(np.argmax(share))
            what = f"balls of {ball:g} m radius" if ball else "material points"
            yield float(share[k]), (
                f"{rocks.name(k)} overlaps the {what} of body {number + 1} by {overlap[k]:.3g} m at the "
                f"start, at {x[k].tolist()} m: move it away by at least that much, or take it out of the "
                f"body, Body.without(rocks{f', gap={ball:g}' if ball else ''})")
