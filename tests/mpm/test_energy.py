"""Laws that are stated as energies in UFL: against a law written by hand and closed forms; what is
refused."""
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import ufl
from ufl import det, ln, tr

from mpm_fenicsx import MPM, Body, Box, Grid, check_law, drive, from_energy, neo_hooke
from mpm_fenicsx.laws import compat, lame
from mpm_fenicsx.laws.paths import triaxial

ROOT = Path(__file__).parents[2]
EPS = np.finfo(float).eps
LAM, MU = lame(1.0, 0.3)


def neo(F, mu, lam):
    return mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) + lam / 2 * ln(det(F)) ** 2


def mooney_rivlin(F, c1, c2, K):
    J, C = det(F), F.T * F
    I1 = tr(C)
    I2 = (I1**2 - tr(C * C)) / 2
    return c1 * (J ** (-2 / 3) * I1 - 3) + c2 * (J ** (-4 / 3) * I2 - 3) + K / 2 * (J - 1) ** 2


def gent(F, mu, limit, K):
    J = det(F)
    I1 = J ** (-2 / 3) * tr(F.T * F)
    return -mu / 2 * limit * ln(1 - (I1 - 3) / limit) + K / 2 * ((J**2 - 1) / 2 - ln(J))


LAWS = {"neo": (neo, dict(mu=MU, lam=LAM)), "mooney_rivlin": (mooney_rivlin, dict(c1=0.3, c2=0.1, K=2.0)),
        "gent": (gent, dict(mu=0.4, limit=30.0, K=2.0))}


@pytest.mark.parametrize("seed", range(4))
def test_neo_hookean_energy_is_the_law_written_by_hand(stress_state, at_point, seed):
    one, other = (at_point(law, stress_state) for law in (from_energy(neo, mu=MU, lam=LAM),
                                                          neo_hooke(1.0, 0.3)))
    random = np.random.default_rng(seed)
    F = np.eye(one.dim) + random.uniform(-0.3, 0.3, (one.dim, one.dim))
    assert one.F33(F) == pytest.approx(other.F33(F), abs=10 * EPS)
    np.testing.assert_allclose(one.P(F), other.P(F), rtol=0, atol=30 * EPS)
    np.testing.assert_allclose(one.A(F), other.A(F), rtol=0, atol=100 * EPS)
    assert one.W(F) == pytest.approx(other.W(F), abs=30 * EPS)
    assert abs(one.P33(F)) < 30 * EPS or stress_state == "plane_strain"


@pytest.mark.parametrize("name", sorted(LAWS))
def test_it_is_a_law(name):
    psi, parameters = LAWS[name]
    report = check_law(from_energy(psi, **parameters))
    assert report.name == name and report.rate > 1.95 and report.turned < 1e-13
    assert report.asymmetry == 0.0 and abs(report.dissipated) < 1e-3


def test_the_constant_of_an_energy_does_not_count():
    shifted = from_energy(lambda F, mu, lam: neo(F, mu, lam) + 7 * mu + 5, mu=MU, lam=LAM)
    assert check_law(shifted).at_rest < 1e-15 and shifted.name == "energy"


def of_mooney_rivlin(stretch):
    """Cauchy stress in uniaxial tension without change of volume (Bonet & Wood, section 6.6)."""
    return 2.0 * (stretch**2 - 1.0 / stretch) * (0.3 + 0.1 / stretch)


def of_gent(stretch):
    """mu limit / (limit - I1 + 3) (stretch^2 - 1 / stretch) (Gent 1996, doi 10.5254/1.3538357)."""
    return 0.4 * 30.0 / (30.0 - stretch**2 - 2.0 / stretch + 3.0) * (stretch**2 - 1.0 / stretch)


@pytest.mark.parametrize("name", ["mooney_rivlin", "gent"])
@pytest.mark.parametrize("stretch", [0.6, 3.0])
def test_uniaxial_stress_tends_to_that_of_no_change_of_volume(name, stretch):
    """The difference falls as 1 / K."""
    psi, parameters = LAWS[name]
    exact, errors = dict(mooney_rivlin=of_mooney_rivlin, gent=of_gent)[name](stretch), []
    for K in (100.0, 1000.0):
        law = from_energy(psi, **{**parameters, "K": K})
        errors.append(drive(law, triaxial(shortening=-math.log(stretch), steps=20))["s_yy"][-1] / exact - 1.0)
    assert abs(errors[1]) < 6e-3 and errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("plane_stress", [False, True])
def test_a_body_moves_as_one_of_the_law_written_by_hand(plane_stress, options):
    options(snes_rtol=1e-12, snes_atol=1e-10)  # of loads of some 100 N
    ends = []
    for law in (from_energy(neo, mu=1e3 * MU, lam=1e3 * LAM), neo_hooke(1e3, 0.3)):
        state = dict(stress_state="plane_stress") if plane_stress else {}
        body = Body(Box((0.0, 0.0), (1.0, 1.0)), (2, 2), 2, law, 1.0,
                    velocity=lambda x: 3.0 * np.column_stack([x[:, 1], -x[:, 0] ** 2]), **state)
        solid = MPM(Grid(Box((-1.0, -1.0), (2.0, 2.0)), (6, 6)), body)
        for _ in range(10):
            solid.advance(0.01)
        ends.append((solid.points.x.copy(), solid.energy()["strain"]))
        solid.close()
    np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=0, atol=1e-9)
    assert ends[0][1] == pytest.approx(ends[1][1], rel=1e-7) and ends[0][1] > 1e-3


REFUSED = {
    "vector": (lambda F: F, "is not a scalar, it has the shape .3, 3."),
    "indices": (lambda F: F[ufl.i, ufl.j], "is not a scalar"),
    "number": (lambda F: 3.0, "does not depend on F"),
    "constant": (lambda F, mu: 3.0 * mu, "does not depend on F"),
    "foreign": (lambda F: tr(F) * ufl.Constant(ufl.triangle), "the energy (depends|cannot be read)"),
    "place": (lambda F: neo(F, 1, 1) * ufl.SpatialCoordinate(ufl.triangle)[0], "(depends|cannot be read)"),
    "numpy": (lambda F: math.log(det(F)), "cannot be read by UFL"),
    "stress": (lambda F, mu: mu / 2 * (tr(F.T * F) - 3), "has a stress of 3.464 Pa at F = I"),
    "root": (lambda F: ufl.sqrt(tr(F.T * F) - 3), "is not a number at F = I")}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_no_energy_is_refused(what):
    psi, sentence = REFUSED[what]
    parameters = dict(mu=2.0) if what in ("constant", "stress") else {}
    with pytest.raises(ValueError, match=sentence):
        from_energy(psi, **parameters)


def test_parameters_are_those_of_the_energy():
    with pytest.raises(ValueError, match="takes other arguments than F and mu .*lam"):
        from_energy(neo, mu=1.0)
    with pytest.raises(ValueError, match="mu is nan: give a finite number"):
        from_energy(neo, mu=math.nan, lam=1.0)
    with pytest.raises(ValueError, match="the energy is 3: give a function"):
        from_energy(3)


SCRIPT = """
import os
import sys
from ufl import det, ln, tr
from mpm_fenicsx import check_law, from_energy
from mpm_fenicsx.laws import kernels

def soft(F, mu):
    return mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) + 3 * mu * ln(det(F))**2

if sys.argv[2:] == ["alone"]:
    os.environ["PATH"] = ""  # MPI has started already, which needs it

try:
    law = from_energy(soft, mu=float(sys.argv[1]))
    report = check_law(law)
    hits = sum(sum(kernel.stats.cache_hits.values()) for kernel in (*kernels(law, 2), *kernels(law, 3)))
    print(hits, report.rate > 1.9)
except RuntimeError as error:
    print(error)
"""


@pytest.fixture
def run_script(tmp_path):
    """``run_script(mu, "alone")``: what the script says, and the number of compiled files; alone: without a
    compiler."""
    (tmp_path / "script.py").write_text(SCRIPT)
    own = dict(PYTHONPATH=str(ROOT), XDG_CACHE_HOME=str(tmp_path / "cache"),
               NUMBA_CACHE_DIR=str(tmp_path / "kernels"))

    def run(*words):
        done = subprocess.run([sys.executable, "script.py", *map(str, words)], cwd=tmp_path, timeout=240,
                              text=True, env={**os.environ, **own}, capture_output=True)
        assert done.returncode == 0 and not done.stderr, done.stderr
        return done.stdout.strip(), len(list((tmp_path / "cache").rglob("*.so")))

    return run


def test_what_another_run_has_begun_is_waited_for(monkeypatch, tmp_path):
    """Whoever finds the file of another one waits for its end."""
    monkeypatch.setattr(compat, "WAIT", 1)
    monkeypatch.setattr(compat, "_folder", lambda: str(tmp_path))
    law = from_energy(neo, mu=1.0, lam=3.0)
    next(tmp_path.glob("*.c.cached")).unlink()
    with pytest.raises(RuntimeError, match="compiled by another run, or was by one that is gone: wait, or "
                                           f"remove {tmp_path}/.*.c$"):
        from_energy(neo, mu=1.0, lam=law.params.lam)


def test_the_same_formula_is_compiled_once_in_a_process(monkeypatch, tmp_path):
    """Whatever else UFL has been given in between, and whatever the names of its indices."""
    def square(F, mu):
        i, j = ufl.indices(2)
        return mu / 2 * F[i, j] * F[i, j] - mu * ln(det(F)) + mu * ln(det(F)) ** 2

    monkeypatch.setattr(compat, "_folder", lambda: str(tmp_path))
    keys = set()
    for mu in (1.0, 2.0):
        keys.add(from_energy(square, mu=mu).parts)
        ufl.variable(ufl.Constant(ufl.Mesh(compat._element())))
    assert len(keys) == 1 and len(list(tmp_path.glob("*.so"))) == 1


def test_it_is_compiled_once_for_all_processes_and_moduli(run_script):
    said, count = run_script(1.0, "alone")
    assert said.startswith("the energy soft cannot be compiled, there is no C compiler") and count == 0
    assert run_script(1.0) == ("0 True", 1)
    assert run_script(1.0, "alone") == ("4 True", 1)
    assert run_script(2.5, "alone") == ("4 True", 1)


def stiffer(F, mu, lam):
    return mu / 2 * (tr(F.T * F) - 3) - mu * ln(det(F)) + lam / 2 * (det(F) - 1) ** 2


stiffer.__name__ = "neo"  # another energy under the same name, with the same parameters


def test_a_checkpoint_of_another_formula_is_told(tmp_path):
    box = Box((0.0, 0.0), (1.0, 1.0))
    make = lambda psi: MPM(Grid(box, (2, 2)), Body(box, (2, 2), 2, from_energy(psi, mu=MU, lam=LAM), 1.0))  # noqa: E731
    first = make(neo)
    first.advance(0.1)
    first.save(tmp_path / "neo.h5")
    make(neo).load(tmp_path / "neo.h5")
    with pytest.raises(ValueError, match="another scene: its laws differ from those here"):
        make(stiffer).load(tmp_path / "neo.h5")
