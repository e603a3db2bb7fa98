"""Keys of ``extreme.py`` that make no sense: each alone, and in its scene."""
import math

import mpm_dem_checks as check
from coupling.keys import refuse_unused

ALONE = ("swing", "flight")  # scenes without a sphere
POSITIVE = {"length": "m", "height": "m", "width": "m", "radius": "m", "E": "Pa", "E_ball": "Pa", "contrast": "",
            "rho": "kg/m^3", "mass_ratio": "", "h": "m", "dt": "s", "cfl": "", "per_contact": ""}


def check_keys(main, keys):
    """ValueError for a key out of its range, one that the scene does not use, and a body of too many cells."""
    for name, unit in POSITIVE.items():
        if keys[name] is not None:
            check.positive(name, keys[name], unit)
    for name in ("refine", "windows", "substeps"):
        if keys[name] is not None:
            check.count(name, keys[name])
    for name, unit in (("v0", "m/s"), ("gravity", "m/s^2"), ("gap", "m"), ("friction", ""), ("spread", "m")):
        check.not_negative(name, keys[name], unit)
    check.numbers("unit", keys["unit"], 3, kind=check.positive)
    check.between("nu", keys["nu"], -1, 0.5, ends="()")
    check.between("restitution", keys["restitution"], 0, 1)
    check.between("angle", keys["angle"], -90, 90, "degrees", ends="()")
    check.between("shift", keys["shift"], -math.inf, keys["height"], "m", "it must be less than the height", "[)")
    _refuse_unused(main, keys)
    _check_scene(keys)
    _check_body(keys)


def _check_scene(keys):
    scene, beyond = keys["scene"], keys["length"] / 2 + keys["radius"]
    for place in check.numbers("at", keys["at"], len(keys["at"]), "m"):
        check.between("at", place, -beyond, beyond, "m", f"a sphere must lie within {beyond:.6g} m of the body's "
                      "middle to touch it", "()")
    if scene == "rest":
        check.positive("gravity", keys["gravity"], "m/s^2", "in scene=rest the sphere lies by its weight, give a "
                                                            "positive number")
    elif scene != "flight" or (keys["dt"] is None and keys["cfl"] is None):
        check.positive("v0", keys["v0"], "m/s", "something must move, give a positive number" if scene != "flight" else
                       "give a positive number, or cfl or dt for the length of a window")


def _refuse_unused(main, keys):
    sphere = (keys["scene"] not in ALONE, "in scenes with a sphere")
    timed = keys["dt"] is not None or keys["cfl"] is not None
    ball = (sphere[0] or not timed, "in scenes with a sphere")  # else its contact gives the length of a window
    falls = (sphere[0] and keys["scene"] != "rest", "where a sphere strikes")
    refuse_unused(main, keys, {
        **dict.fromkeys(("at", "gap", "restitution", "friction", "gravity", "spread", "substeps"), sphere),
        **dict.fromkeys(("radius", "E_ball", "mass_ratio"), ball),
        "angle": falls, "v0": (keys["scene"] != "rest", "where something moves"),
        "take_out": (keys["spread"] > 0, "with spread="),
        "contrast": (keys["scene"] == "layers", "in scene=layers"),
        "plane": (keys["dim"] == 2, "in the plane, dim=2"), "cfl": (keys["dt"] is None, "without dt="),
        "per_contact": (not timed, "without dt= and cfl=")})


def _check_body(keys):
    size = [keys["length"], keys["height"], keys["width"]][:keys["dim"]]
    check.between("h", keys["h"], 0, min(size), "m", f"the cell size must lie between 0 and {min(size):.6g} m", "(]")
    n = math.prod(length / keys["h"] for length in size)
    check.check_memory(f"{n:.3g} cells of the body (h={keys['h']:g}, length={keys['length']:g})", 600 * n,
                       "take a larger h, or a shorter body")
