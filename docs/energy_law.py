"""A law stated as an energy in a scene of one's own: a layer of Mooney-Rivlin rubber sways on its base.

    python energy_law.py               a few seconds; --help shows all keys
    python energy_law.py c2=4e4        another modulus, nothing is compiled
"""
import numpy as np
from ufl import det, tr

from coupling import Output, Run, Steps, case
from mpm_fenicsx import MPM, Body, Box, Grid, Law, Support, from_energy

# ---------------------------------------------------------------- the law


def mooney_rivlin(F, c1, c2, K):
    """W = c1 (I1 J^(-2/3) - 3) + c2 (I2 J^(-4/3) - 3) + K (J - 1)^2 / 2 [J/m^3], in UFL."""
    J, C = det(F), F.T * F
    I1 = tr(C)
    I2 = (I1**2 - tr(C * C)) / 2
    return c1 * (J ** (-2 / 3) * I1 - 3) + c2 * (J ** (-4 / 3) * I2 - 3) + K / 2 * (J - 1) ** 2


def rubber(c1: float, c2: float, K: float) -> Law:
    """Mooney-Rivlin rubber with constants c1 and c2 [Pa], of which twice the sum is the shear modulus, and
    bulk modulus K [Pa]."""
    return from_energy(mooney_rivlin, c1=c1, c2=c2, K=K)


# ---------------------------------------------------------------- the scene


@case
def main(
    c1: float = 4e4,  # of the energy [Pa]
    c2: float = 1e4,  # of the energy [Pa]
    K: float = 5e5,  # bulk modulus [Pa]
    far: float = 0.1,  # how far the top sways, of the height [-]
    height: float = 1.0,  # of the layer [m]
    h: float = 0.1,  # size of the background cells [m]
    steps: Steps = Steps(dt=2e-3, t_end=0.4),
    output: Output = Output("out/energy_law"),
) -> Run:
    """How a layer of rubber sways on a base that is held; nothing moves up or down."""
    box, rho = Box((0.0, 0.0), (h, height)), 1000.0
    k = 0.5 * np.pi / height
    speed = far * height * k * np.sqrt(2.0 * (c1 + c2) / rho)
    sway = lambda x: np.column_stack([speed * np.sin(k * x[:, 1]), np.zeros(len(x))])
    body = Body(box, Grid.counts(box.size, h), 2, rubber(c1, c2, K), rho, velocity=sway)
    room = Box((-height, 0.0), (height + h, height + h))
    supports = [Support(lambda x: x[:, 1] < 1e-9, "x"), Support(lambda x: x[:, 1] > -1.0, "y")]
    solid = MPM(Grid(room, Grid.counts(room.size, h)), body, supports)
    columns = {"speed": ("m/s", "mean velocity", lambda w: solid.momentum()[0] / (rho * h * height)),
               "strain": ("J", "strain energy", lambda w: solid.energy()["strain"])}
    return Run("energy_law", solid, None, steps, output, columns=columns)


if __name__ == "__main__":
    main.run()
