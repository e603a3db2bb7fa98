"""What leaves a partition stays in the ledger."""
import numpy as np
import pytest

from coupling import Scheme, couple, nearest
from coupling.ledger.departures import Departures, left, lets_go
from coupling.ledger.exchange import Ledger
from dem_liggghts import Material, Scene, Spheres, Wall, open_dem
from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Interface, linear

G = np.array([1.5, -9.81])


def test_a_drop_that_leaves_the_grid_is_in_the_books():
    """Soil and a sphere fall freely, a drop flies out of the grid: no energy is made or lost, no impulse
    exchanged."""
    law, box = linear(1e3, 0.3), Box((-1.0, -1.0), (3.0, 2.0))
    block = Body(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), 2, law, 1.0)
    drop = Body(Cloud(np.array([[2.2, 0.3], [2.3, 0.35]]), np.full(2, 0.01)), None, None, law, 2.0,
                velocity=(8.0, 1.0))
    interface = Interface.line((0.0, 0.9), (1.0, 0.9), 2)
    solid = MPM(Grid(box, (16, 12)), [block, drop], interface=interface, gravity=G, outflow={"+x": "remove"})
    ball = Spheres(np.array([[0.5, 1.5]]), np.zeros((1, 2)), 0.1, 1000.0)
    grains = open_dem("reference", Scene(ball, Wall(interface.x, interface.elements), Material(1e5, 0.3),
                                         Material(1e5, 0.3), gravity=tuple(G)), 1e-3)
    ledger, departures, rows = Ledger(solid, grains, G), Departures(solid, grains), []
    assert lets_go(solid) and not lets_go(grains) and left(grains, "mass") == 0.0
    couple(solid, grains, nearest(interface.x, interface.x), Scheme(0.02, 0.2, substeps=20),
           on_window=[lambda window: rows.append({**ledger(window), **departures.entries()})])
    assert set(departures.columns) == {"left_solid", "left_solid_mass", "left_solid_energy",
                                       "left_solid_momentum_x", "left_solid_momentum_y"} <= set(rows[-1])
    assert rows[0]["left_solid"] == 0 and rows[-1]["left_solid"] == 2
    assert rows[-1]["left_solid_mass"] == pytest.approx(0.04, rel=1e-12)
    # the DEM's explicit scheme: of the sphere's fall
    assert max(abs(row["energy_error"]) for row in rows) < 1e-4
    assert rows[-1]["left_solid_energy"] > 1e-2 * abs(rows[-1]["energy_solid"])
    solid.close(), grains.close()
