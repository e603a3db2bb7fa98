"""What LIGGGHTS is told about a scene: a pure function from the scene to command lines.

Two limits of LIGGGHTS are met here: a restitution of exactly 0.05 is given as 0.0500001 (it wants more than 0.05), and
Young's moduli outside 5e6..1e9 Pa need its consent (`soft_particles`, `hard_particles`).
"""
import numpy as np

SOFTEST, HARDEST = 5e6, 1e9  # Young's moduli LIGGGHTS takes without being asked, SI units [Pa]
FEW = 200  # up to so many spheres are searched without bins, whose number grows with the box


def commands(scene, dt):
    """LIGGGHTS commands that prepare ``scene`` for steps of ``dt`` [s]; spheres and wall nodes are added afterwards.

    Atom type 1 is the spheres, type 2 the wall. The fix "wall" is the shim's; its zplane is a placeholder.
    Raises ValueError for a negative Poisson's ratio, which LIGGGHTS does not know.
    """
    pair, wall = _model(scene.between), _model(scene.at_wall)
    radius = scene.spheres.radius
    return [
        "units si",
        "atom_style granular",
        "atom_modify map array sort 0 0",  # a restored state keeps its order of summation
        "boundary m m m",  # at least the box below, larger when a sphere leaves it: none gets lost
        *(["processors * * 1"] if scene.dim == 2 else []),
        "newton off",
        "communicate single vel yes",
        f"region box block {_box(scene)} units box",
        "create_box 2 box",
        f"neighbor {0.2 * radius.min():.17g} {'nsq' if len(radius) <= FEW else 'bin'}",
        # LIGGGHTS forgets the tangential spring of two spheres only in a gap it looks at, which by default is none
        "neigh_modify delay 0" + (" contact_distance_factor 1.01" if scene.between.friction > 0 else ""),
        *_materials(scene),
        f"pair_style gran {pair}",
        "pair_coeff * *",
        f"timestep {dt:.17g}",
        *_gravity(scene),
        "fix move all nve/sphere",
        f"fix wall all wall/gran/nodal {wall} primitive type 2 zplane 0.0",
    ]


def _model(interaction):
    """Without friction there is no tangential history to keep."""
    return f"model hertz tangential {'history' if interaction.friction > 0 else 'off'}"


def _box(scene):
    """The spheres at the start with some room; in a plane scene the third direction just holds them."""
    x, radius = scene.spheres.x, scene.spheres.radius.max()
    low, high = np.zeros(3), np.zeros(3)
    low[:scene.dim], high[:scene.dim] = x.min(axis=0), x.max(axis=0)
    return " ".join(f"{a - 4 * radius:.17g} {b + 4 * radius:.17g}" for a, b in zip(low, high))


def _materials(scene):
    moduli = scene.material.E, scene.wall_material.E
    ratios = scene.material.nu, scene.wall_material.nu
    if min(ratios) < 0:
        raise ValueError(f"nu is {min(ratios)}: LIGGGHTS takes Poisson's ratios from 0 to 0.5; use dem=reference")
    between, at_wall = scene.between, scene.at_wall
    restitution = [max(i.restitution, 0.0500001) for i in (between, at_wall, at_wall, at_wall)]
    friction = [i.friction for i in (between, at_wall, at_wall, at_wall)]
    return [
        *(["soft_particles yes"] if min(moduli) < SOFTEST else []),
        *(["hard_particles yes"] if max(moduli) > HARDEST else []),
        "fix E all property/global youngsModulus peratomtype " + _numbers(moduli),
        "fix nu all property/global poissonsRatio peratomtype " + _numbers(ratios),
        "fix e all property/global coefficientRestitution peratomtypepair 2 " + _numbers(restitution),
        "fix mu all property/global coefficientFriction peratomtypepair 2 " + _numbers(friction),
    ]


def _gravity(scene):
    vector = np.zeros(3)
    vector[:scene.dim] = scene.gravity
    size = np.sqrt((vector**2).sum())
    return [f"fix gravity all gravity {size:.17g} vector " + _numbers(vector)] if size > 0 else []


def _numbers(values):
    return " ".join(f"{value:.17g}" for value in values)
