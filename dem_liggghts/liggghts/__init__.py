"""The back end that has LIGGGHTS compute, through a shim of C++; imported only when it is asked for."""
from .backend import LiggghtsDEM
from .library import LiggghtsError, MissingLiggghts

__all__ = ["LiggghtsDEM", "LiggghtsError", "MissingLiggghts"]
