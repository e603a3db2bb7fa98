"""Ledger of impulse and energy over the interface, window by window."""
import numpy as np

COLUMNS = {
    "impulse_grains": ("N s", "vertical impulse of the interface on the particles since the start: their change of "
                              "momentum less gravity's share"),
    "impulse_solid": ("N s", "vertical impulse of the interface on the solid's grid nodes since the start; the sum "
                             "with impulse_grains is round-off, unless particles touch what is at rest"),
    "work_wall": ("J", "work of the exchanged force on the wall since the start, in windows and jumps between them"),
    "work_solid": ("J", "work of the exchanged force along the path of the interface, since the start"),
    "energy_grains": ("J", "energy of the particles and their contacts"),
    "energy_solid": ("J", "energy of the solid"),
    "interface_error": ("1", "energy that the staggered scheme has made at the interface, work_solid - work_wall, "
                             "relative to the largest energy so far"),
    "energy_error": ("1", "change of the total energy, relative to the largest energy so far; of a closed system "
                          "without damping, friction and moving supports: the error"),
}

MADE = 0.25  # energy out of nothing, relative to the largest so far, beyond which a closed system is stopped


class Unstable(RuntimeError):
    """A closed system has gained energy."""


class Ledger:
    """Books what the interface exchanges; call it with each ``Window``. The entries are those of ``COLUMNS``.

    gravity: vertical (last) component of gravity on the particles [m/s^2]; it does not pull clusters that are held up.
    """

    def __init__(self, solid, grains, gravity=0.0):
        self._solid, self._grains = solid, grains
        self._up = solid.surface()[0].shape[1] - 1
        particles = grains.particles()
        self._clusters = getattr(getattr(grains, "scene", None), "clusters", ())
        self._single = particles["body"] == 0 if self._clusters else slice(None)
        self._momentum = self._momentum_of(particles)
        falls = particles["mass"][self._single].sum() + sum(c.mass for c in self._clusters if c.flags[self._up])
        self._weight, self._begin = gravity * falls, solid.time
        self._last = None
        self._impulse = self._work_wall = self._work_solid = 0.0
        parts = self._energies()
        self._start, self._scale = sum(parts), max(map(abs, parts))

    def _momentum_of(self, particles):
        """Vertical momentum [kg m/s]. That of a cluster is its mass times the velocity of its centre of mass: the
        shares of its spheres have the same sum only where their own centre is there, too."""
        single = particles[self._single]
        momentum = float(single["mass"] @ single["v"][:, self._up])
        if self._clusters:
            bodies = self._grains.bodies()
            momentum += float(bodies["mass"] @ bodies["v"][:, self._up])
        return momentum

    def _energies(self):
        return sum(self._grains.energy().values()), sum(self._solid.energy().values())

    def _on_wall(self, window):
        """Work in the window, and in the jump before it from where the wall was carried to where the interface went,
        under the mean of the forces on both sides of it; points that are new have jumped as their neighbours."""
        work, last, self._last = window.dt * float(np.vdot(window.wall_force, window.wall_v)), self._last, window
        if last is not None:
            if window.resampled is None:
                jump = before = window.wall_x - last.wall_x - last.dt * last.wall_v
            else:
                before = last.x - last.wall_x - last.dt * last.wall_v
                jump = window.resampled.carry(before)
            work += 0.5 * float(np.vdot(last.wall_force, before) + np.vdot(window.wall_force, jump))
        return work

    def __call__(self, window):
        """Entries after this window, name → number."""
        self._impulse += float(self._solid.applied[self._up]) * window.dt
        self._work_wall += self._on_wall(window)
        self._work_solid += float(np.vdot(window.force, window.moved))
        grains, solid = self._energies()
        self._scale = max(self._scale, abs(grains), abs(solid))
        scale = self._scale or 1.0  # nothing has moved yet
        gained = self._momentum_of(window.particles) - self._momentum - self._weight * (window.time - self._begin)
        return {"impulse_grains": gained, "impulse_solid": self._impulse, "work_wall": self._work_wall,
                "work_solid": self._work_solid, "energy_grains": grains, "energy_solid": solid,
                "interface_error": (self._work_solid - self._work_wall) / scale,
                "energy_error": (grains + solid - self._start) / scale}


def check_closed(entries, time):
    """Raise Unstable when a ledger's ``entries`` at ``time`` [s] show more energy than a closed system can have."""
    total, interface = entries["energy_error"], entries["interface_error"]
    if max(total, interface) > MADE:
        raise Unstable(f"the coupled run has gained energy until t = {time:.6g} s, {total:.0%} of the largest so far, "
                       f"{interface:.0%} at the interface: it is unstable or far too coarse, repeat the windows "
                       "(iterate=20) or take a smaller dt, 10 or more to a contact")
