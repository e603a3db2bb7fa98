"""What tests on several ranks do with a scene: its points travel between the ranks, and the end is saved."""
import numpy as np

from mpm_fenicsx import MPM, Numerics


def travel(path, make, steps, dt=2.5e-3, look=None, **numerics):
    """Advance the solid of ``make()`` by that many steps, to the last digits and with a new distribution of
    the grid whenever one rank has 5 % more points than the mean. Into the file at ``path``: ``x`` and ``v``
    of the points at the end in their order, ``looks``: what ``look(solid)`` gave after each step, ``parts``:
    number of new distributions, and ``ranks``. Collective."""
    MPM.rebalance_every = 5
    solid, looks = make(), []
    solid.numerics = Numerics(rebalance=1.05, **numerics)
    for _ in range(steps):
        solid.advance(dt)
        looks.append(look(solid) if look else 0.0)
    gid, x, v = (np.concatenate(solid.comm.allgather(getattr(solid.points, name)))
                 for name in ("gid", "x", "v"))
    order, parts = np.argsort(gid), len(solid.rebalances)
    if solid.comm.rank == 0:
        np.savez(path, x=x[order], v=v[order], looks=looks, parts=parts, ranks=solid.comm.size)


def on_one_and_more(on_ranks, folder, code, more, *words):
    """What the ``code`` saved, which gets a path as its first word, on one rank and on ``more``: x and v are
    the same, and the grid has been distributed anew."""
    found = []
    for ranks in (1, more):
        path = folder / f"{ranks}.npz"
        done = on_ranks(ranks, code, path, *words, "-mpm_snes_rtol", "1e-12")
        assert done.returncode == 0, done.stderr
        found.append(np.load(path))
    one, many = found
    assert many["ranks"] == more and many["parts"] > 0 and one["parts"] == 0
    for name in ("x", "v"):
        np.testing.assert_allclose(many[name], one[name], rtol=0, atol=1e-10)
    return one, many
