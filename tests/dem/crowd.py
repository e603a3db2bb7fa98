"""Scenes of many spheres, and runs of them on the ranks that are there; for `test_shared.py`."""
from dataclasses import replace

import numpy as np
from conftest import make_sheet
from mpi4py import MPI

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall
from dem_liggghts.reference import ReferenceDEM
from dem_liggghts.reference.shared import Shared
from mpm_fenicsx import Box, Structure

COMM, DT, STEPS, R = MPI.COMM_WORLD, 1e-5, 20, 5e-3
ROUGH = Interaction(0.6, 0.4, rolling=0.2)


class SharedDEM(ReferenceDEM):
    """It shares a few spheres, too."""

    many = 1


def heap(dim=3, apart=-20.0, **more):
    """Spheres of many sizes and three clusters, two of them free, thrown together onto a wall that waves and
    stretches, before a wall at the side. apart: speed with which they leave the middle, over the place
    [1/s]."""
    random, up = np.random.default_rng(1), np.eye(dim)[-1]
    counts = (7, 3) if dim == 2 else (5, 4, 3)
    places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, dim)
    x = 2.05 * R * (places - np.mean(places, axis=0) * (1.0 - up)) + (0.0238 + R) * up
    radius = R * random.uniform(0.9, 1.0, len(x))
    v = 0.3 * random.normal(size=x.shape) - 1.5 * up + apart * x * (1.0 - up)
    wall = make_sheet(dim, 12, 0.2, height=lambda x: 1e-3 * np.cos(40 * x))
    along = np.eye(dim)[0]
    # the held one does not touch the wall, where its mass would make the largest force by far
    clusters = [Cluster.box([0.02] * dim, [3] * dim, height * up + place * along, 800.0, depth=0.02,
                            v=np.sign(apart) * speed * along - 0.2 * up, free=speed > 0.0, material="wood")
                for place, height, speed in ((-0.022, 0.0135, 0.0), (0.0, 0.012, 0.3), (0.022, 0.012, 0.4))]
    stands = make_sheet(dim, 1, 0.2)
    nodes = np.roll(stands.nodes, 1, axis=1) * ([1] * (dim - 1) + [-1]) + 0.04 * along  # faces -x
    side = Wall(nodes, stands.elements if dim == 3 else stands.elements[:, ::-1], material="wood")
    names = "spheres", "wood", "wall"
    scene = Scene(Spheres(x, v, radius, 2500.0), wall, Material(1e6, 0.3), Material(2e6, 0.2),
                  gravity=-9.81 * up, clusters=clusters, walls=[side], between=ROUGH, at_wall=ROUGH,
                  materials={"wood": Material(8e5, 0.4)},
                  interactions={("wood", name): ROUGH for name in names}, **more)
    return scene, wall


def leaving():
    """Of the heap some leave on each side."""
    return heap(apart=40.0, domain=((-0.0235, -0.0185, -0.01), (0.0235, 0.0185, 0.08)),
                outflow={"-x": "hold", "+x": "remove", "-y": "remove", "+y": "hold"})


def rocks():
    """The free clusters alone, pushed onto the wall and each other: of three ranks one has none."""
    scene, wall = heap()
    pushed = [replace(rock, v=(speed, 0.0, -0.3)) for rock, speed in zip(scene.clusters[1:], (0.3, -0.3))]
    return replace(scene, spheres=None, clusters=pushed), wall


def smooth():
    """Spheres without friction, so without springs, that are pressed together."""
    places = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = 2.002 * R * (places - 1.5) + np.random.default_rng(2).uniform(-4e-6, 4e-6, (64, 3))
    wall, none = Wall(np.zeros((0, 3)), np.zeros((0, 3), int)), Interaction(0.5, 0.0)
    spheres = Spheres(x, -20.0 * x + 0.1, R, 2500.0, np.random.default_rng(4).normal(size=x.shape))
    return Scene(spheres, wall, Material(1e6, 0.3), Material(1e6, 0.3), none, none), wall


def among_structures():
    """Spheres in a box of structures, one of whose walls is pushed against them."""
    places = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = 2.02 * R * (places + 0.5) + np.random.default_rng(3).uniform(-4e-5, 4e-5, (64, 3))
    room = Box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))
    bed = Structure.plane("bed", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), room, friction=0.3)
    pusher = Structure.box("pusher", Box((-0.02, -0.02, -0.02), (-1e-4, 0.06, 0.06)), cells=(1, 2, 1),
                           friction=0.2, motion=lambda t: (0.4 * t, 0.0, 0.0))
    wall = Wall(np.zeros((0, 3)), np.zeros((0, 3), int))
    return Scene(Spheres(x, np.zeros(x.shape), R, 2500.0), wall, Material(1e6, 0.3), None, ROUGH, ROUGH,
                 gravity=(0.0, 0.0, -9.81), structures=[bed, pusher]), wall


SCENES = {"heap": heap, "plane": lambda: heap(2), "leaving": leaving, "rocks": rocks, "smooth": smooth,
          "structures": among_structures}


def window(wall, t, length):
    """Nodes and velocities of the ``wall`` that waves and stretches."""
    up = np.eye(wall.nodes.shape[1])[-1]
    at = [wall.nodes * (1 + 0.05 * np.sin(30 * s)) + 1e-3 * np.sin(200 * s) * up for s in (t, t + length)]
    return at[0], (at[1] - at[0]) / length


def start(name):
    """The scene on all ranks, which share it where there are several, and its moving wall."""
    scene, wall = SCENES[name]()
    dem = SharedDEM(scene, DT, COMM)
    assert isinstance(dem._part, Shared) == (COMM.size > 1)
    return dem, wall


def go(dem, wall, windows):
    """Forces in each of so many windows, (windows, n, dim)."""
    length = STEPS * DT
    return np.array([dem.advance(STEPS, *window(wall, dem.time, length)) for _ in range(windows)])


def momentum(dem):
    """Linear, of single spheres and clusters, (dim,)."""
    single = dem.particles()
    parts = single[single["body"] == 0], dem.bodies()
    return sum((p["mass"][:, None] * p["v"]).sum(axis=0) for p in parts)[:dem.scene.dim]


def everything(dem):
    """What a DEM says of itself, name → array."""
    out = {f"state {name}": np.asarray(value) for name, value in dem.get_state().items()}
    for what, table in (("particles", dem.particles()), ("bodies", dem.bodies())):
        out.update({f"{what} {name}": table[name] for name in table.dtype.names})
    between, at_walls = dem.contacts()
    out.update(between=between.partners, overlap=between.overlap, springs=between.springs,
               at_walls=at_walls.partners, wall_springs=at_walls.springs,
               energy=np.array(list(dem.energy().values())),
               removed=np.concatenate([np.atleast_1d(value) for value in dem.removed.values()]))
    return {**out, "impulses": np.concatenate(list(dem.impulses().values()))}


def keep(path, found):
    """Write what rank 0 has ``found`` where all have found the same."""
    mine = {name: array.tobytes() for name, array in found.items()}
    assert all(theirs == mine for theirs in COMM.allgather(mine)), "ranks differ"
    if COMM.rank == 0:
        np.savez(path, **found)


def run(name, path, windows=30):
    """A run from the start. lost: momentum that the books do not explain, over that of all."""
    dem, wall = start(name)
    first, built = momentum(dem), []
    build = dem._build_lists
    dem._build_lists = lambda t: (built.append(t), build(t))
    forces = go(dem, wall, windows)
    given = sum(dem.impulses().values())[:dem.scene.dim]
    lost = momentum(dem) + dem.removed["momentum"] - first - given
    lost /= np.linalg.norm(dem.particles()["v"] * dem.particles()["mass"][:, None])
    keep(path, {"forces": forces, "built": np.array(built), "lost": lost, **everything(dem)})


def traffic(name):
    """Of each rank in a step of this scene: messages and bytes."""
    dem, wall = start(name)
    go(dem, wall, 1)
    steps, *sent = dem._part.traffic.tolist()
    return COMM.allgather([one / steps for one in sent])


def halves(before, after, windows=15):
    """The second half of a run of the heap, from the file ``before``, written where there is none. What is
    asked of the run in between changes nothing in it. Each window is repeated from the state before, bit for
    bit, though by then some spheres may be beyond where ranks have been divided."""
    dem, wall = start("heap")
    if before.exists():
        dem.load(before)
    else:
        go(dem, wall, windows)
        dem.save(before)
        everything(dem)
    forces = []
    for _ in range(windows):
        state = dem.get_state()
        first = {"forces": go(dem, wall, 1), **everything(dem)}
        dem.set_state(state)
        forces.append(go(dem, wall, 1))
        again = {"forces": forces[-1], **everything(dem)}
        assert all(np.array_equal(first[name], again[name]) for name in first)
    keep(after, {**again, "forces": np.array(forces)})


def replaced(path):
    """The heap on a wall that becomes finer, then on discs that change their numbers; at last it halts."""
    dem, wall = start("heap")
    forces = [go(dem, wall, 20).sum(axis=0)]
    finer = make_sheet(3, 24, 0.2, height=lambda x: 1e-3 * np.cos(40 * x))
    now = Wall(window(finer, dem.time, DT)[0], finer.elements)
    for wall in (now, Wall.discs(now.nodes, 4e-3), Wall.discs(now.nodes[::-1], 4e-3)):
        order = np.arange(len(wall.nodes))[::-1] if wall.radius and dem.scene.wall.radius else None
        dem.replace_wall(wall, order)
        x = np.array(wall.nodes)
        forces += [dem.advance(STEPS, x, np.zeros(x.shape)) for _ in range(5)]
    dem.halt()
    forces.append(dem.advance(STEPS, x, np.zeros(x.shape)))
    keep(path, {**{f"force {k}": force for k, force in enumerate(forces)}, **everything(dem)})


def fails(what):
    """What a run says that goes wrong, on all ranks."""
    scene, wall = SCENES["heap"]()
    at, v, x = scene.spheres.x.copy(), scene.spheres.v.copy(), window(wall, 0.0, DT)[0]
    if what == "through":
        v[24] = 0.0, 0.0, -20.0
    if what == "outside":
        scene = replace(scene, domain=((-1.0, -1.0, -1.0), (1.0, 1.0, 0.06)))
        v[57, 2] = 300.0
    if what == "same place":
        at[32] = at[31]
    if what == "wall":
        x[3, 1] = np.nan
    dem = SharedDEM(replace(scene, spheres=replace(scene.spheres, x=at, v=v)), DT, COMM)
    said = "nothing"
    try:
        for _ in range(10):
            dem.advance(STEPS, x, np.zeros(x.shape))
    except (RuntimeError, FloatingPointError) as error:
        said = f"{type(error).__name__}: {error}"
    assert set(COMM.allgather(said)) == {said}, "ranks differ"
    return said


def few(path):
    """A few spheres, of which each rank steps all: one rank needs no other for it."""
    scene, wall = heap()
    dem = ReferenceDEM(scene, DT, COMM)
    found = {"forces": go(dem, wall, 25), **everything(dem)} if COMM.rank == 0 else None
    if found:
        np.savez(path, **found)
