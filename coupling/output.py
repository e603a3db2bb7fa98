"""What a run leaves: frozen data, whose fields are keys of every case."""
from dataclasses import dataclass
from pathlib import Path

import mpm_dem_checks as check


@dataclass(frozen=True)
class Output:
    """Folder and kinds of the results. ValueError for negative numbers.

    >>> Output("out/chute", paraview=10).picture
    0.0
    """

    out: Path  # folder of the results
    paraview: int = 0  # windows from one ParaView file to the next [-]; 0: none
    picture: float = 0.0  # magnification of the displacements in a picture of the end [-]; 0: no picture
    animation: int = 0  # windows from one picture to the next of an animated GIF [-]; 0: none

    def __post_init__(self) -> None:
        check.count("paraview", self.paraview, 0, rule="give the number of windows from file to file, or 0 "
                    "for none")
        check.not_negative("picture", self.picture)
        check.count("animation", self.animation, 0)
