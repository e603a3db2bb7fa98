"""docs/own_law.py: a law of the user's own, in a file of its own, in a scene, checked."""
import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpm_fenicsx import check_law
from mpm_fenicsx.laws import lame

ROOT = Path(__file__).parents[2]


@pytest.fixture
def own_law(monkeypatch):
    """The file as a module, as a user imports it."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("own_law")


@pytest.mark.parametrize("eta", [0.0, 1000.0])
def test_the_law_is_one(own_law, eta):
    report = check_law(own_law.damped(2.5e5, 0.25, eta))
    assert report.rate > 1.9 and report.turned < 1e-12 and report.asymmetry < 1e-12


def test_its_parameters_are_checked(own_law):
    with pytest.raises(ValueError, match="eta is -1.0 Pa s: give 0 or a positive number"):
        own_law.damped(1e6, 0.3, -1.0)


@pytest.mark.parametrize("eta", [0.0, 1000.0])
def test_the_layer_sways_as_one_of_a_kelvin_voigt_material(own_law, eta, tmp_path):
    """u'' + 2 zeta omega u' + omega^2 u = 0, omega = pi / 2 sqrt(mu / rho) / H, zeta = eta omega / 2 mu."""
    history = own_law.main(eta=eta, t_end=0.4, out=tmp_path)
    t, sway = (np.array(history["solid"][name]) for name in ("time", "sway"))
    mu = lame(2.5e5, 0.25)[1]
    omega = 0.5 * np.pi * np.sqrt(mu / 1000.0)
    zeta = 0.5 * eta * omega / mu
    turning = omega * np.sqrt(1.0 - zeta**2)
    exact = 0.01 / turning * np.exp(-zeta * omega * t) * np.sin(turning * t)
    assert abs(sway - exact).max() < 0.04 * abs(exact).max()


SCRIPT = '''"""What numba keeps of a script's kernels is read again when it is run again."""
from typing import NamedTuple
from mpm_fenicsx.compiled import specialise

class Params(NamedTuple):
    mu: float

D = 2

def twice(p, x):
    return D * p.mu * x

kernel = specialise(twice, D=3)
print(kernel(Params(2.0), 5.0), sum(kernel.stats.cache_hits.values()))
'''


def test_kernels_of_a_script_are_kept(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    said = [subprocess.run([sys.executable, "script.py"], cwd=tmp_path, env=env, capture_output=True,
                           text=True, timeout=120) for _ in range(2)]
    assert [each.stdout for each in said] == ["30.0 0\n", "30.0 1\n"], said


def test_kernels_of_an_interactive_session_are_refused(tmp_path):
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, env=env, capture_output=True,
                          text=True, timeout=120)
    assert "twice is defined in an interactive session" in done.stderr
