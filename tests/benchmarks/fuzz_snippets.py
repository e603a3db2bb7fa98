"""Bad values for every field of every public class and function, for ``fuzz_input``."""
import functools
import warnings
from types import SimpleNamespace

import numpy as np

from coupling import Scheme, Steps, count_windows, couple, linear, march, nearest
from coupling.loop.control import StepControl
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, longest_window, open_dem
from mpm_fenicsx import (
    LAWS,
    MPM,
    Body,
    Box,
    Cloud,
    Grid,
    GridWall,
    Interface,
    Load,
    Mesh,
    Numerics,
    Penalty,
    Resampling,
    Support,
    drucker_prager,
    mohr_coulomb,
    of_points,
    read_cloud,
    read_mesh,
    von_mises,
)
from mpm_fenicsx import linear as hooke

NAN, INF = np.nan, np.inf
NO_NUMBER = [NAN, INF, "1", None, 1j, [1.0, 2.0], True, {}]
WORDS = ["none-such", "", 3, ["x"], NAN]
BAD = {  # kind of value → values that are right for none of that kind
    "positive": [*NO_NUMBER, -1.0, 0.0, 1e300, 1e-300],
    "optional": [v for v in NO_NUMBER if v is not None] + [-1.0, 0.0],
    "zero": [*NO_NUMBER, -1.0, 1e300],
    "number": [*NO_NUMBER, 1e300],
    "share": [*NO_NUMBER, -0.1, 1.1],
    "count": [*NO_NUMBER, -1, 0, 1.5, 2**40],
    "counts": [None, 2, (2,), (2, 2, 2), (0, 2), (-1, 2), (1.5, 2), (NAN, 2), (INF, 2), "22", ("a", "b"),
               ((1, 2), 3)],
    "point": [None, 2.0, (1.0,), (1.0, 2.0, 3.0, 4.0), (NAN, 1.0), (INF, 1.0), "ab", ("a", "b"),
              (1e300, 1.0)],
    "points": [None, 2.0, "ab", [[NAN, 0.0]], [[INF, 0.0]], [[0.0]], [["a", "b"]], [[0.0], [1.0, 2.0]],
               [[1e300, 0.0]],
               np.zeros((2, 2, 2)), np.zeros((1, 5))],
    "elements": [None, 2.5, "ab", [[0, 99]], [[-1, 0]], [[0.5, 1]], [[NAN, 0]], [[0, 1, 2, 3]], [[0], [1, 2]],
                 np.zeros((1, 2, 2), int)],
    "word": WORDS, "optional word": [w for w in WORDS if w != ""],
    "flag": ["yes", 1, None, NAN, [True]],
    "where": [3, "left", lambda x: x[:, 0], lambda x: True, lambda x: x[99], lambda x: np.ones(3, bool),
              lambda x: None],
    "motion": [3.0, lambda t: NAN, lambda t: "up", lambda t: (1.0, 2.0, 3.0), lambda t: None,
               lambda t: 1 / 0],
    "field": ["fast", NAN, (1.0, 2.0, 3.0), lambda x: np.full(len(x), NAN), lambda x: np.zeros((1, 7)),
              lambda x: x[99],
              lambda x: "fast"],
    "velocity": ["fast", NAN, (1.0, 2.0, 3.0), None], "function": [3, "x", NAN],
    "record": [3, "x", SimpleNamespace(), np.zeros(3)],
    "records": [3, "x", [3], [None]],
    "file": ["", "missing", "{folder}", "{folder}/pipe", "{folder}/text.msh", "{folder}/noise.vtk", 3, None,
             "a\0b",
             "\udcff"],
}
SQUARE, LAW = Box((0.0, 0.0), (1.0, 1.0)), hooke(1e6, 0.3)
X, PAIRS = [[0.0, 0.0], [1.0, 0.0]], [[0, 1]]
TOP = Interface.top(SQUARE, 2)
BODY = dict(shape=SQUARE, cells=(2, 2), points=2, law=LAW, rho=1e3)
SPHERES = dict(x=[[0.0, 1.0]], v=[[0.0, 0.0]], radius=0.1, rho=1e3)
STEEL = Material(1e7, 0.3)
CLUSTER = dict(centres=[[0.0, 0.0], [0.1, 0.0]], radii=0.1, x=(0.0, 1.0), mass=1.0, inertia=1.0)
SCENE = dict(spheres=Spheres(**SPHERES), wall=Wall(X, PAIRS), material=STEEL, wall_material=STEEL)
GRID = Grid(Box((-1.0, -1.0), (2.0, 2.0)), (6, 6))
SOLID = dict(grid=GRID, body=Body(**BODY), supports=[], interface=TOP)
SOIL = dict(E=1e6, nu=0.3, friction_angle=30.0, dilation_angle=5.0, cohesion=1e3, tension_cutoff=1e2)
SOIL_KINDS = dict(E="positive", nu="share", friction_angle="zero", dilation_angle="zero", cohesion="zero",
                  tension_cutoff="optional")
DAMPED = dict(SOIL_KINDS, tension_cutoff=None, nu=None)
TABLE = [  # name, what is called, arguments that are right, kind of value of each to be tried
    ("Box", Box, dict(lower=(0.0, 0.0), upper=(1.0, 1.0)), dict(lower="point", upper="point")),
    ("Grid", Grid, dict(box=SQUARE, cells=(2, 2)), dict(box="record", cells="counts", cell="optional word")),
    ("Grid.counts", Grid.counts, dict(size=(1.0, 1.0), h=0.5), dict(h="positive", size="point")),
    ("Cloud", Cloud, dict(x=[[0.1, 0.1]], volume=[1.0]), dict(x="points", volume="points")),
    ("Mesh", Mesh, dict(vertices=[[0, 0], [1, 0], [0, 1]], cells=[[0, 1, 2]], cell="triangle"),
     dict(vertices="points", cells="elements", cell="word", groups="record", surfaces="record")),
    ("Body", Body, BODY, dict(shape="record", cells="counts", points="count", law="record", rho="positive",
                              stress_state="optional word", thickness="positive", cell="optional word",
                              f_bar="flag",
                              velocity="velocity", stress="function")),
    ("Support", Support, dict(where=lambda x: x[:, 0] < 0, fix="x"), dict(fix="word")),
    ("Support.column", Support.column, dict(axis="x", at=0.0, grid=GRID, fix="y"),
     dict(axis="word", at="number", grid="record", fix="word")),
    ("Interface", Interface, dict(x=X, elements=PAIRS),
     dict(x="points", elements="elements", resampling="record")),
    ("Interface.top", Interface.top, dict(box=SQUARE, segments=2),
     dict(box="record", segments="counts", shift="zero")),
    ("Interface.line", Interface.line, dict(a=(0.0, 0.0), b=(1.0, 0.0), segments=2),
     dict(a="point", b="point", segments="count")),
    ("Interface.patch", Interface.patch,
     dict(corner=(0.0, 0.0, 0.0), first=(1.0, 0.0, 0.0), second=(0.0, 1.0, 0.0), counts=(2, 2)),
     dict(corner="point", first="point", second="point", counts="counts")),
    ("Interface.around", Interface.around, dict(body=Body(**BODY), spacing=0.1),
     dict(body="record", spacing="optional", inset="zero", open_sides="records", floor="optional word")),
    ("Resampling", Resampling, dict(spacing=0.1),
     dict(spacing="positive", longest="positive", shortest="zero", feet="records", reach="zero")),
    ("Penalty", Penalty, dict(surface=TOP, normal=(0.0, 1.0), friction=0.3),
     dict(surface="record", normal="point", friction=None, separates="flag", follows="flag",
          stiffness="optional")),
    ("GridWall", GridWall, dict(where=lambda x: x[:, 0] < 0, normal="+x"),
     dict(normal="word", separates="flag", stiffness="optional")),
    ("Load", Load, dict(surface=TOP, pressure=1.0), dict(surface="record", pressure="point")),
    ("Load traction", Load, dict(surface=TOP, traction=(1.0, 0.0)), dict(traction="points")),
    ("of_points", of_points, dict(body=Body(**BODY)), dict(body="record")),
    ("read_mesh", read_mesh, dict(path="x.msh", dim=2), dict(path="file")),
    ("read_cloud", read_cloud, dict(path="x.vtu", dim=2), dict(path="file")),
    *((name, LAWS[name], dict(E=1e6, nu=0.3), dict(E="positive", nu="share")) for name
      in ("linear", "neo_hooke")),
    ("mohr_coulomb", mohr_coulomb, SOIL, SOIL_KINDS),
    ("drucker_prager", drucker_prager, SOIL, dict(SOIL_KINDS, match="word")),
    ("von_mises", von_mises, dict(E=1e6, nu=0.3, yield_stress=1e3),
     dict(E="positive", nu="share", yield_stress="positive", hardening="zero")),
    ("MPM", lambda **keys: MPM(**keys).close(), SOLID,
     dict(grid="record", body="record", interface="record", gravity="point", inertia="word",
          numerics="record",
          loads="records", penalties="records", supports="records")),
    ("Numerics", Numerics, dict(solver="cg", rebalance=1.5, transfer="tpic", losses=True),
     dict(solver="word", rebalance="share", transfer="word", losses="flag")),
    ("MPM where", lambda where: MPM(**dict(SOLID, supports=[Support(where, "xy")])).close(),
     dict(where=lambda x: x[:, 1] < 0.1), dict(where="where")),
    ("MPM wall where", lambda where: MPM(**dict(SOLID, penalties=[GridWall(where, "+y", 0.3)])).close(),
     dict(where=lambda x: x[:, 1] < 0.1), dict(where="where")),
    ("MPM velocity", lambda velocity: MPM(GRID, Body(**BODY, velocity=velocity)).close(), dict(velocity=0.0),
     dict(velocity="field")),
    ("MPM body_force", lambda force: MPM(GRID, Body(**BODY), body_force=lambda x, t: force(x)).close(),
     dict(force=lambda x: 0.0 * x), dict(force="field")),
    ("MPM motion", lambda motion: _advanced(supports=[Support(lambda x: x[:, 1] < 0.1, "xy", motion)]),
     dict(motion=lambda t: 0.0), dict(motion="motion")),
    ("MPM load", lambda force: _advanced(loads=[Load(TOP, pressure=force)]), dict(force=lambda t: 1.0),
     dict(force="motion")),
    ("MPM.advance", lambda dt, force: _advanced(dt, force), dict(dt=1e-3, force=np.zeros((3, 2))),
     dict(dt="positive", force="points")),
    ("Material", Material, dict(E=1e7, nu=0.3), dict(E="positive", nu="share")),
    ("Interaction", Interaction, {}, dict(restitution="share", friction="zero", adhesion="zero")),
    ("Spheres", Spheres, SPHERES, dict(x="points", v="points", radius="positive", rho="positive",
                                       omega="points")),
    ("Wall", Wall, dict(nodes=X, elements=PAIRS), dict(nodes="points", elements="elements", depth="optional",
                                                       radius="optional")),
    ("Wall.discs", Wall.discs, dict(x=X, radius=0.1), dict(x="points", radius="positive")),
    ("Cluster", Cluster, CLUSTER, dict(centres="points", radii="positive", x="point", mass="positive",
                                       inertia="positive", centre="points", v="points", angle="number",
                                       omega="points", free="record", quaternion="record")),
    ("Cluster.box", Cluster.box, dict(size=(0.2, 0.2), n=(2, 2), x=(0.0, 1.0), rho=1e3, depth=1.0),
     dict(size="point", n="counts", x="point", rho="positive", depth="positive", mass_of="word", rim="flag",
          radius="optional")),
    ("Cluster.of_spheres", Cluster.of_spheres, dict(centres=[[0.0, 0.0]], radii=0.1, rho=1e3, x=(0.0, 1.0)),
     dict(centres="points", radii="positive", rho="positive", x="point")),
    ("Scene", Scene, SCENE, dict(spheres="record", wall="record", material="record", wall_material="record",
                                 between="record", at_wall="record", gravity="point", clusters="records",
                                 walls="records", materials="record", interactions="record")),
    ("open_dem", lambda **keys: open_dem(**keys).close(), dict(backend="reference", scene=Scene(**SCENE),
                                                               dt=1e-5),
     dict(backend="word", scene="record", dt="positive")),
    ("DEM.advance", lambda steps, x, v: open_dem("reference", Scene(**SCENE), 1e-5).advance(steps, x, v),
     dict(steps=2, x=X, v=np.zeros((2, 2))), dict(steps="count", x="points", v="points")),
    ("longest_window", longest_window, dict(scene=Scene(**SCENE), mass=1.0),
     dict(mass="positive", force="optional")),
    ("count_windows", count_windows, dict(t_end=1.0, dt=0.1),
     dict(t_end="positive", dt="positive", substeps="count")),
    ("StepControl", StepControl, dict(most=4), dict(most="count", tolerance=None)),
    ("linear", linear, dict(x_solid=X, elements=PAIRS, x_wall=X), dict(x_solid="points", elements="elements",
                                                                       x_wall="points")),
    ("nearest", nearest, dict(x_solid=X, x_wall=X), dict(x_solid="points", x_wall="points")),
    ("march", lambda **keys: _marched(**keys), dict(dt=1e-3, t_end=1e-3),
     dict(dt="positive", t_end="positive")),
    ("couple", lambda **keys: _coupled(**keys), dict(dt=1e-4, t_end=1e-4, substeps=10),
     dict(dt="positive", t_end="positive", substeps="count", iterate="share", tol="positive", relax="word",
          adapt="optional")),
]
ALIASES = {"x_solid": "interface", "x_wall": "wall", "force": "", "most": "", "cells": "cell", "counts": "",
           "n": "", "a": "", "b": "", "mass_of": "mass of", "path": "",
           "x": "x|positions?|particles?|nodes?|centres?"}
MAY = {  # (name, field): values of the kind that are right there, by their repr
    ("linear", "nu"): {"-0.1"}, ("neo_hooke", "nu"): {"-0.1"}, ("mohr_coulomb", "nu"): {"-0.1"},
    ("drucker_prager", "nu"): {"-0.1"}, ("von_mises", "nu"): {"-0.1"}, ("Material", "nu"): {"-0.1"},
    ("mohr_coulomb", "tension_cutoff"): {"0.0"}, ("drucker_prager", "tension_cutoff"): {"0.0"},
    ("Numerics", "rebalance"): {"1.1"}, ("couple", "adapt"): {"0.0"}, ("Wall", "depth"): {"0.0"},
    ("Grid.counts", "size"): {"(1.0,)", "(1.0, 2.0, 3.0, 4.0)"}, ("Load", "pressure"): {"2.0"},
    ("MPM load", "force"): {"3.0"}, ("Cluster", "radii"): {"[1.0, 2.0]"},
       ("Cluster", "free"): {"array([0., 0., 0.])"},
    ("Cluster", "x"): {"None"}, ("Cluster.box", "x"): {"None"}, ("Cluster.of_spheres", "x"): {"None"},
    ("couple", "tol"): {"1e-300"}, ("longest_window", "force"): {"inf"},
       ("Interface.top", "segments"): {"2", "(2,)"},
    ("Spheres", "omega"): {"None"}, ("Cluster", "centre"): {"None"}, ("Cluster", "v"): {"None"},
    ("Cluster", "omega"): {"2.0"}, ("MPM.advance", "force"): {"None"},
    ("MPM", "gravity"): {"None"}, ("Scene", "gravity"): {"None"}}


def _advanced(dt=1e-3, force=None, **keys):
    solid = MPM(**dict(SOLID, **keys))
    try:
        solid.advance(dt, force)
    finally:
        solid.close()


def _marched(**keys):
    solid = MPM(**SOLID)
    try:
        march(solid, Steps(**keys))
    finally:
        solid.close()


def _coupled(**keys):
    wall = Wall(TOP.x, TOP.elements)
    scene = Scene(Spheres([[0.5, 1.5]], [[0.0, -1.0]], 0.1, 1e3), wall, STEEL, STEEL)
    solid, grains = MPM(**SOLID), open_dem("reference", scene, 1e-5)
    try:
        couple(solid, grains, linear(TOP.x, TOP.elements, TOP.x), Scheme(**keys))
    finally:
        solid.close(), grains.close()


def snippets(folder, sentence):
    """(label, function that says what is bad)."""
    (folder / "text.msh").write_text("this is no mesh\n")
    (folder / "noise.vtk").write_bytes(bytes(range(256)))
    for name, make, right, kinds in TABLE:
        yield f"{name} as it should be", functools.partial(_right, make, right)
        for field, kind in kinds.items():
            for value in BAD[kind] if kind else []:
                if isinstance(value, str):
                    value = value.replace("{folder}", str(folder))
                if repr(value) not in MAY.get((name, field), ()):
                    label = f"{name}({field}={getattr(value, '__name__', None) or repr(value)})"
                    yield label, functools.partial(_judge, make, {**right, field: value}, field, sentence)


def _right(make, arguments):
    if make not in (read_mesh, read_cloud):
        make(**arguments)


def _judge(make, arguments, field, sentence):
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            make(**arguments)
    except (ValueError, RuntimeError, OSError, ArithmeticError) as error:
        if type(error) in (ValueError, OSError, ArithmeticError) or type(error).__module__ != "builtins":
            return sentence(str(error), None)
        return f"{type(error).__name__}: {error}"
    return "accepted"
