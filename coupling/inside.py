"""Whether the grains of a run start where its solid can come, and not in it."""
from typing import Any, Iterator, List, Tuple

import numpy as np

PRESSED = 0.25  # overlap with a ball, in its radius, that grains lying on it may have at the start
SUNK = 0.1  # the same with the material points of a body without balls, in the radius of the grain


def check_inside(scene: Any, solid: Any) -> None:
    """ValueError for a particle of the ``scene`` that lies outside the grid of the ``solid``, whose material
    points it is to meet: none can ever come there."""
    box = solid.grid.box
    lower, upper = np.asarray(box.lower, float), np.asarray(box.upper, float)
    for name, x, radius in _particles(scene):
        outside = ((x + radius < lower) | (x - radius > upper)).any(axis=1)
        if outside.all():
            raise ValueError(f"{name} at {x[0].tolist()} m lies outside the grid of the soil, {box.lower} to "
                             f"{box.upper} m, where no soil can come: move it, or enlarge the grid")


def check_apart(scene: Any, solid: Any) -> None:
    """ValueError for a particle of the ``scene`` that overlaps the bodies of the ``solid`` at the start, by
    more than what presses there: its balls, or the material points of a body that has none. Collective."""
    if not hasattr(solid, "matter"):
        return
    found = [(name, x) for name, centres, radii in _particles(scene) for x in zip(
        centres, np.broadcast_to(np.ravel(radii), len(centres)))]
    bodies = solid.matter()
    if not found or not any(len(body.x) for body in bodies):
        worst: Tuple = (0.0, "")
    else:
        worst = max(_overlaps(found, bodies, solid), default=(0.0, ""))
    deepest, sentence = max(solid.comm.allgather(worst))
    if deepest > 1.0:
        raise ValueError(sentence)


def _overlaps(found: List[tuple], bodies: List[Any], solid: Any) -> Iterator[Tuple[float, str]]:
    """With each body that has points here: deepest overlap in what is allowed, and a sentence."""
    from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

    radius, interface = getattr(solid, "ball_radius", None), getattr(solid, "interface", None)
    chosen = getattr(getattr(getattr(solid, "scene", None), "interface", interface), "bodies", None)
    x, R = np.array([x for _, (x, _) in found]), np.array([r for _, (_, r) in found])
    lower, upper = (x - R[:, None]).min(axis=0), (x + R[:, None]).max(axis=0)
    for number, body in enumerate(bodies):
        ball = radius if radius is not None and (chosen is None or number in chosen) else 0.0
        near = body.x[((body.x > lower - ball) & (body.x < upper + ball)).all(axis=1)]
        if len(near):
            overlap = R + ball - cKDTree(near).query(x)[0]
            share = overlap / (PRESSED * ball if ball else SUNK * R)
            k = int(np.argmax(share))
            what = f"balls of {ball:g} m radius" if ball else "material points"
            yield float(share[k]), (
                f"{found[k][0]} overlaps the {what} of body {number + 1} by {overlap[k]:.3g} m at the start, "
                f"at {x[k].tolist()} m: move it away by at least that much, or take it out of the body, "
                f"Body.without(rocks{f', gap={ball:g}' if ball else ''})")


def _particles(scene: Any) -> Iterator[Tuple[str, np.ndarray, Any]]:
    """Name of each single sphere and cluster, centres [m], shape (n, dim), and radii of its spheres."""
    dim = scene.wall.nodes.shape[1]
    for k, (x, radius) in enumerate(zip(scene.spheres.x, scene.spheres.radius)):
        yield f"sphere {k + 1}", x[None], radius
    for k, cluster in enumerate(scene.clusters):
        yield f"cluster {k + 1}", cluster.places[:, :dim], np.asarray(cluster.radii)[:, None]
