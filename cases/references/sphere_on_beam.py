"""A run of a sphere on a beam beside the theory of ``beam_theory``: columns of the history, errors, the
paper's figure 7."""
from pathlib import Path
from typing import Dict, List

import numpy as np
from mpi4py import MPI

from coupling import History, linear
from coupling.pictures import figure
from coupling.records import report
from dem_liggghts import Spheres
from mpm_fenicsx import Interface
from references.beam_theory import ImpactHistory, contacts

NAMES = {"liggghts": "LIGGGHTS", "reference": "built-in DEM"}


class Comparison:
    """Of a coupled run whose interface has a point or an element under the ``ball``.

    theory: ``beam_theory.ImpactHistory``, whose contact starts after ``wait`` [s]; interface: of the beam;
    ball: its ``Spheres`` at the start.
    """

    def __init__(self, theory: ImpactHistory, interface: Interface, ball: Spheres, wait: float = 0.0) -> None:
        self._theory, self._wait = theory, wait
        place = np.zeros((1, ball.dim))
        place[0, 0] = ball.x[0, 0]
        struck = linear(interface.x, interface.elements, place, MPI.COMM_SELF)
        where = self._where = "at midspan" if place[0, 0] == 0 else "under the sphere"
        self.columns = {"force": ("N", "force on the sphere, mean over the window",
                                  lambda w: 0 - w.wall_force[:, 1].sum()),
                        "u_beam": ("m", f"upward displacement of the beam's upper side {where}",
                                   lambda w: struck.motion(w.x, w.v)[0][0, 1]),
                        "u_sphere": ("m", "upward displacement of the sphere",
                                     lambda w: w.particles["x"][0, 1] - ball.x[0, 1]),
                        "v_sphere": ("m/s", "upward velocity of the sphere",
                                     lambda w: w.particles["v"][0, 1])}

    def errors(self, histories: Dict[str, History]) -> Dict[str, float]:
        """Errors of the last of ``histories`` against the theory, and the largest difference in force between
        back ends. The force is the mean over a window: it belongs to the window's middle."""
        *others, history = histories.values()
        at_end, at_middle = (self._theory.at(np.maximum(history["time"] - self._wait - lag, 0.0))
                             for lag in (0.0, history["window"] / 2))
        errors = {"force": report.relative_l2(history["force"], at_middle.force, history["window"]),
                  "u_beam": report.relative_l2(history["u_beam"], at_end.u_beam, history["window"]),
                  "v_sphere_end": abs(history["v_sphere"][-1] / at_end.v_sphere[-1] - 1)}
        for other in others:
            errors["back_ends"] = abs(other["force"] - history["force"]).max() / abs(history["force"]).max()
        return {name: float(error) for name, error in errors.items()}

    def errors_of_contacts(self, histories: Dict[str, History]) -> Dict[str, float]:
        """``errors``, and the number of contacts too many; start, end and peak of each contact, relative
        (start of the first: as part of its duration)."""
        *_, history = histories.values()
        errors, ours, theirs = self.errors(histories), contacts(history["time"],
                                                                history["force"]), self._theory.contacts()
        errors["contacts"] = float(len(ours) - len(theirs))
        for number, (own, other) in enumerate(zip(ours, theirs), 1):
            errors |= {f"start_{number}": abs(own.start - other.start) / (other.start or other.end),
                       f"end_{number}": abs(own.end / other.end - 1),
                       f"peak_{number}": abs(own.peak / other.peak - 1)}
        return errors

    def figure(self, path: Path, histories: Dict[str, History]) -> None:
        """The paper's figure 7: displacements and contact force over time."""
        displacement: List[tuple] = []
        force: List[tuple] = []
        *_, last = histories
        for backend, history in histories.items():
            t, style = 1e3 * history["time"], "run" if backend == last else "under"
            displacement += [(t, 1e6 * history["u_beam"], f"beam {self._where}, {NAMES[backend]}", style),
                             (t, 1e6 * history["u_sphere"], f"sphere, {NAMES[backend]}", style)]
            force.append((t, history["force"], f"contact, {NAMES[backend]}", style))
        theory, wait = self._theory, self._wait
        t, gap = 1e3 * (theory.time + wait), wait * abs(theory.v_sphere[0])
        displacement += [(t, 1e6 * theory.u_beam, "Timoshenko beam", "reference"),
                         (t, 1e6 * (theory.u_sphere - gap), None, "reference")]
        force.append((t, theory.force, "Timoshenko beam", "reference"))
        figure.draw(path, "time [ms]", {"upward displacement [µm]": displacement, "contact force [N]": force})
