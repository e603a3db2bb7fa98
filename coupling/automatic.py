"""The window that a run chooses by itself: the longest one that its contacts and its motion bear."""
import math
from dataclasses import replace
from typing import Any, Dict, Optional

import numpy as np
from mpi4py import MPI

from .records.writing import tell
from .scheme import Scheme, Steps

COURANT = 0.5  # cells a point may cross per step where nothing is said


def choose_window(scheme: Steps, solid: Any, grains: Optional[Any]) -> Steps:
    """The ``scheme`` with its window, and as many DEM steps as the grains need in it, when its dt is None:
    the smallest of

        weak coupling    what the contact of the grains with the interface bears, unless windows are repeated
        points           ``courant`` cells (a half) at the expected speed: ``speed``, else that of a fall from
                         the highest place of the solid to the lowest one of its grid
        waves            ``waves`` cells at the speed of elastic waves, where asked for

    and a whole part of the run. One line tells which; ``Run`` calls it before it begins. solid: an `MPM`, or
    what has its ``contact_scales()`` and ``resolution()``; grains: a `Scene`, with ``contact_rule``. Raises
    ValueError when nothing limits the window. Collective.
    """
    if scheme.dt is not None:
        return scheme
    scales, size = solid.contact_scales(), min(solid.resolution()["cell_size"])
    courant, limits = COURANT if scheme.courant is None else scheme.courant, {}
    speed = scales.speed if scheme.speed is None else scheme.speed
    if speed > 0.0:
        limits[f"points at {speed:.3g} m/s cross {courant:g} of a cell in"] = courant * size / speed
    if scheme.waves is not None and scales.wave > 0.0:
        limits[f"waves cross {scheme.waves:g} of a cell in"] = scheme.waves * size / scales.wave
    rule = grains.contact_rule(scales, speed) if grains is not None else None
    weak = not getattr(scheme, "iterate", 0)
    if rule is not None and weak and rule.window < np.inf:
        limits["weak coupling bears"] = rule.window
    if not limits:
        raise ValueError("dt is none, and nothing limits the window: no speed, no gravity and no contact is "
                         "known; give dt [s], speed=, or waves=1 for the limit of an explicit method")
    count = max(1, math.ceil(scheme.t_end / min(limits.values()) * (1.0 - 1e-9)))
    changes: Dict[str, Any] = dict(dt=scheme.t_end / count, courant=courant, speed=None, waves=None)
    end = ""
    if isinstance(scheme, Scheme) and rule is not None:
        steps = max(scheme.substeps, math.ceil(changes["dt"] / rule.inner))
        changes["substeps"] = 2 ** math.ceil(math.log2(steps))  # so that windows can be halved
        end = f"; {changes['substeps']} DEM steps per window"
    said = ", ".join(f"{name} {limit:.2g} s" for name, limit in limits.items())
    contact = "" if rule is None or not rule.force else f"{rule}; "
    _say(f"{contact}window {changes['dt']:.3g} s: {said}{end}")
    return replace(scheme, **changes)


def keep_window(scheme: Steps, parameters: Dict[str, str]) -> Steps:
    """The ``scheme`` with the window of a checkpoint with these ``parameters``, when its dt is None."""
    if scheme.dt is not None:
        return scheme
    courant, changes = parameters.get("courant", "none"), {}
    if isinstance(scheme, Scheme):
        changes["substeps"] = int(parameters["substeps"])
    return replace(scheme, dt=float(parameters["dt"]), speed=None, waves=None,
                   courant=None if courant == "none" else float(courant), **changes)


def _say(text: str) -> None:
    if MPI.COMM_WORLD.rank == 0:
        tell(text)
