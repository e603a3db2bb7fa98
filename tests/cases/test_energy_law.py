"""docs/energy_law.py: a law stated as an energy, in a scene, with checkpoints, on ranks, on a path."""
import shutil
from pathlib import Path

import numpy as np
import pytest

from coupling.records.history import read
from mpm_fenicsx import check_law, element

FILE = Path(__file__).parents[2] / "docs/energy_law.py"


@pytest.fixture
def energy_law(monkeypatch):
    """The file as a module, as a user imports it."""
    monkeypatch.syspath_prepend(FILE.parent)
    import energy_law

    return energy_law


def test_the_law_is_one(energy_law):
    assert check_law(energy_law.rubber(4e4, 1e4, 5e5)).rate > 1.95


def test_the_layer_sways_as_the_shear_modulus_says(energy_law, tmp_path):
    """u = far sin(k y) sin(omega t) with omega = k sqrt(2 (c1 + c2) / rho), k = pi / 2 H; as the layer is
    thin and its sides are free, this is right for small far."""
    history = energy_law.main(far=0.02, out=tmp_path)
    t, speed, strain = (np.array(history["solid"][name]) for name in ("time", "speed", "strain"))
    k, mu, thick = 0.5 * np.pi, 2.0 * 5e4, 0.1
    omega = k * np.sqrt(mu / 1000.0)
    whole = 0.5 * mu * thick * 0.5 * (0.02 * k) ** 2  # strain energy where the layer turns
    assert abs(speed - 0.02 * omega / k * np.cos(omega * t)).max() < 0.01 * 0.02 * omega / k
    assert abs(strain - whole * np.sin(omega * t) ** 2).max() < 0.02 * whole


@pytest.mark.mpi
def test_one_rank_compiles_for_all(run_ranks, monkeypatch, tmp_path):
    """Without a compiler every rank ends with one sentence, in which no rank waits for another one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("CC", "no-compiler")
    done = run_ranks(2, FILE, "t_end=0.004", f"out={tmp_path / 'out'}")
    sentence = "the energy mooney_rivlin cannot be compiled, there is no C compiler (no-compiler)"
    assert done.returncode != 0 and done.stderr.count(sentence) == 1
    monkeypatch.delenv("CC")
    done = run_ranks(2, FILE, "t_end=0.004", f"out={tmp_path / 'out'}")
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "cache").rglob("libffcx_expressions_*.so"))) == 1


@pytest.mark.mpi
def test_it_goes_on_from_a_checkpoint_on_other_ranks(script_on_ranks, tmp_path):
    """To the last bit on as many ranks, to round-off on others."""
    first = tmp_path / "first"
    done = script_on_ranks(2, FILE, "t_end=0.1", "checkpoint=40", f"out={first}")
    assert done.returncode == 0, done.stderr
    for n in (2, 1):
        again = tmp_path / f"ranks{n}"
        shutil.copytree(first, again)
        (again / "checkpoint.h5").unlink()
        done = script_on_ranks(n, FILE, f"restart={again}")
        assert done.returncode == 0, done.stderr
        old, new = (read(folder / "history.csv") for folder in (first, again))
        for name in ("speed", "strain"):
            near = 0.0 if n == 2 else 1e-10 * np.abs(old[name]).max()
            np.testing.assert_allclose(new[name], old[name], rtol=0, atol=near)


def test_it_is_driven_by_its_name(tmp_path, capsys):
    """Uniaxial tension to twice the length: 2 (stretch^2 - 1 / stretch) (c1 + c2 / stretch) without change
    of volume, which a bulk modulus of 1000 times as much nearly is."""
    words = f"law={FILE}:rubber c1=0.3 c2=0.1 K=1000 path=triaxial shortening=-0.6931471805599453"
    assert element.main([*words.split(), f"out={tmp_path}"]) == 0
    said = capsys.readouterr().out.splitlines()[1]
    q = float(said.split("q = ")[1].split()[0])
    assert q == pytest.approx(2.0 * 3.5 * (0.3 + 0.05), rel=2e-3)
