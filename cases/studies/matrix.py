"""The stability matrix: every run with what was expected of it before it was run; ``python -m
coupling.stability``.

Errors are those of ``extreme_references.py``, relative to the size of the quantity. Where no other source is
named, bounds come from the discretisation: of the beam on four cells over its height 5 % in the force and 6 %
in the deflection, of a collision of compact bodies with 50 windows per contact 1 %.
"""
CASE = "../extreme.py"


def words(*parts: str) -> str:
    """Words of a command line; of keys that come again the last value counts."""
    keys = dict(word.split("=", 1) for part in parts for word in part.split())
    return " ".join(f"{key}={value}" for key, value in keys.items())


BEAM = "h=2.5e-3"
COMPACT = "length=0.04 height=0.02 E_ball=1e7"  # steel and a soft sphere: a long contact, a rigid body
BLOCK, FREE, LAYERS = (f"scene={scene} {COMPACT}" for scene in ("block", "free", "layers"))
REST = f"scene=rest {COMPACT} gravity=10 restitution=0.3"
SPACE = "dim=3 length=0.02 height=0.02 width=0.02 points=2"
BENDING = "plane=strain E_ball=1e9 h=2.5e-3"
MODE = "scene=swing h=2.5e-3 points=2"
FLYING = "scene=flight length=0.04 height=0.02"
LIGGGHTS = "dem=liggghts"

AS_BEAM = dict(force=0.05, u_beam=0.06, v_end=0.03, impulse=1e-9)
ITERATED = dict(u_beam=0.06, v_end=0.03, impulse=1e-3)
AS_RIGID = dict(rebound=0.01, peak=0.01, impulse=1e-9)
TURNING = dict(rebound=0.02, momentum=1e-6, impulse=1e-9)
THICK = {**TURNING, "rebound": 0.04, "energy_gain": 0.1}

SCALED = "the problem is the same in units of its own; nothing in the program has a scale"
SOFT = ("the soft layer is too slow to push within a contact: the block bounces as a free one, with half a "
        "row of the layer's cells, an eighth of its mass, on the nodes they share; a sixteenth on cells of "
        "half the size")
RIGID = "two rigid bodies and a Hertz contact; the staggered force lags one window of 50 in a contact"
FOUR = "four windows per contact: it and the modes it excites are not resolved"
ADDED_MASS = "the beam gives way so much more than the sphere that a force that lags one window feeds itself"
LUMPED = ("the projection's lumped mass has 5 % too much moment of inertia on 4 cells, a third of it in the "
          "impulse")
LUMPED_SPACE = ("a cube of 4 cells has 12 % too much moment of inertia in the projection, and as much energy "
                "of turning")

ROWS = [
    # Young's modulus, at a speed at which the beam of 1 kPa bends by a tenth of its height
    *[("modulus", f"E_{E}", f"{BEAM} v0=1e-3 E={E}", "right", AS_BEAM, SCALED)
      for E in ("1e3", "1e5", "1e7", "1e9", "1e11", "1e13")],
    *[("modulus", f"E_{E}_liggghts", f"{BEAM} v0=1e-3 E={E} {LIGGGHTS}", "right", AS_BEAM, SCALED)
      for E in ("1e3", "1e13")],

    # two bodies in one grid
    ("contrast", "stiff_on_soft", f"{LAYERS} contrast=1e8", "right", dict(rebound=0.1, impulse=1e-9), SOFT),
    ("contrast", "stiff_on_soft_fine", f"{LAYERS} contrast=1e8 h=2.5e-3", "right",
     dict(rebound=0.05, impulse=1e-9), SOFT),
    ("contrast", "stiff_on_soft_lumped", f"{LAYERS} contrast=1e8 inertia=lumped", "right",
     dict(rebound=0.1, impulse=1e-9), SOFT),
    ("contrast", "stiff_on_soft_liggghts", f"{LAYERS} contrast=1e8 {LIGGGHTS}", "right",
     dict(rebound=0.1, impulse=1e-9), SOFT),
    ("contrast", "soft_on_stiff", f"{LAYERS} E=1e5 contrast=1e-8 v0=0.1", "right",
     dict(against_fixed=0.01, impulse=1e-9), "a base 1e8 times as stiff is as good as fixed nodes"),
    ("contrast", "soft_on_stiff_liggghts", f"{LAYERS} E=1e5 contrast=1e-8 v0=0.1 {LIGGGHTS}", "right",
     dict(against_fixed=0.01, impulse=1e-9), "a base 1e8 times as stiff is as good as fixed nodes"),

    # speed: from small motion to perforation
    *[("speed", f"v_{v}", f"{BEAM} v0={v}", "right", AS_BEAM, "small strain: the beam and Hertz stay linear "
       "in size")
      for v in ("1e-3", "1e-1", "1", "10")],
    ("speed", "deep", f"{BLOCK} v0=1", "right", AS_RIGID, "a tenth of the radius deep: Hertz' law as given"),
    ("speed", "deep_liggghts", f"{BLOCK} v0=1 {LIGGGHTS}", "right", AS_RIGID, "as with the built-in DEM"),
    ("speed", "deeper", f"{BLOCK} v0=10", "right", AS_RIGID, "0.6 of the radius deep: Hertz' law as given"),
    ("speed", "perforation", f"{BLOCK} v0=100", "stopped", {},
     "the sphere's centre goes through the surface"),
    ("speed", "perforation_1e3", f"{BLOCK} v0=1000", "stopped", {}, "the sphere's centre goes through the "
     "surface"),
    ("speed", "perforation_liggghts", f"{BLOCK} v0=100 {LIGGGHTS}", "stopped", {},
     "the sphere's centre goes through the surface"),
    ("speed", "soft_target", words(BLOCK, "E=1e5 E_ball=1e9 v0=1 law=neo_hooke"), "stopped", {},
     "at a tenth of the wave speed the surface cells are crushed"),
    ("speed", "soft_target_1e3", words(BLOCK, "E=1e5 E_ball=1e9 v0=1000 law=neo_hooke"), "stopped", {},
     "a hundred times the wave speed: cells are turned inside out in one window"),
    ("speed", "v_100", f"{BEAM} v0=100", "inaccurate", AS_BEAM,
     "a sixth of the radius deep: more cells meet the sphere at once"),
    ("speed", "v_1e3", f"{BEAM} v0=1000", "stopped", {}, "the sphere comes at a fifth of the wave speed"),

    # mass of the sphere over that of the body
    *[("mass", f"free_{m}", f"{FREE} mass_ratio={m}", "right", AS_RIGID, RIGID) for m
      in ("1e-3", "1", "1e3")],
    *[("mass", f"free_{m}_liggghts", f"{FREE} mass_ratio={m} {LIGGGHTS}", "right", AS_RIGID, RIGID)
      for m in ("1e-3", "1e3")],
    *[("mass", f"beam_{m}", f"{BEAM} mass_ratio={m} windows={n}", "right", AS_BEAM,
       "the wall that is carried on second order in time keeps up")
      for m, n in (("1e-3", 120), ("0.1", 120), ("10", 40))],
    *[("mass", f"beam_{m}_weak", f"{BEAM} mass_ratio={m} windows=40", "stopped", {}, ADDED_MASS)
      for m in ("1e3", "1e4")],
    ("mass", "beam_1e3_weak_short", f"{BEAM} mass_ratio=1e3 windows=160 per_contact=200", "stopped", {},
     ADDED_MASS),
    *[("mass", f"beam_{m}_iterated", f"{BEAM} mass_ratio={m} windows=40 iterate=20", "right", ITERATED,
       "both sides agree in every window: nothing lags") for m in ("1e-3", "1", "1e3", "1e4")],
    ("mass", "beam_1e3_iterated_liggghts", f"{BEAM} mass_ratio=1e3 windows=40 iterate=20 {LIGGGHTS}", "right",
     ITERATED,
     "both sides agree in every window: nothing lags"),
    ("mass", "beam_1e3_iterated_force", f"{BEAM} mass_ratio=1e3 windows=40 iterate=20", "inaccurate",
     dict(force=0.05),
     "the force rattles between beam and sphere, faster than 50 windows per contact resolve"),

    # Poisson's ratio, in plane strain
    *[("nu", f"nu_{nu}", f"{BENDING} nu={nu} f_bar=yes", "right", {**AS_BEAM, "u_beam": 0.12},
       "F-bar leaves the volume to the mean of a cell; bilinear cells shear in bending, more so in plane "
       "strain")
      for nu in ("0", "0.45", "0.499", "0.4999")],
    ("nu", "nu_0.4999_fine", words(BENDING, "nu=0.4999 f_bar=yes h=1.25e-3 points=2"), "right",
     {**AS_BEAM, "u_beam": 0.04},
     "that shear falls with the square of the cell"),
    ("nu", "nu_0.4999_locking", f"{BENDING} nu=0.4999", "inaccurate", dict(u_beam=0.06),
     "without F-bar bilinear cells lock"),

    # material points
    *[("points", f"per_cell_{n * n}", f"{BEAM} points={n}", "right", AS_BEAM, "enough for the bilinear cell")
      for n in (2, 4, 6)],
    ("points", "per_cell_64", f"{BEAM} refine=2 points=4", "right", AS_BEAM, "enough for the bilinear cell"),
    ("points", "per_cell_1", f"{BEAM} points=1 windows=1000", "inaccurate", dict(u_beam=0.06),
     "one point leaves the hourglass modes of the cell without stiffness"),
    ("points", "random", f"{BEAM} points=4 seeding=random", "inaccurate", dict(u_beam=0.06, force=0.03),
     "random points integrate a cell to 1/sqrt(16)"),
    ("points", "corner", f"{BEAM} seeding=corner", "right", AS_BEAM,
     "a point alone in a corner brings its mass and nothing else"),
    ("points", "corner_lumped", f"{BEAM} seeding=corner inertia=lumped", "right", AS_BEAM,
     "as with consistent inertia"),

    # time step over the explicit limit, of the beam alone and of the impact
    *[("step", f"swing_{cfl}", f"{MODE} cfl={cfl} windows={n}", "right", bounds,
       "Newmark's method keeps the amplitude at any step, at a frequency that is known; the grid's own is 1 "
       "% too high")
      for cfl, n, bounds in (("0.1", 200, dict(newmark=0.02)), ("1", 200, dict(newmark=0.02)),
                             ("10", 200, dict(newmark=0.1, amplitude=0.05)),
                             ("100", 40, dict(newmark=0.2, amplitude=0.05)),
                             ("1000", 20, dict(newmark=0.2, amplitude=0.05)))],
    ("step", "impact_1", f"{BEAM} cfl=1 windows=400", "right", AS_BEAM, "far below what the contact needs"),
    ("step", "impact_10", f"{BEAM} cfl=10", "right", AS_BEAM, "40 windows per contact"),
    ("step", "impact_100", f"{BEAM} cfl=100 windows=10", "inaccurate", dict(force=0.05, energy_gain=0.25),
     FOUR),
    ("step", "impact_100_iterated", f"{BEAM} cfl=100 windows=10 iterate=20", "inaccurate",
     dict(force=0.05, energy_gain=0.25), FOUR),
    ("step", "impact_1000", f"{BEAM} cfl=1000 windows=5", "stopped", {}, "the contact is over within half a "
     "window"),
    ("step", "impact_1000_iterated", f"{BEAM} cfl=1000 windows=5 iterate=20", "stopped", {},
     "the contact is over within half a window"),
    ("step", "impact_100_adapted", f"{BEAM} cfl=100 windows=10 adapt=0.05", "right", AS_BEAM,
     "the window follows the force down to where it is resolved"),

    # restitution and friction
    ("contact", "restitution_1", f"{BLOCK}", "right", AS_RIGID, RIGID),
    ("contact", "restitution_0.05", f"{BLOCK} restitution=0.05", "right", dict(rebound=0.01),
     "the damping is made for its coefficient"),
    ("contact", "restitution_0.05_liggghts", f"{BLOCK} restitution=0.05 {LIGGGHTS}", "right",
     dict(rebound=0.01),
     "the damping is made for its coefficient"),
    ("contact", "friction_0", f"{BLOCK} angle=45", "right",
     dict(rebound=0.01, peak=0.01, angular=1e-6, sliding=1e-6),
     "nothing acts along a smooth wall, but for the tilt of its dent"),
    ("contact", "friction_0.1", f"{BLOCK} angle=45 friction=0.1", "right",
     dict(rebound=0.01, angular=1e-3, sliding=1e-3),
     "the sphere slides throughout: the impulse is friction times that of the normal force"),
    ("contact", "friction_10", f"{BLOCK} angle=45 friction=10", "right",
     dict(rebound=0.01, angular=1e-3, energy_gain=0.1),
     "it sticks; the tangential spring gives back more than it took while the contact opens (Thornton et al. "
     "2013)"),
    ("contact", "friction_10_liggghts", f"{BLOCK} angle=45 friction=10 {LIGGGHTS}", "right",
     dict(rebound=0.01, angular=1e-3, energy_gain=0.1), "as with the built-in DEM"),

    # where the sphere hits
    ("place", "off_centre", f"{FREE} at=0.015", "right", TURNING, LUMPED),
    ("place", "off_centre_fine", f"{FREE} at=0.015 h=2.5e-3", "right", {**TURNING, "rebound": 0.005},
     "the error of the projection falls with the square of the cell"),
    ("place", "edge", f"{FREE} at=0.0201", "right", TURNING, LUMPED),
    ("place", "beyond_edge", f"{FREE} at=0.025", "right", TURNING, LUMPED),
    ("place", "beyond_edge_liggghts", f"{FREE} at=0.025 {LIGGGHTS}", "right", TURNING, LUMPED),
    ("place", "two_on_one_segment", f"{FREE} at=-1.001e-3,1.001e-3 radius=1e-3", "right", AS_RIGID, RIGID),
    ("place", "two_on_one_segment_liggghts", f"{FREE} at=-1.001e-3,1.001e-3 radius=1e-3 {LIGGGHTS}", "right",
     AS_RIGID,
     RIGID),
    ("place", "space_middle", words(FREE, SPACE), "right", AS_RIGID, RIGID),
    ("place", "space_edge", words(FREE, SPACE, "at=0.0101"), "right", THICK, LUMPED_SPACE),
    ("place", "space_edge_fine", words(FREE, SPACE, "at=0.0101 h=2.5e-3"), "right",
     {**TURNING, "rebound": 0.01},
     "the error of the projection falls with the square of the cell"),
    ("place", "space_edge_liggghts", words(FREE, SPACE, "at=0.0101 ", LIGGGHTS), "right", THICK,
     LUMPED_SPACE),
    ("place", "tetrahedra", words(FREE, SPACE, "cell=tetrahedron points=4"), "right", AS_RIGID, RIGID),
    ("place", "triangles", f"{FREE} cell=triangle points=3", "right", AS_RIGID, RIGID),

    # separation and contact again
    ("again", "bouncing", f"{BLOCK} gravity=0.1 windows=600", "right", dict(again=0.02),
     "it comes back after 2 v/g, as fast"),
    ("again", "bouncing_liggghts", f"{BLOCK} gravity=0.1 windows=600 {LIGGGHTS}", "right", dict(again=0.02),
     "it comes back after 2 v/g, as fast"),
    ("again", "three_contacts", "length=0.307 radius=0.02 h=2.5e-3 points=2 per_contact=150 windows=1400",
     "right",
     dict(u_beam=0.06, v_end=0.03),
     "three contacts; the force of the third comes late, its impulse is right"),
    ("again", "flies_off", f"{FREE} windows=600", "right", AS_RIGID, RIGID),

    # flight through many cells
    ("flight", "rigid", f"{FLYING} v0=0 fly=100 cfl=1 windows=1000", "right", dict(noise=1e-6, momentum=1e-9),
     "a rigid motion is in the space of the basis"),
    ("flight", "rigid_long_steps", f"{FLYING} v0=0 fly=1000 cfl=2 windows=300", "right",
     dict(noise=1e-6, momentum=1e-9),
     "a rigid motion is in the space of the basis"),
    ("flight", "vibrating", f"{FLYING} v0=0.1 fly=100 cfl=1 windows=200", "inaccurate",
     dict(crossing=0.05, momentum=1e-9),
     "the gradient of the linear basis jumps where a point goes into the next cell"),
    ("flight", "vibrating_more_points", f"{FLYING} v0=0.1 fly=100 cfl=1 windows=200 points=6", "inaccurate",
     dict(crossing=0.05, momentum=1e-9), "the jumps of more points are smaller"),

    # boundary particles beside the material points
    ("interface", "in_empty_cells", f"{BLOCK} shift=-0.002", "right", AS_RIGID,
     "the basis is rescaled to the nodes that have mass (eq. 14)"),
    ("interface", "far_from_points", f"{BLOCK} shift=-0.006", "stopped", {}, "no node there has mass"),
    ("interface", "inside", f"{BLOCK} shift=0.002", "right", AS_RIGID,
     "the wall lies in the body; nothing else changes"),

    # units
    *[("units", f"{name}{suffix}", f"{BEAM} unit={unit} {words}", "right", dict(scaling=1e-6), SCALED)
      for name, unit in (("micrometre", "1e-4,1e-4,1e-12"), ("kilometre", "1e5,1e5,1e15"),
                         ("fast_and_light", "1,1e-9,1e-6"))
      for suffix, words in (("", ""), ("_liggghts", LIGGGHTS))],

    # at rest
    ("rest", "long", f"{REST} windows=10000", "right", dict(weight=1e-6, sag=0.02, creep=1e-6),
     "nothing moves on"),
    ("rest", "long_liggghts", f"{REST} windows=10000 {LIGGGHTS}", "right",
     dict(weight=1e-6, sag=0.02, creep=1e-6),
     "nothing moves on"),
    ("rest", "undamped", words(REST, "restitution=1 windows=2000"), "right", dict(weight=0.05, impulse=1e-9),
     "it swings about its weight for ever"),
]
