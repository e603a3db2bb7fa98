"""A partition for a scene: the checks before the first step, then the back end that is asked for."""
from .checks import check_start, warn_if_too_long


def open_scene(backend, scene, dt, comm=None):
    """The partition (`protocol.DEM`) for ``scene`` with the time step ``dt`` [s]; see `Scene.open`."""
    if backend not in ("reference", "liggghts"):
        raise ValueError(f"dem is {backend!r}: the back ends are reference and liggghts, give one of them")
    warn_if_too_long(scene, dt)
    check_start(scene)
    if backend == "liggghts":  # imported here: who does not ask for LIGGGHTS never loads it
        from .liggghts import LiggghtsDEM
        return LiggghtsDEM(scene, dt, comm)
    from .reference import ReferenceDEM
    return ReferenceDEM(scene, dt, comm)
