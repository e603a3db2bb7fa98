"""Ledger of impulse and energy over the interface, window by window."""
import numpy as np

UNITS = {"impulse_grains": "N s", "impulse_solid": "N s", "work_wall": "J", "work_solid": "J", "energy_grains": "J",
         "energy_solid": "J", "energy_error": "1"}


class Ledger:
    """Books what the interface exchanges. Every entry is since the start.

    impulse_grains, impulse_solid: impulse [N s] on the particles (their change of momentum less gravity's share) and on
    the solid's nodes, component ``axis``; their sum is round-off. work_wall, work_solid: work [J] of the exchanged force
    on the wall as the DEM moved it and on the interface as it then moved; the difference is the energy that the
    staggered scheme makes or loses. energy_grains, energy_solid: energy now [J]. energy_error: change of the total
    energy, relative to its start (of a closed system without damping, friction and moving supports: the error).
    """

    def __init__(self, solid, grains, gravity=0.0, axis=-1):
        """gravity: component ``axis`` of gravity on the particles [m/s^2]."""
        self._solid, self._grains, self._axis = solid, grains, axis
        particles = grains.particles()
        self._mass = particles["mass"]
        self._component = axis % solid.surface()[0].shape[1]
        self._momentum = self._momentum_of(particles)
        self._weight = gravity * self._mass.sum()
        self._solid_impulse = np.zeros(solid.surface()[0].shape[1])
        self._work_wall = self._work_solid = 0.0
        self._start = self._total()
        self._scale = max(abs(part) for part in (*self._parts(), 1e-300))

    def _momentum_of(self, particles):
        return float(self._mass @ particles["v"][:, self._component])

    def _parts(self):
        return sum(self._grains.energy().values()), sum(self._solid.energy().values())

    def _total(self):
        return sum(self._parts())

    def __call__(self, window):
        """Entries after this window, name → number."""
        self._solid_impulse += self._solid.applied * window.dt
        self._work_wall += window.dt * float(np.vdot(window.wall_force, window.wall_v))
        self._work_solid += float(np.vdot(window.force, window.moved))
        grains, solid = self._parts()
        gained = self._momentum_of(self._grains.particles()) - self._momentum - self._weight * window.time
        return {"impulse_grains": gained, "impulse_solid": float(self._solid_impulse[self._component]),
                "work_wall": self._work_wall, "work_solid": self._work_solid, "energy_grains": grains,
                "energy_solid": solid, "energy_error": (grains + solid - self._start) / self._scale}
