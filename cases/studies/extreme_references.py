"""What must come out of the scenes of ``extreme.py``, and how far a run is from it."""
from dataclasses import replace
from typing import Any, Callable, Optional, Tuple

import numpy as np

from coupling import History
from coupling.ledger import exchange
from coupling.records import report
from references import beam_theory
from studies.extreme_keys import ALONE, Extreme


def twin(p: Extreme) -> Optional[Extreme]:
    """A run to compare with: the same in SI units, without flight, on a rigid base instead of a stiff one;
    None when there is nothing to compare with. p: ``Extreme`` as it is given."""
    if tuple(p.unit) != (1.0, 1.0, 1.0):
        return replace(p, unit=(1.0, 1.0, 1.0))
    if p.scene == "flight" and p.ball.v0:
        return replace(p, block=replace(p.block, fly=0.0))
    if p.scene == "layers" and p.block.contrast < 1:
        return replace(p, scene="block")
    return None


def timed(p: Extreme) -> Extreme:
    """The same with the length of its windows. ValueError for a sphere that misses the body. p: in SI
    units."""
    if p.scene not in (*ALONE, "rest") and not approach(p) > 0:
        raise ValueError(f"angle is {p.ball.angle} degrees: at={p.ball.at[0]:g} is beyond an edge, and the "
                         "sphere flies past, give another one")
    if p.windows.dt is not None:
        return p
    E, nu, rho = p.block.E, p.block.nu, p.block.rho
    wave = np.sqrt(E * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * rho))
    cfl = p.windows.cfl
    dt = cfl * p.resolution.h / wave if cfl else contact_time(p) / p.windows.per_contact
    return replace(p, windows=replace(p.windows, dt=dt))


def effective_mass(p: Extreme) -> tuple:
    """Mass [kg] that the contact feels, of sphere and body, rigid as they are; and the direction of its
    force."""
    if p.scene not in ("free", "layers") or p.block.contrast < 1:
        return p.ball_mass, (0.0, 1.0)
    x = p.ball.at[0]
    beyond = np.sign(x) * max(abs(x) - p.block.length / 2, 0.0)
    n = np.array([beyond, np.sqrt(p.ball.radius**2 - beyond**2)]) / p.ball.radius
    arm = np.array([x - beyond, p.block.height / 2])
    size = p.block.length**2 + p.block.height**2
    turning = 0.0 if len(p.ball.at) > 1 else (arm[0] * n[1] - arm[1] * n[0]) ** 2 * 12 / size
    return 1 / (1 / p.ball_mass + (len(p.ball.at) + turning) / p.block.mass), n


def approach(p: Extreme) -> float:
    """Speed at which sphere and body come closer [m/s]."""
    n = effective_mass(p)[1]
    return p.ball.v0 * (np.cos(np.radians(p.ball.angle)) * n[1] - np.sin(np.radians(p.ball.angle)) * n[0])


def contact_time(p: Extreme) -> float:
    """Of a Hertz contact (Johnson, Contact Mechanics, 1985, section 11.4); of an oscillation about rest under
    gravity for a sphere that lies [s]."""
    if p.scene == "rest":
        sag = (p.ball_mass * p.ball.gravity / p.stiffness) ** (2 / 3)
        return 2 * np.pi * np.sqrt(p.ball_mass / (1.5 * p.stiffness * np.sqrt(sag)))
    mass, v = effective_mass(p)[0], approach(p)
    return 2.943 * (1.25 * mass * v**2 / p.stiffness) ** 0.4 / v


def peak_force(p: Extreme) -> float:
    """Of a Hertz contact [N]."""
    return p.stiffness * (1.25 * effective_mass(p)[0] * approach(p) ** 2 / p.stiffness) ** 0.6


def first_mode(p: Extreme) -> float:
    """Angular frequency of the beam's first mode [rad/s]."""
    block = p.block
    return beam_theory.beam_modes(block.length, block.height, block.width, *moduli(p), block.rho, modes=1,
                               shear=shear(p))[0][0]


def moduli(p: Extreme) -> Tuple[float, float]:
    """E and nu of a beam in plane stress that bends as the body."""
    E, nu = p.block.E, p.block.nu
    return (E, nu) if p.dim == 3 or p.block.plane == "stress" else (E / (1 - nu**2), 0.0)


def shear(p: Extreme) -> float:
    """Shear correction that goes with ``moduli``: the shear modulus is the same in both plane states."""
    E, nu = moduli(p)
    return 5 / 6 * (p.block.E / (1 + p.block.nu)) / (E / (1 + nu))


def start(p: Extreme) -> Callable[[np.ndarray], np.ndarray]:
    """Velocity of the body at the start [m/s] as a function of position."""
    along = np.pi / p.block.length

    def velocity(x: np.ndarray) -> np.ndarray:
        v = np.zeros_like(x)
        v[:, 0] = p.block.fly
        if p.scene == "swing":
            v[:, 1] = p.ball.v0 * np.cos(along * x[:, 0])
            v[:, 0] += p.ball.v0 * along * (x[:, 1] + p.block.height / 2) * np.sin(along * x[:, 0])
        elif p.scene == "flight":
            v[:, 0] += p.ball.v0 * np.sin(along * x[:, 0])
        return v

    return velocity


def columns(p: Extreme, solid: Any) -> dict:
    """Of history.csv, see ``Record``."""
    middle = np.argmin((solid.interface.x ** 2).sum(axis=1))
    first = {"u_beam": ("m", "upward displacement of the middle of the upper side",
                        lambda w: w.x[middle, 1] - solid.interface.x[middle, 1]),
             "vx_beam": ("m/s", "velocity along the grid of the left end of the upper side",
                         lambda w: w.v[0, 0]),
             "momentum_x": ("kg m/s", "of the body", lambda w: solid.momentum()[0]),
             "momentum_y": ("kg m/s", "of the body", lambda w: solid.momentum()[1])}
    if p.scene in ("swing", "flight"):
        return first
    return {"force": ("N", "upward force on the spheres, mean over the window",
                      lambda w: 0 - w.wall_force[:, 1].sum()),
            "y_sphere": ("m", "height of the first sphere", lambda w: w.particles["x"][0, 1]),
            "vx_sphere": ("m/s", "its velocity along the grid", lambda w: w.particles["v"][0, 0]),
            "v_sphere": ("m/s", "its upward velocity", lambda w: w.particles["v"][0, 1]),
            "spin": ("rad/s", "its spin", lambda w: w.particles["omega"][0, 2]), **first}


def errors(p: Extreme, history: History, against: Optional[Tuple[Extreme, History]]) -> dict:
    """Name → number. against: (its parameters, its history) of the ``twin``, or None."""
    found = {"energy_gain": max(float(history["energy_error"].max()), 0.0)}
    if p.scene not in ("swing", "flight"):
        found["impulse"] = exchange.impulse_error(history)
    if against:
        found |= difference(p, history, *against)
    own = {"beam": of_beam, "block": of_block, "free": of_collision, "layers": of_collision, "rest": of_rest,
           "swing": of_swing, "flight": of_flight}[p.scene]
    return found | {name: float(value) for name, value in own(p, history).items()}


def difference(p: Extreme, history: History, q: Extreme, other: History) -> dict:
    """Of two histories, each in units of its own scene, relative to the largest value."""
    speeds = ("vx_beam",) if p.scene == "flight" else ("v_sphere",)
    pairs = [((history[n] - p.block.fly) / p.ball.v0, (other[n] - q.block.fly) / q.ball.v0) for n in speeds]
    if p.scene != "flight":
        pairs.append((history["force"] / peak_force(p), other["force"] / peak_force(q)))
    name = {"flight": "crossing", "layers": "against_fixed"}.get(p.scene, "scaling")
    if name == "crossing":  # noise spreads over the run: its mean
        return {name: report.relative_l2(*pairs[0])}
    return {name: max(float(np.abs(a - b).max() / (np.abs(b).max() or 1.0)) for a, b in pairs)}


def of_beam(p: Extreme, history: History) -> dict:
    """Timoshenko beam with Hertz contact."""
    E, nu = moduli(p)
    end = p.windows.windows * p.dt
    known = beam_theory.impact(p.block.length, p.block.height, p.block.width, p.ball.radius, p.ball.v0, E, nu,
                               p.block.rho, end, shear=shear(p), sphere=(p.E_ball, p.block.nu, p.density))
    lengths = history["window"]
    at_end, at_middle = (known.at(np.clip(history["time"] - lag, 0.0, end)) for lag in (0.0, lengths / 2))
    return {"force": report.relative_l2(history["force"], at_middle.force, lengths),
            "u_beam": report.relative_l2(history["u_beam"], at_end.u_beam, lengths),
            "v_end": abs(history["v_sphere"][-1] - at_end.v_sphere[-1]) / p.ball.v0}


def of_block(p: Extreme, history: History) -> dict:
    """Hertz on a rigid plane, and flight in between. Oblique: what the force can do, it does at the point of
    contact, about which the sphere keeps its angular momentum; when it slides, it does the friction's
    share."""
    ball, angle = p.ball, np.radians(p.ball.angle)
    down, along = ball.v0 * np.cos(angle), ball.v0 * np.sin(angle)
    found = {"rebound": abs(history["v_sphere"][-1] - ball.restitution * down) / ball.v0}
    if ball.restitution == 1.0:
        found["peak"] = abs(history["force"].max() / peak_force(p) - 1)
    if ball.gravity:
        found = {"again": bounces(p, history)}
    if ball.angle:
        vx, spin = history["vx_sphere"][-1], history["spin"][-1]
        found["angular"] = abs(vx - 0.4 * ball.radius * spin - along) / ball.v0
        sliding = along - ball.friction * (1 + ball.restitution) * down
        if 2 / 7 * along < sliding:  # slides to the end
            found["sliding"] = abs(history["vx_sphere"][-1] - sliding) / ball.v0
    return found


def bounces(p: Extreme, history: History) -> float:
    """Largest error in the start of a contact, relative to the time from one to the next."""
    contact = contact_time(p)
    period = 2 * p.ball.v0 / p.ball.gravity + contact
    found = [c.start for c in beam_theory.contacts(history["time"], history["force"])]
    expected = p.ball.gap / p.ball.v0 + period * np.arange(len(found))
    missing = abs(len(found) - int((history["time"][-1] - p.ball.gap / p.ball.v0) / period + 1))
    return max(np.abs(np.array(found) - expected).max() / period, missing)


def of_collision(p: Extreme, history: History) -> dict:
    """Rigid bodies, frictionless, free to move and turn: the impulse is (1 + e) times effective mass and
    approach."""
    if p.scene == "layers" and p.block.contrast < 1:
        return {}
    mass, n = effective_mass(p)
    v = np.array([np.sin(np.radians(p.ball.angle)), -np.cos(np.radians(p.ball.angle))]) * p.ball.v0
    v_end = v - (1 + p.ball.restitution) * mass / p.ball_mass * (v @ n) * n
    total = p.ball_mass * len(p.ball.at) * history["v_sphere"] + history["momentum_y"]
    vx, vy = history["vx_sphere"][-1], history["v_sphere"][-1]
    found = {"rebound": np.hypot(vx - v_end[0], vy - v_end[1]) / p.ball.v0}
    if p.scene == "free" and not p.block.fly:
        found["momentum"] = np.abs(total - total[0]).max() / (p.ball_mass * p.ball.v0)
    if p.ball.restitution == 1.0 and n[0] == 0.0:
        found["peak"] = abs(history["force"].max() / len(p.ball.at) / peak_force(p) - 1)
    return found


def of_rest(p: Extreme, history: History) -> dict:
    """The sphere's weight, Hertz' sag, and how much it still moves in the second half."""
    weight, last = p.ball_mass * p.ball.gravity, len(history) // 10
    sag = (weight / p.stiffness) ** (2 / 3)
    y = history["y_sphere"] - p.ball.radius + p.resolution.shift
    half = y[len(y) // 2:len(y) // 2 + last]
    return {"weight": abs(history["force"][-last:].mean() / weight - 1),
            "sag": abs(y[-last:].mean() / sag + 1), "creep": abs(y[-last:].mean() - half.mean()) / sag}


def of_swing(p: Extreme, history: History) -> dict:
    """The first mode, as it is and as Newmark's method makes it: with 2 arctan(omega dt/2) / dt for the
    frequency, at the same amplitude; and the amplitude alone, after half a period."""
    omega = first_mode(p)
    size, t = p.ball.v0 / omega, history["time"]
    slower = 2 * np.arctan(0.5 * omega * p.dt) / p.dt
    found = {"exact": report.relative_l2(history["u_beam"], size * np.sin(omega * t)),
             "newmark": report.relative_l2(history["u_beam"], size * np.sin(slower * t))}
    if slower * t[-1] > np.pi:
        found["amplitude"] = abs(np.abs(history["u_beam"]).max() / size - 1)
    return found


def of_flight(p: Extreme, history: History) -> dict:
    """The body keeps its momentum and its energy; without vibration it moves as a rigid one."""
    lost = np.abs(history["energy_error"]).max()
    found = {"energy": lost}
    if p.block.fly:
        found["momentum"] = np.abs(history["momentum_x"] / (p.block.mass * p.block.fly) - 1).max()
        if not p.ball.v0:
            found["noise"] = np.abs(history["vx_beam"] / p.block.fly - 1).max()
    return found
