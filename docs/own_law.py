"""A law of one's own in a scene of one's own: a layer of damped rubber sways on a base that is held.

    python own_law.py                  a few seconds; --help shows all keys
    python own_law.py eta=0            without damping
"""
from typing import NamedTuple

import numpy as np

import mpm_dem_checks as check
from coupling import Output, Run, Steps, case
from mpm_fenicsx import MPM, Body, Box, Grid, Law, Support
from mpm_fenicsx.laws import lame

# ---------------------------------------------------------------- the law


class Params(NamedTuple):
    """Lamé parameters [Pa] and viscosity [Pa s]."""

    lam: float
    mu: float
    eta: float


STATE = np.dtype([("strain", float, (3, 3))])  # E at the end of the last step
D = 2  # fixed when the kernels are compiled, in the plane and in space


def stress(p, F, F33, dt, old, new, P):
    """P = F S with S = lam tr(E) 1 + 2 mu E + 2 eta dE/dt and E = (F^T F - 1) / 2."""
    rate = 1.0 / dt if dt > 0.0 else 0.0  # dt = 0: the stress that is there; infinite: slowly
    for i in range(D):
        for j in range(D):
            s = -1.0 if i == j else 0.0
            for k in range(D):
                s += F[k, i] * F[k, j]
            new.strain[i, j] = 0.5 * s
    if D == 2:
        new.strain[2, 2] = 0.5 * (F33 * F33 - 1.0)
    pressure = p.lam * (new.strain[0, 0] + new.strain[1, 1] + new.strain[2, 2])
    for i in range(D):
        for j in range(D):
            s = F[i, j] * pressure
            for k in range(D):
                change = new.strain[k, j] - old.strain[k, j]
                s += 2.0 * F[i, k] * (p.mu * new.strain[k, j] + p.eta * rate * change)
            P[i * D + j] = s
    change = new.strain[2, 2] - old.strain[2, 2]
    P[D * D] = F33 * (pressure + 2.0 * (p.mu * new.strain[2, 2] + p.eta * rate * change)) if D == 2 else 0.0


def tangent(p, F, F33, dt, old, new, P, A):
    """A_ijkl = delta_ik S_jl + lam F_ij F_kl + m (F_il F_kj + (F F^T)_ik delta_jl), m = mu + eta / dt."""
    stress(p, F, F33, dt, old, new, P)  # fills new, too
    rate, last = 1.0 / dt if dt > 0.0 else 0.0, D * D
    stiff = p.mu + p.eta * rate
    pressure = p.lam * (new.strain[0, 0] + new.strain[1, 1] + new.strain[2, 2])
    for i in range(D):
        for j in range(D):
            for k in range(D):
                b = 0.0
                for m in range(D):
                    b += F[i, m] * F[k, m]
                for n in range(D):
                    a = p.lam * F[i, j] * F[k, n] + stiff * F[i, n] * F[k, j]
                    if j == n:
                        a += stiff * b
                    if i == k:
                        change = new.strain[j, n] - old.strain[j, n]
                        a += 2.0 * (p.mu * new.strain[j, n] + p.eta * rate * change)
                        if j == n:
                            a += pressure
                    A[i * D + j, k * D + n] = a
            A[i * D + j, last] = A[last, i * D + j] = p.lam * F[i, j] * F33
    change = new.strain[2, 2] - old.strain[2, 2]
    A[last, last] = (pressure + 2.0 * (p.mu * new.strain[2, 2] + p.eta * rate * change)
                     + (p.lam + 2.0 * stiff) * F33 * F33)


def energy(p, F, F33, old):
    """W = lam tr(E)^2 / 2 + mu E:E [J/m^3]; at the end of a step the state has its strain."""
    trace = square = 0.5 * (F33 * F33 - 1.0)
    square *= square
    for i in range(D):
        for j in range(D):
            s = -1.0 if i == j else 0.0
            for k in range(D):
                s += F[k, i] * F[k, j]
            square += 0.25 * s * s
            if i == j:
                trace += 0.5 * s
    return 0.5 * p.lam * trace * trace + p.mu * square


def damped(E: float, nu: float, eta: float) -> Law:
    """Rubber with Young's modulus E [Pa], Poisson's ratio nu and viscosity eta [Pa s]."""
    params = Params(*lame(E, nu), check.not_negative("eta", eta, "Pa s"))
    return Law("damped", params, STATE, stress, tangent, energy)


# ---------------------------------------------------------------- the scene


@case
def main(
    E: float = 2.5e5,  # Young's modulus of the layer [Pa]
    nu: float = 0.25,  # its Poisson's ratio [-]
    eta: float = 1000.0,  # its viscosity [Pa s]
    height: float = 1.0,  # of the layer [m]
    h: float = 0.1,  # size of the background cells [m]
    steps: Steps = Steps(dt=2e-3, t_end=0.8),
    output: Output = Output("out/own_law"),
) -> Run:
    """How fast the swaying of a layer dies down."""
    box = Box((0.0, 0.0), (h, height))
    sway = lambda x: np.column_stack([0.01 * np.sin(0.5 * np.pi * x[:, 1] / height), np.zeros(len(x))])
    body = Body(box, Grid.counts(box.size, h), 2, damped(E, nu, eta), 1000.0, velocity=sway)
    room = Box((-h, 0.0), (2.0 * h, height + h))
    supports = [Support(lambda x: x[:, 1] < 1e-9, "x"), Support(lambda x: x[:, 1] > -1.0, "y")]
    solid = MPM(Grid(room, Grid.counts(room.size, h)), body, supports)
    top = int(np.argmax(solid.points.x[:, 1]))
    start = solid.points.x[top, 0]
    columns = {"sway": ("m", "displacement of the top", lambda w: solid.points.x[top, 0] - start)}
    return Run("own_law", solid, None, steps, output, columns=columns)


if __name__ == "__main__":
    main.run()
