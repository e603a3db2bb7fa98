"""A sphere at rest exactly over a vertex of the wall that it has dented: the iterated coupling converges."""
import pytest

from coupling.records.history import read

BED = dict(scene="rest", length=0.04, height=0.02, E=1e6, E_ball=1e6, rho=2000.0, gravity=10.0, h=2e-3,
           cfl=10.0, windows=60, iterate=20)


@pytest.mark.parametrize("restitution", [0.3, 1.0])
def test_iteration_converges_over_a_vertex(extreme, tmp_path, backend, restitution):
    """As 1e-5 m beside it."""
    over, beside = (extreme.main(**BED, at=(at,), dem=backend, restitution=restitution,
                                 out=str(tmp_path / str(at))) and read(tmp_path / str(at) / "history.csv")
                    for at in (0.0, 1e-5))
    assert over["iterations"].mean() < 6 and over["force"].max() > 0.0
    assert over["force"] == pytest.approx(beside["force"], abs=0.02 * beside["force"].max())
