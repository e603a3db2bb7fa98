"""What a model says of itself in numbers: energy, momentum, who has changed them."""
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np

from .collective import total
from .laws import ELASTIC_STATE
from .points.moments import moment
from .terms.scene_penalties import reaction


class Accounts:
    """Energy, momentum and forces of a ``Model``, its part that others ask. Collective."""

    comm: Any
    dim: int
    scene: Any
    penalties: tuple
    loads: tuple
    gravity: np.ndarray
    _bodies: list
    _contacts: tuple
    _behind: Any
    _ladder: Any
    _losses: Any
    _impulses: Any
    _works: Any
    _feeds: Any
    _outlets: Any
    _on_bodies: Any
    origin: Any

    def energy(self) -> Dict[str, float]:
        """``kinetic``, ``strain`` and ``potential`` (zero at ``origin``) energy of the points [J]."""
        sums = np.sum([body.energies(self.gravity) for body in self._bodies], axis=0)
        return dict(zip(("kinetic", "strain", "potential"), total(self.comm, sums).tolist()))

    def momentum(self) -> np.ndarray:
        """Momentum of the points [kg m/s], shape (dim,)."""
        return self.momenta()[:self.dim]

    def angular_momentum(self) -> Union[float, np.ndarray]:
        """Of the points about zero [kg m^2/s], a number in a plane scene (counter-clockwise), else (3,);
        with APIC and TPIC it has that of the velocity around the points."""
        angular = self.momenta()[self.dim:]
        return float(angular[0]) if self.dim == 2 else angular

    def momenta(self) -> np.ndarray:
        """``momentum`` followed by ``angular_momentum``, shape (3,) in a plane scene, else (6,)."""
        found = self._impulses.now(self._bodies)
        if self.origin.any():
            found[self.dim:] += moment(self.origin[None], found[None, :self.dim])
        return found

    @property
    def transfer_losses(self) -> Optional[dict]:
        """What the transfers have added since the start where ``Numerics.losses`` asks for it, see
        ``losses.Losses.sums``."""
        return self._losses.sums() if self._losses.active else None

    def reaction(self, name: str) -> np.ndarray:
        """Force of the penalties of that name on the body over the last step [N], shape (dim,)."""
        last = total(self.comm, reaction(self.penalties, self._contacts, name))
        return self._ladder.reaction(name, last)

    def impulses(self) -> Dict[str, np.ndarray]:
        """Impulse since the start by the name of what has given it to the material points: linear [N s],
        (dim,), then angular about zero [N m s], one number in a plane scene, else three, see
        ``solve.impulses``. With "outflow", what has left, they sum to the change of ``momentum`` and
        ``angular_momentum``."""
        return self._impulses.sums()

    def impulses_on_bodies(self) -> Dict[str, Dict[str, np.ndarray]]:
        """Impulse since the start on each force cell of the named bodies, by its name and by what acts: other
        "bodies", the "interface"; rows as of ``impulses``, see ``solve.on_bodies``."""
        return self._on_bodies.sums()

    def works(self) -> Dict[str, float]:
        """Work on the bodies since the start and what friction and plastic flow have taken [J], see
        ``solve.works``, and what is stored now in ``springs``."""
        found = self._works.sums()
        stored, flowed = total(self.comm, [
            sum(term.stored() for term in (*self.penalties, *self._contacts)),
            sum(body.plastic_work() for body in self._bodies)])
        let_go = found["springs"] - float(stored)  # by springs that did not come back with it
        return {**found, "plastic": found["plastic"] + float(flowed), "hits": found["hits"] + let_go,
                "springs": float(stored)}

    def book_works(self) -> None:
        """From now on steps say what the scheme takes by its causes, see ``solve.works``."""
        self._works.booked = True
        for body in self._bodies:
            body.booked = True

    @property
    def base_work(self) -> float:
        """Work that the motion of the base has done on the bodies since the start [J], in its frame."""
        return self._works.of_base

    @property
    def applied(self) -> np.ndarray:
        """Sum of the interface forces that reached the nodes in the last step [N], shape (dim,)."""
        return self._ladder.applied(self.step.problem.interface.applied)

    @property
    def structures(self) -> tuple:
        """``Structure`` records of the scene, in the user's coordinates."""
        return self.scene.structures

    @property
    def flows(self) -> bool:
        """Whether a body has a law with plastic flow or another state."""
        return any(body.law.state != ELASTIC_STATE for body in self.scene.bodies)

    @property
    def regions(self) -> List[str]:
        """Names in ``impulses`` of what the bodies meet: supports, walls and cells of structures."""
        return self._impulses.regions

    @property
    def driven(self) -> bool:
        """Whether motions, loads or body forces do work on the bodies, besides gravity and the interface."""
        stated = [*self.scene.supports, *self.scene.walls]
        moved = any(getattr(one, "motion", None) is not None for one in stated)
        return bool(self.loads or self._feeds or self.scene.base or self._bodies[0].has_body_force or moved)

    @property
    def springs(self) -> bool:
        """Whether there are any, which store energy that ``energy`` does not count."""
        return bool(self.penalties or self._contacts)

    def behind(self) -> Dict[str, int]:
        """Material points that have gone through walls and not come back, as name of the wall → number."""
        counts = {} if self._behind is None else zip(self._behind.names, self._behind.counts().tolist())
        return {name: count for name, count in sorted(counts)} if counts else {}

    def columns(self) -> Dict[str, Tuple[str, str, Callable]]:
        """What else the history should have, as name → (unit, meaning, function without arguments)."""
        found = {}
        if self._losses.active:
            for k, axis in enumerate("xyz"[-1 if self.dim == 2 else 0:]):
                found[f"angular_momentum_{axis}"] = (
                    "N m s", f"angular momentum of the solid about {axis}",
                    lambda k=k: float(np.ravel(self.angular_momentum())[k]))
            found |= self._losses.columns()
        meetings = [contact for contact in self._contacts if hasattr(contact, "pairs")]
        for name in [name for contact in meetings for name in contact.names]:
            numbers = "_".join(name.replace(",", "").replace(" and", "").split()[1:])
            for k, axis in enumerate("xyz"[:self.dim]):
                found[f"force_bodies_{numbers}_{axis}"] = (
                    "N", f"force along {axis} on the first of {name} by the second in the last step",
                    lambda name=name, k=k: float(self.reaction(name)[k]))
        found |= self._feeds.columns() | self._outlets.columns()
        if self._behind is not None:
            meaning = "material points that have gone through a wall"
            found["behind"] = ("1", meaning, lambda: sum(self.behind().values()))
        return found
