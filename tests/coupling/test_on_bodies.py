"""Columns of forces on the named bodies of a solid: what rocks lose, bodies have got."""
import numpy as np
import pytest

from coupling import Output, Run, Scheme
from coupling.ledger.on_bodies import OnBodies
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Balls, Body, Box, Grid, Support, linear


def plate():
    """A plate on a foot with two force cells, and two discs that fly against it, one at each."""
    body = Body(Box((0.0, 0.0), (0.1, 0.4)), (4, 16), 2, linear(1e7, 0.3), 1500.0, name="plate",
                force_cells=(1, 2))
    grid = Grid(Box((-0.1, 0.0), (0.2, 0.45)), (12, 18))
    foot = Support(lambda x: x[:, 1] < 1e-9, "xy", name="foot")
    solid = MPM(grid, body, [foot], Balls(0.006), inertia="lumped")
    discs = Spheres([(-0.03, 0.1), (-0.03, 0.3)], [(2.0, 0.0), (1.0, 0.5)], 0.02, 2600.0)
    grains = Scene(discs, Wall.discs(np.zeros((0, 2)), 0.006), Material(1e7, 0.3), Material(1e7, 0.3),
                   Interaction(0.5, 0.3), Interaction(0.5, 0.3))
    return solid, grains


@pytest.mark.parametrize("dem", ["reference", "liggghts"])
def test_what_rocks_lose_bodies_have_got(tmp_path, dem):
    """To round-off, with its moment, and a run that goes on has the same columns."""
    scheme = Scheme(dt=2e-4, t_end=0.014, substeps=20, dem=dem)
    history = Run("plate", *plate(), scheme, Output(tmp_path, checkpoint="end")).go()[dem]
    names = "plate_1", "plate_2"
    hits = [history[f"force_rock_{name}_x"] * 2e-4 for name in names]
    assert all(np.sum(hit) > 0.09 for hit in hits)
    for name, hit in zip(names, hits):
        assert np.cumsum(hit) == pytest.approx(history[f"impulse_{name}_x"], rel=1e-10, abs=1e-12)
    whole = sum(history[f"impulse_{name}_x"] for name in names)
    assert whole == pytest.approx(-history["impulse_grains_x"], rel=1e-10, abs=1e-10)
    turned = sum(np.cumsum(history[f"moment_rock_{name}_z"]) * 2e-4 for name in names)
    assert turned == pytest.approx(history["angular_solid_z"], rel=0.02, abs=1e-3)
    assert history["momentum_error"].max() < 1e-10
    assert not any(name.startswith("force_soil_plate") for name in history.columns)
    more = Scheme(dt=2e-4, t_end=0.016, substeps=20, dem=dem)
    again = Run("plate", *plate(), more, Output(tmp_path, restart=tmp_path)).go()[dem]
    np.testing.assert_array_equal(again["force_rock_plate_1_x"][:70], history["force_rock_plate_1_x"])
    whole = sum(again[f"impulse_{name}_x"] for name in names)
    assert whole == pytest.approx(-again["impulse_grains_x"], rel=1e-10, abs=1e-10)


class Named:
    """A solid whose body has the name of a wall."""

    def impulses_on_bodies(self):
        return {"wall": {"bodies": np.zeros(3)}}


def test_two_columns_with_one_name_are_refused():
    assert list(OnBodies(Named()).columns) == [
        "force_soil_wall_x", "force_soil_wall_y", "moment_soil_wall_z", "impulse_wall_x", "impulse_wall_y"]
    with pytest.raises(ValueError, match="impulse_wall_x would be two columns"):
        OnBodies(Named(), ["impulse_wall_x"])
    assert OnBodies(object()).columns == {}
