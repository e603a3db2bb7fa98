"""Each rank seeds its part of the material points: the parts are the whole, and all ranks see the same."""
import json

import numpy as np
import pytest

from mpm_fenicsx import Body, Box, Cloud, linear
from mpm_fenicsx.collective import Part
from mpm_fenicsx.points.points import half_widths, numbers, seed, surface_distances
from mpm_fenicsx.scene.lattice import lattice
from mpm_fenicsx.scene.mesh import Mesh

LAW = linear(1e6, 0.3)


def body(kind):
    """Bodies of every shape: boxes of each kind of cell, a mesh, a cloud."""
    if kind == "cloud":
        x = np.random.default_rng(1).random((37, 3))
        return Body(Cloud(x, 1e-3 * (1.0 + x[:, 0]), 0.1 * (1.0 + x)), None, None, LAW, 1000.0)
    if kind == "mesh":
        shape = Mesh(*lattice(Box((0.0, 0.0), (1.0, 0.7)), (5, 3), "triangle"), "triangle")
        return Body(shape, None, 3, LAW, 1000.0, thickness=0.5)
    dim = 2 if kind in ("quadrilateral", "triangle") else 3
    points = {"triangle": 6, "tetrahedron": 4}.get(kind, 3)
    return Body(Box((0.1,) * dim, (1.3, 0.8, 0.77)[:dim]), (5, 3, 2)[:dim], points, LAW, 1000.0, cell=kind)


@pytest.mark.parametrize("kind", ["quadrilateral", "triangle", "hexahedron", "tetrahedron", "mesh", "cloud"])
@pytest.mark.parametrize("ranks", [2, 7, 64])
def test_parts_are_the_whole(kind, ranks):
    """Bit for bit, whole cells each, however few there are for a rank."""
    one, parts = body(kind), [Part(rank, ranks) for rank in range(ranks)]
    whole, count = seed(one, even=True), numbers(one)[0]
    pieces = [seed(one, True, part) for part in parts]
    own = [numbers(one, part)[1] for part in parts]
    assert [piece[0].shape[0] for piece in pieces] == [s.stop - s.start for s in own]
    assert own[0].start == 0 and own[-1].stop == count == len(whole[0])
    assert all(a.stop == b.start for a, b in zip(own, own[1:]))
    for values, of_parts in zip(whole, zip(*pieces)):
        assert (np.concatenate(of_parts) == values).all()
    for sizes in (half_widths(one, whole[1]), surface_distances(one, whole[1], True)):
        assert sizes.shape == whole[0].shape
    for of in (half_widths, lambda b, volume, part=Part(): surface_distances(b, volume, True, part)):
        assert np.concatenate([of(one, piece[1], part) for piece, part in zip(pieces, parts)]) \
            == pytest.approx(of(one, whole[1]), rel=1e-14)


def test_a_part_needs_no_more_than_its_points():
    """A body of 10^12 points, of which one rank seeds 27."""
    large = object.__new__(Body)
    stated = body("hexahedron")
    for name in ("shape", "points", "cell", "law", "thickness"):
        object.__setattr__(large, name, getattr(stated, name))
    object.__setattr__(large, "cells", (10_000, 2_000, 2_000))
    part = Part(123_456_789, 40_000_000_000)
    x, volume = seed(large, part=part)
    assert numbers(large, part)[0] == 27 * 40_000_000_000 and len(x) == 27 == len(volume)
    i = np.array([123_456_789 % 10_000, 123_456_789 // 10_000 % 2_000, 123_456_789 // 20_000_000])
    lower = stated.shape.lower + i * stated.shape.size / large.cells
    assert (x > lower).all() and (x < lower + stated.shape.size / large.cells).all()


SEEDED = """
import json
import sys
import numpy as np
from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Structure, linear
from mpm_fenicsx.terms import bodies
seeded, make = [], bodies.BodyTerm.__init__


def counted(self, *arguments, **more):
    make(self, *arguments, **more)
    seeded.append(len(self.points))


bodies.BodyTerm.__init__ = counted
law, grid = linear(1e6, 0.3), Grid(Box((0.0, 0.0), (4.0, 1.0)), (16, 4))


def made(**more):
    block = Body(Box((0.0, 0.0), (2.0, 0.5)), (8, 2), 2, law, 1000.0, **more)
    drops = Body(Cloud([(3.0, 0.2), (3.2, 0.3)], [0.01, 0.02]), None, None, law, 1000.0)
    bed = Structure.plane("bed", (0.0, 0.0), "+y", grid.box, friction=0.3)
    return MPM(grid, [block, drops], inertia="lumped", gravity=(0.0, -9.81), structures=[bed])


def message(**more):
    try:
        made(**more)
    except Exception as error:
        return f"{type(error).__name__}: {error}"


solid = made()
bodies.BodyTerm.__init__ = make
for _ in range(3):
    solid.advance(1e-3)
comm, gids = solid.comm, [body.points.gid.tolist() for body in solid.bodies]
told = [message(velocity=lambda x: np.where(x < 1.0, 0.0, np.nan)),
        message(stress=lambda x: np.where(x[:, :1] < 1.0, 0.0, [[-1e9, 0.0, np.inf]]))]
answers = comm.allgather((seeded, gids, told))
if comm.rank == 0:
    with open(sys.argv[1], "w") as file:
        json.dump(answers, file)
solid.close()
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_ranks_share_the_points_from_the_start(on_ranks, tmp_path, ranks):
    """None seeds more than its part, then each point is on one rank; all tell what is wrong on some."""
    result = on_ranks(ranks, SEEDED, tmp_path / "answers.json")
    assert result.returncode == 0, result.stderr[-2000:]
    answers = json.loads((tmp_path / "answers.json").read_text())
    for n, count in enumerate((64, 2)):
        seeded = [answer[0][n] for answer in answers]
        assert sum(seeded) == count and max(seeded) <= -(-count // ranks) + 4
    assert sorted(sum((sum(answer[1], []) for answer in answers), [])) == list(range(66))
    told = answers[0][2]
    assert all(answer[2] == told for answer in answers)
    assert "ValueError" in told[0] and "velocity of the body" in told[0] and "stress of the body" in told[1]
