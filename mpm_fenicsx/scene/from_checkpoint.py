"""The state of a body at the start, as it is in a checkpoint of another scene."""
from dataclasses import dataclass
from pathlib import Path
from typing import Optional, Union

import mpm_dem_checks as check

NAME = "checkpoint.h5"  # in the folder of a coupled run


@dataclass(frozen=True)
class FromCheckpoint:
    """For ``start`` of ``Body``: its points start with the deformation and the state of the law, and so the
    stress, of the points of a body in the checkpoint at ``path``, a file of ``MPM.save`` or of a run, or the
    folder of a run. The scene may be another one, on any number of ranks; the body has as many points, in the
    same order and of the same volumes, as when the scene with the checkpoint began: it is stated alike.

    body: its number there; places: where they are there, else as the body is stated; velocities: as fast as
    there, accelerations too, else as the body is stated and without acceleration.

    >>> FromCheckpoint("out/settled").file.as_posix()
    'out/settled'
    """

    path: Union[str, Path]
    body: int = 0
    places: bool = True
    velocities: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.path, (str, Path)) or not str(self.path):
            check.refuse("path of the checkpoint", self.path, "give the name of a file or folder")
        object.__setattr__(self, "body", check.count("body of the checkpoint", self.body, 0))
        for name in ("places", "velocities"):
            object.__setattr__(self, name, check.truth(name, getattr(self, name)))

    @property
    def file(self) -> Path:
        """That is read."""
        path = Path(self.path)
        return path / NAME if path.is_dir() else path

    def check_alone(self, stress: Optional[object]) -> None:
        """Raise ValueError where the body has a ``stress``, too."""
        if stress is not None:
            raise ValueError("the body has a stress and a start from a checkpoint, which has its own: give "
                             "one of them")
