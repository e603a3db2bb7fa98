"""Draws the pictures of architecture.md: who imports whom, by floors, and the flow of one window.

    ./dev run python docs/draw_architecture.py                    .images/imports.png and .images/window.png
    ./dev run python docs/draw_architecture.py TREE FILE.png      the imports of another state of the project
"""
import ast
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402 - after the choice of the back end
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {"coupling": "#dcebf7", "mpm_fenicsx": "#e4f2de", "dem_liggghts": "#fbe9d8"}  # and their colours
PER_ROW = 6  # names of files side by side in a folder's box
IN_LINE = 10  # rooms of one floor side by side
UNIT = 0.5  # inches of a unit in the pictures


# ---------------------------------------------------------------- who imports whom

def imported(path, tree):
    """Files of the ``tree`` that a file imports."""
    home, found = path.relative_to(tree).parts[:-1], set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            base = [*home[:len(home) + 1 - node.level]] if node.level else []
            base += node.module.split(".") if node.module else []
            for alias in node.names:
                for parts in ([*base, alias.name], base):
                    file = tree.joinpath(*parts).with_suffix(".py")
                    folder = tree.joinpath(*parts, "__init__.py")
                    if file.is_file() or folder.is_file():
                        found.add(file if file.is_file() else folder)
                        break
    return found - {path}


def rooms(package, tree):
    """name → (files in it, rooms that it imports): a room is a file of the package, or a folder in it."""
    home = tree / package
    files = [path for path in sorted(home.rglob("*.py")) if path != home / "__init__.py"]
    room = {path: path.relative_to(home).parts[0] for path in files}
    found = {name: ([], set()) for name in room.values()}
    for path in files:
        if path.name != "__init__.py":
            found[room[path]][0].append(path.stem)
        found[room[path]][1].update(room[other] for other in imported(path, tree) if other in room)
    return {name: (sorted(inside), others - {name}) for name, (inside, others) in found.items()}


def reached(name, graph):
    """Names of all that a room imports, directly or by others."""
    found, ahead = set(), [name]
    while ahead:
        new = graph[ahead.pop()][1] - found
        found |= new
        ahead += new
    return found


def floors(graph):
    """name → number of the floor: above all that it imports; those of a circle stand beside each other."""
    below = {name: reached(name, graph) for name in graph}
    floor = {}
    for name in sorted(graph, key=lambda name: len(below[name])):  # who imports more comes later
        lower = [floor[other] for other in below[name] if name not in below[other]]
        floor[name] = 1 + max(lower, default=-1)
    return floor


def text_of(name, inside):
    """What stands in a room: its name, and the files of a folder."""
    if name.endswith(".py"):
        return name[:-3], ""
    lines = [", ".join(inside[n:n + PER_ROW]) for n in range(0, len(inside), PER_ROW)]
    return name + "/", ",\n".join(lines)


def placed(graph):
    """name → (middle, bottom, width, height) of the room's box, lowest floor first; and the height of all."""
    floor, boxes, bottom = floors(graph), {}, 0.0
    for level in range(max(floor.values()) + 1):
        row = sorted(name for name in graph if floor[name] == level)
        for start in range(0, len(row), IN_LINE):
            line = {name: text_of(name, graph[name][0]) for name in row[start:start + IN_LINE]}
            widths = [0.4 + max(0.19 * len(name), *(0.135 * len(words) for words in inside.split("\n")))
                      for name, inside in line.values()]
            height = 0.5 + max(0.3 * (inside.count("\n") + 1) * bool(inside) for _, inside in line.values())
            left = -0.5 * (sum(widths) + 0.35 * (len(line) - 1))
            for name, width in zip(line, widths):
                boxes[name] = left + 0.5 * width, bottom, width, height
                left += width + 0.35
            bottom += height + 0.35
        bottom += 0.45
    return boxes, bottom - 0.7


def draw_package(axis, package, colour, graph, boxes):
    """Rooms of a package by floors, an arrow for each pair of which one imports the other."""
    for name, (x, y, width, height) in boxes.items():
        axis.add_patch(FancyBboxPatch((x - 0.5 * width, y), width, height, boxstyle="round,pad=0.02",
                                      facecolor=colour, edgecolor="#444444", linewidth=0.8, zorder=3))
        title, inside = text_of(name, graph[name][0])
        middle = dict(ha="center", va="center", zorder=4)
        axis.text(x, y + height - 0.25, title, fontsize=9, fontweight="bold", **middle)
        axis.text(x, y + 0.5 * (height - 0.4), inside, fontsize=7, **middle)
    pairs = [(name, other) for name, (_, others) in graph.items() for other in others]
    both = [pair for pair in pairs if pair[::-1] in pairs]
    for name, other in pairs:
        (x, y, _, _), (u, v, _, height) = boxes[name], boxes[other]
        colour, width = ("#c03028", 1.4) if (name, other) in both else ("#8899aa", 0.7)
        axis.add_patch(FancyArrowPatch((x, y), (u, v + height), arrowstyle="-|>", mutation_scale=8, zorder=2,
                                       color=colour, linewidth=width, alpha=0.7))
    files = sum(max(len(inside), 1) for inside, _ in graph.values())
    axis.set_title(f"{package}: {files} files, {len(pairs)} arrows, {len(both) // 2} two-way", fontsize=11)


def draw_imports(tree, path):
    """The three packages, one above the other."""
    graphs = {package: rooms(package, tree) for package in PACKAGES}
    places = {package: placed(graph) for package, graph in graphs.items()}
    boxes = [box for found, _ in places.values() for box in found.values()]
    half = 0.2 + max(abs(x) + 0.5 * width for x, _, width, _ in boxes)
    heights = [height for _, height in places.values()]
    figure, axes = plt.subplots(3, 1, figsize=(UNIT * 2 * half, UNIT * sum(heights)),
                                gridspec_kw=dict(height_ratios=heights, hspace=0.12))
    for axis, (package, colour), height in zip(axes, PACKAGES.items(), heights):
        draw_package(axis, package, colour, graphs[package], places[package][0])
        axis.set(xlim=(-half, half), ylim=(-0.3, height))
        axis.set_axis_off()
    figure.savefig(path, dpi=80, bbox_inches="tight")
    plt.close(figure)


# ---------------------------------------------------------------- the flow of one window

LANES = {"dem_liggghts": 0.0, "coupling": 6.6, "mpm_fenicsx": 13.2}  # x of their middle
WIDE = 5.2  # of a box
INK = "#335577"
FLOW = [  # lane, what happens, file; the data of the arrow to the next box
    ("coupling", "where will the wall be?", "loop/window.py, maps", "wall_x, wall_v"),
    ("dem_liggghts", "substeps of the particles\nagainst the moving wall", "reference or liggghts",
     "wall_force"),
    ("coupling", "to the points of the interface", "maps/mapping.py", "force"),
    ("mpm_fenicsx", "points find their cells,\nmass and motion go to the nodes", "points, grid, terms",
     "GridState"),
    ("mpm_fenicsx", "Newton's method: residual and\ntangent of all terms, linear solver",
     "solve, terms, laws", "Trial"),
    ("mpm_fenicsx", "points move and deform,\nthe grid goes back to rest", "terms", "x, v"),
    ("coupling", "accept, repeat, or give up\nand take a shorter window", "loop/iterate.py, loop/ladder.py",
     "Window"),
    ("coupling", "momentum and energy,\nrow of the history, files", "ledger, records", "")]


def draw_box(axis, x, y, what, file):
    """Of one thing that happens, middle at (x, y)."""
    axis.add_patch(FancyBboxPatch((x - 0.5 * WIDE, y - 0.65), WIDE, 1.3, boxstyle="round,pad=0.05", zorder=3,
                                  facecolor="white", edgecolor="#444444"))
    axis.text(x, y + 0.2, what, ha="center", va="center", fontsize=9.5, zorder=4)
    axis.text(x, y - 0.48, file, ha="center", va="center", fontsize=8, color="#666666", zorder=4)


def draw_arrow(axis, start, end, data):
    """From the box in the middle of ``start`` to that of ``end``, with the name of what goes along."""
    (x, y), (u, v) = start, end
    way = (u > x) - (u < x)
    edge = (x + way * (0.5 * WIDE + 0.05), y) if way else (x, y - 0.7)
    bend = "angle,angleA=0,angleB=90,rad=8" if way else "arc3"
    axis.add_patch(FancyArrowPatch(edge, (u, v + 0.7), arrowstyle="-|>", mutation_scale=14, linewidth=1.4,
                                   color=INK, connectionstyle=bend, zorder=3))
    place = (0.5 * (edge[0] + u), y + 0.1) if way else (x + 0.2, 0.5 * (y + v))
    axis.text(*place, data, ha="center" if way else "left", va="bottom" if way else "center", fontsize=9.5,
              color=INK, zorder=5)


def draw_window(path):
    """A lane for each package, time downwards."""
    figure, axis = plt.subplots(figsize=(11, 9.5))
    depth = 2.05 * len(FLOW)
    for package, x in LANES.items():
        axis.add_patch(FancyBboxPatch((x - 3.0, -depth), 6.0, depth + 1.1, boxstyle="round,pad=0.05",
                                      edgecolor="none", facecolor=PACKAGES[package], zorder=1))
        axis.text(x, 0.75, package, ha="center", va="center", fontsize=13, fontweight="bold")
    middles = [(LANES[lane], -2.05 * n - 0.8) for n, (lane, *_) in enumerate(FLOW)]
    for n, ((x, y), (_, what, file, data)) in enumerate(zip(middles, FLOW)):
        draw_box(axis, x, y, what, file)
        if data:
            draw_arrow(axis, (x, y), middles[n + 1], data)
    axis.set(xlim=(-3.2, 16.4), ylim=(-depth - 0.2, 1.4))
    axis.set_axis_off()
    figure.savefig(path, dpi=80, bbox_inches="tight")
    plt.close(figure)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        draw_imports(Path(sys.argv[1]).resolve(), sys.argv[2])
    else:
        draw_imports(ROOT, ROOT / ".images/imports.png")
        draw_window(ROOT / ".images/window.png")
