"""A layer of even depth on a rough incline, so long that nothing from its ends comes to its middle.

There are no periodic grids here; so the layer has a smooth wall at its upper end and none at its lower one,
where material leaves, and is looked at in the middle until what happens at the ends arrives. Cells are long
along the slope, as nothing changes along it.
Axes: x down the slope, y across it, depth H from the bed y = 0.
"""
import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import diags

from mpm_fenicsx import MPM, Body, Box, Grid, Numerics, Support, at_rest

G = 9.81


def pull(slope):
    """Gravity [m/s^2] on a slope [degrees]."""
    return G * np.array([np.sin(np.radians(slope)), -np.cos(np.radians(slope))])


def layer(law, rho, depth, length, slope, cells, points=2, velocity=0.0, **numerics):
    """MPM of a layer of ``cells`` (along, across), with the stress of its weight and shear at the start."""
    along, across = cells
    h, gravity = depth / across, pull(slope)
    body = Body(Box((0.0, 0.0), (length, depth)), cells, points, law, rho, velocity=velocity,
                stress=at_rest(depth, rho, gravity, 1.0))
    held = [Support(lambda x: x[:, 1] < 1e-9, "xy", name="bed"),
            Support(lambda x: x[:, 0] < 1e-9, "x", name="upper end")]
    return MPM(Grid(Box((0.0, 0.0), (length, depth + 3 * h)), (along, across + 3)), body, held,
               gravity=gravity, inertia="lumped", outflow={"+x": "remove"},
               numerics=Numerics(**{"basis": "gimp", **numerics}))


def profile(solid, length, depth, across):
    """Heights y [m] and velocities down the slope [m/s] in the middle sixth: means over the layers of points,
    two in each of the cells ``across``."""
    x, v = solid.points.x, solid.points.v
    here = abs(x[:, 0] - 0.5 * length) < length / 12
    layer_of = np.minimum(x[here, 1] / depth * 2 * across, 2 * across - 0.5).astype(int)
    return [np.bincount(layer_of, values) / np.bincount(layer_of) for values in (x[here, 1], v[here, 0])]


def difference(y, v, expected):
    """Relative L2 difference of velocities v at y from ``expected(y)``."""
    return np.linalg.norm(v - expected(y)) / np.linalg.norm(expected(y))


def bingham(depth, rho, slope, yield_stress, viscosity):
    """Velocity [m/s] of Bingham's fluid on a slope as a function of y [m], and the depth of its plug [m].

    Below the plug the shear stress rho g sin(s) (H - y) exceeds tau_y (Bird, Dai & Yarusso 1983).
    """
    stress = rho * pull(slope)[0]
    plug = yield_stress / stress
    sheared = depth - plug
    return (lambda y: stress / (2 * viscosity) * (sheared**2 - np.maximum(sheared - y, 0.0) ** 2)), plug


def bagnold(depth, rho, slope, mu_s, mu_2, I_0, grain_diameter, grain_density):  # noqa: PLR0913
    """Velocity [m/s] of a mu(I) layer on a slope as a function of y [m]: mu(I) = tan(s) everywhere, so that
    the rate grows as the root of the pressure (Jop, Forterre & Pouliquen 2006)."""
    tangent = np.tan(np.radians(slope))
    inertial = I_0 * (tangent - mu_s) / (mu_2 - tangent)
    rate = inertial / grain_diameter * np.sqrt(-rho * pull(slope)[1] / grain_density)
    return lambda y: 2 / 3 * rate * (depth**1.5 - np.maximum(depth - y, 0.0) ** 1.5)


def sheared_in_time(times, start, depth, rho, slope, stress, n=400):
    """Heights y [m], shape (n,), and velocities [m/s] at ``times`` [s], shape (len(times), n), of a layer in
    which only the velocity along the slope changes: rho dv/dt = rho g_x + d tau/dy, tau = stress(rate of
    shear, normal stress). start: velocity [m/s] as a function of y. Finite volumes, scipy's BDF."""
    gravity, edge = pull(slope), np.linspace(0.0, depth, n + 1)
    y, normal, h = 0.5 * (edge[1:] + edge[:-1]), -rho * gravity[1] * (depth - edge), depth / n

    def rise(_, v):
        rate = np.concatenate([[2.0 * v[0] / h], np.diff(v) / h, [0.0]])
        tau = stress(np.maximum(rate[:-1], 0.0), normal[:-1])
        return gravity[0] + np.diff(np.append(tau, 0.0)) / (rho * h)

    near = diags([1.0, 1.0, 1.0], [-1, 0, 1], shape=(n, n))
    return y, solve_ivp(rise, (0.0, max(times)), start(y), "BDF", times, rtol=1e-7, atol=1e-9,
                        jac_sparsity=near).y.T


def grains(shear_modulus, mu_s, mu_2, I_0, grain_diameter, grain_density):  # noqa: PLR0913
    """Shear stress [Pa] of mu(I) as a function of the rate of shear [1/s] and the stress across [Pa]. Elastic
    shear makes a normal stress difference of 2 tau^2 / G, half of it across: P falls by tau^2 / G."""
    def stress(rate, normal):
        tau = mu_s * normal
        for _ in range(6):
            pressure = normal - tau**2 / shear_modulus
            inertial = rate * grain_diameter / np.sqrt(pressure / grain_density)
            tau = (mu_s + (mu_2 - mu_s) * inertial / (I_0 + inertial)) * pressure
        return tau

    return stress


def spreading(times, length, depth, viscosity, room, n=1200, thin=1e-5):  # noqa: PLR0913
    """Front [m] at ``times`` [s] of a block of fluid of kinematic viscosity [m^2/s] that spreads from a wall
    over a rough floor, by lubrication: dh/dt = g / (3 nu) d/dx (h^3 dh/dx) (Huppert 1982), on a film of the
    depth ``thin`` [m] as far as ``room`` [m]. Finite volumes, scipy's BDF."""
    dx = room / n
    x = dx * (np.arange(n) + 0.5)

    def rise(_, h):
        mobile = 0.25 * (h[1:] + h[:-1]) * (h[1:]**2 + h[:-1]**2)  # mean of h^3 between two depths
        flux = G / (3.0 * viscosity) * mobile * np.diff(h) / dx
        return np.diff(np.concatenate([[0.0], flux, [0.0]])) / dx

    near = diags([1.0, 1.0, 1.0], [-1, 0, 1], shape=(n, n))
    depths = solve_ivp(rise, (0.0, max(times)), np.where(x < length, depth, thin), "BDF", times, rtol=1e-6,
                       atol=1e-9, jac_sparsity=near).y
    return np.array([x[np.flatnonzero(h > 2.0 * thin)[-1]] + 0.5 * dx for h in depths.T])
