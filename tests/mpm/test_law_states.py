"""What laws remember is stated once, by name, and found under these names in ParaView and in checkpoints."""
import h5py
import meshio
import numpy as np
import pytest
from mpi4py import MPI

from coupling.records.paraview import ParaView
from coupling.records.results import Results
from mpm_fenicsx import MPM, Body, Box, Grid, mohr_coulomb, neo_hooke
from mpm_fenicsx.laws import ELASTIC_STATE, SHOWN, Law
from tests.mpm.kelvin_voigt import kelvin_voigt

SOIL, CREEPS = mohr_coulomb(1e5, 0.3, 30.0), kelvin_voigt(1e5, 1e3)


def in_space(values):
    """As ParaView has them: tensors with nine components, in a row."""
    whole = np.zeros((len(values), 3, 3)) if values.ndim == 3 else values
    if values.ndim == 3:
        whole[:, :values.shape[1], :values.shape[2]] = values
    return whole.reshape(len(values), -1) if values.ndim == 3 else whole


def body(law, x):
    return Body(Box((x, 0.0), (x + 1.0, 1.0)), (2, 2), 2, law, 1000.0)


@pytest.fixture
def moving(start):
    """A soil and a body that creeps, which fly and deform."""
    solid = start(Grid(Box((-1.0, -1.0), (4.0, 2.0)), (10, 6)), [body(SOIL, 0.0), body(CREEPS, 1.0)],
                  inertia="lumped")
    for points in (each.points for each in solid.bodies):
        points.v[:] = points.x @ np.array([[-1.0, 0.0], [3.0, -1.0]])
    for _ in range(2):
        solid.advance(1e-3)
    return solid


def test_names_in_paraview_and_in_checkpoints(moving, tmp_path):
    """Of each law its own; points of the other one have zero in ParaView."""
    results = Results(tmp_path, "states")
    ParaView(results, "", MPI.COMM_SELF).add(0.0, moving.snapshot())
    shown = meshio.read(results.path("points_00000.vtu")).point_data
    results.close()
    moving.save(tmp_path / "state.h5")
    with h5py.File(tmp_path / "state.h5") as file:
        kept = {}
        file.visititems(lambda at, data: kept.update({at: data[()]} if hasattr(data, "shape") else {}))
    soil, creeps = (each.points for each in moving.bodies)
    n = len(soil)
    for points, place, other in ((soil, slice(n), slice(n, None)), (creeps, slice(n, None), slice(n))):
        for name in points.state.dtype.names:
            values = points.state[name]
            assert np.array_equal(shown[name][place], in_space(values))
            assert not shown[name][other].any()
            assert any(key.endswith(f"state.{name}") and each.tobytes() == values.tobytes()
                       for key, each in kept.items())
    assert soil.state["plastic_strain"].any() and creeps.state["strain"].any()


def test_all_else_that_paraview_shows_is_named(moving):
    names = {name for law in (SOIL, CREEPS) for name in law.state.names}
    assert set(moving.snapshot()["points"][2]) - names <= set(SHOWN)


def with_state(law, *fields):
    return law._replace(state=np.dtype(list(fields)))


@pytest.mark.parametrize("law, words", [
    (with_state(SOIL, ("mass", float)), "law mohr_coulomb calls a part of its state 'mass'"),
    (SOIL._replace(state=np.dtype(float)), "state of the law mohr_coulomb is float64: give a numpy dtype"),
    (SOIL._replace(params=[1.0, 2.0]), r"parameters of the law mohr_coulomb are \[1.0, 2.0\]: give a Named"),
    ("mohr_coulomb", "law of the body is 'mohr_coulomb': give a Law")], ids=["name", "type", "params", "law"])
def test_a_law_that_cannot_be_kept_is_refused(law, words):
    with pytest.raises(ValueError, match=words):
        body(law, 0.0)


def test_one_name_for_two_shapes_is_refused():
    laws = [with_state(neo_hooke(1e5, 0.3), ("strain", float)), CREEPS]
    with pytest.raises(ValueError, match="the laws neo_hooke and kelvin_voigt both remember 'strain'"):
        MPM(Grid(Box((-1.0, -1.0), (4.0, 2.0)), (10, 6)), [body(laws[0], 0.0), body(laws[1], 1.0)])


def test_a_checkpoint_of_a_law_that_remembered_less_is_refused(start, moving, tmp_path):
    """The same parameters, but the law has been changed since."""
    moving.save(tmp_path / "state.h5")
    more = with_state(SOIL, *((name, SOIL.state[name]) for name in SOIL.state.names), ("wetness", float))
    assert isinstance(more, Law) and more.state != ELASTIC_STATE
    solid = start(Grid(Box((-1.0, -1.0), (4.0, 2.0)), (10, 6)), [body(more, 0.0), body(CREEPS, 1.0)],
                  inertia="lumped")
    with pytest.raises(ValueError, match="the checkpoint has no state.wetness"):
        solid.load(tmp_path / "state.h5")
