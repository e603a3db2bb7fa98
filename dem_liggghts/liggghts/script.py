"""The commands that prepare LIGGGHTS for a scene: a pure function from the scene to command lines.

The contact law is that of the shim (shim/models.h), Young's moduli outside 5e6..1e9 Pa need LIGGGHTS' consent
(`soft_particles`, `hard_particles`).
"""
from typing import List

import numpy as np

from ..contact.damping import damping_ratio
from ..scene.materials import Interaction
from ..scene.scene import SceneData
from ..scene.tables import sphere_table

SOFTEST, HARDEST = 5e6, 1e9  # Young's moduli LIGGGHTS takes without being asked, SI units [Pa]
FEW = 200  # up to so many spheres are searched without bins
PARTNERS = 2000  # of one sphere, for which LIGGGHTS has room without being asked


def commands(scene: SceneData, dt: float) -> List[str]:
    """LIGGGHTS commands that prepare ``scene`` for steps of ``dt`` [s]; spheres and walls are added
    afterwards.

    Atom types are the materials in the order of ``scene.names``, from 1 on. The fix "wall" is the shim's; its
    type and its zplane are placeholders. Raises ValueError for a negative Poisson's ratio, which LIGGGHTS
    does not know.
    """
    between, at_wall = ([scene.interaction(*pair) for pair in pairs]
                        for pairs in (scene.pairs(), scene.wall_pairs()))
    radius = sphere_table(scene).radius
    return [
        "units si",
        "atom_style granular",
        "atom_modify map array sort 0 0",  # a restored state keeps its order of summation
        "boundary m m m",  # at least the box below, larger when a sphere leaves it: none gets lost
        *(["processors * * 1"] if scene.dim == 2 else []),
        "newton off",
        "communicate single vel yes",
        f"region box block {_box(scene)} units box",
        f"create_box {len(scene.names)} box",
        f"neighbor {0.2 * radius.min():.17g} {'nsq' if len(radius) <= FEW else 'bin'}",
        # the shim's: so many as there is use for
        *(["fix bins all neighbor/bins"] if len(radius) > FEW else []),
        # LIGGGHTS forgets the tangential spring of two spheres only in a gap it looks at, which by default is
        # none
        "neigh_modify delay 0" + (" contact_distance_factor 1.01" if _any(between, "springs") else "") +
        _room(radius),
        *_materials(scene),
        f"pair_style gran {_model(between)}",
        "pair_coeff * *",
        f"timestep {dt:.17g}",
        *_gravity(scene),
        *_motion(scene),
        f"fix wall all wall/gran/nodal {_model(at_wall)} primitive type 1 zplane 0.0",
    ]


def _any(interactions, name):
    return any(getattr(interaction, name) > 0 for interaction in interactions)


def _model(interactions):
    """Without friction there is no tangential history to keep."""
    return (f"model hertz/damped tangential {'coulomb' if _any(interactions, 'springs') else 'off'}" +
            (" cohesion sjkr" if _any(interactions, "adhesion") else "") +
            (" rolling_friction coulomb" if _any(interactions, "rolling") else ""))


def _motion(scene):
    """Single spheres and clusters are moved by fixes of their own."""
    if not scene.clusters:
        return ["fix move all nve/sphere"]
    single = ["group single type 1", "fix move single nve/sphere"] if len(scene.spheres.x) else []
    return [*single, "fix bodies all multisphere/splitting"]


def _room(radius):
    """For the partners of the largest sphere: no more than there are spheres, nor than have their volume, at
    the smallest radius, between it and the farthest place that counts as near."""
    large, small = radius.max(), radius.min()
    near = 1.01 * (large + small) + 0.2 * small + small
    partners = int(min(len(radius), (near**3 - (large - small) ** 3) / small**3))
    return f" one {partners} page {50 * partners}" if partners > PARTNERS else ""


def _box(scene):
    """The spheres at the start with some room; in a plane scene the third direction just holds them."""
    spheres = sphere_table(scene)
    low, high, room = spheres.x.min(axis=0), spheres.x.max(axis=0), 4 * spheres.radius.max()
    return " ".join(f"{a - room:.17g} {b + room:.17g}" for a, b in zip(low, high))


def _materials(scene):
    moduli, ratios = zip(*((m.E, m.nu) for m in scene.materials.values()))
    if min(ratios) < 0:
        raise ValueError(f"nu is {min(ratios)}: LIGGGHTS takes Poisson's ratios from 0 to 0.5; use "
                         "dem=reference")
    table = [_interaction(scene, a, b) for a in scene.names for b in scene.names]

    def per_pair(name, values):
        return f"fix {name} all property/global {name} peratomtypepair {len(scene.names)} " + _numbers(values)

    return [
        *(["soft_particles yes"] if min(moduli) < SOFTEST else []),
        *(["hard_particles yes"] if max(moduli) > HARDEST else []),
        "fix E all property/global youngsModulus peratomtype " + _numbers(moduli),
        "fix nu all property/global poissonsRatio peratomtype " + _numbers(ratios),
        per_pair("dampingRatio", (damping_ratio(i.restitution, i.pulls) for i in table)),
        per_pair("attraction", (i.pulls for i in table)),
        per_pair("coefficientFriction", (i.friction for i in table)),
        *([per_pair("cohesionEnergyDensity", (i.adhesion for i in table))]
          if _any(table, "adhesion") else []),
        *([per_pair("coefficientRollingFriction", (i.rolling for i in table))]
          if _any(table, "rolling") else []),
    ]


def _interaction(scene, a, b):
    """Contact constants of two materials; of no effect for those that never meet."""
    return scene.interaction(a, b) if frozenset((a, b)) in scene.interactions else Interaction()


def _gravity(scene):
    vector = np.zeros(3)
    vector[:scene.dim] = scene.gravity
    if scene.base:
        vector[:scene.dim] += scene.frame_pull(0.0, 0.0)
        return [*pull_of_now(vector), "fix gravity all gravity v_pull vector v_pull_x v_pull_y v_pull_z"]
    size = np.sqrt((vector**2).sum())
    return [f"fix gravity all gravity {size:.17g} vector " + _numbers(vector)] if size > 0 else []


def pull_of_now(vector):
    """Commands that make ``vector`` [m/s^2], (3,), that of gravity and the motion of the base: its size, and
    its direction, any where there is none."""
    size = np.sqrt((vector**2).sum())
    direction = vector if size > 0.0 else np.ones(3)
    return [f"variable pull{name} equal {value:.17g}"
            for name, value in zip(("", "_x", "_y", "_z"), (size, *direction))]


def _numbers(values):
    return " ".join(f"{value:.17g}" for value in values)
