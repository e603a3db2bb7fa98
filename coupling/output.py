"""What a run leaves: frozen data, whose fields are keys of every case."""
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Dict, Optional, Tuple

import mpm_dem_checks as check

from .durations import read_every, seconds

STEEP = 89.0  # [degrees] from straight above there is no right and left


@dataclass(frozen=True)
class Output:
    """Folder and kinds of the results, and what becomes of a run that is cut short. ValueError for negative
    numbers and what is no duration.

    >>> Output("out/chute", paraview=10, checkpoint="10min").picture
    0.0
    """

    out: Path  # folder of the results
    paraview: int = 0  # windows from one ParaView file to the next [-]; 0: none
    picture: float = 0.0  # magnification of the displacements in a picture of the end [-]; 0: no picture
    animation: int = 0  # windows from one picture to the next of an animated GIF [-]; 0: none
    view: Optional[Tuple[float, float]] = None  # azimuth from the flow, elevation of pictures in space [deg]
    checkpoint: Optional[str] = None  # from one to the next: 10min of run time, 500 windows; end: only there
    restart: Optional[Path] = None  # folder, or checkpoint, of a run that goes on from there
    walltime: Optional[str] = None  # run time after which it stops with a checkpoint, such as 23h50min

    may_change: ClassVar[Dict[str, None]] = dict.fromkeys(  # at a restart
        ("out", "paraview", "picture", "animation", "view", "checkpoint", "restart", "walltime"))

    def __post_init__(self) -> None:
        check.count("paraview", self.paraview, 0, rule="give the number of windows from file to file, or 0 "
                    "for none")
        check.not_negative("picture", self.picture)
        check.count("animation", self.animation, 0)
        if self.view is not None:
            _, elevation = check.numbers("view", self.view, 2, "deg")
            if not abs(elevation) <= STEEP:
                raise ValueError(f"view is {self.view}: give azimuth and elevation [deg], the latter from "
                                 f"-{STEEP:g} to {STEEP:g}")
        read_every(self.checkpoint)
        if self.walltime is not None:
            seconds("walltime", self.walltime)
