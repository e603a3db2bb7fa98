"""The size of a scene, estimated before anything is built."""
import mpm_dem_checks as check

# On each rank of the built-in DEM: growth of the peak from 2,000 to 100,000 spheres, measured. LIGGGHTS takes
# 7,700, but divides them among the ranks; what the built-in DEM could do is not refused.
BYTES_PER_SPHERE = 1400
WORK_PER_SPHERE = 1000  # operations in a step, measured
START_PER_SPHERE = 1e5  # operations to check and set up, measured


def check_size(n: float, keys: str, steps: float = 1) -> None:
    """ValueError when ``n`` spheres are too many for the memory, the start, or ``steps`` DEM steps in a
    window; keys: what they come from, such as "blocks=3 spheres=8".

    >>> check_size(192, "blocks=3 spheres=8", steps=50)
    >>> check_size(1e15, "blocks=3 spheres=8")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: 1e+15 spheres (blocks=3 spheres=8) ...
    """
    what, remedy = f"{n:.3g} spheres ({keys})", "take fewer of them"
    check.check_memory(what, n * BYTES_PER_SPHERE, remedy)
    check.check_work(f"{what} at the start", n * START_PER_SPHERE, remedy)
    check.check_work(f"{steps:.3g} DEM steps per window (substeps) of {what}", n * steps * WORK_PER_SPHERE,
                     "take fewer of both, or a shorter window")
