"""What the MPM shows to ParaView and writes into the report.

A snapshot is name → (positions, {cell type: connectivity}, data) of this rank alone: the pieces of all ranks
make the whole, so the state of the points never has to fit on one of them. A name is missing where the rank
has nothing to show.
"""
import numpy as np

from ..collective import total
from ..scene.facets import corner_volumes
from .functions import by_vertex

AROUND = {"triangle": ("triangle", [0, 1, 2]), "quadrilateral": ("quad", [0, 1, 3, 2]),
          "tetrahedron": ("tetra", [0, 1, 2, 3]), "hexahedron": ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6])}


def snapshot(mpm):
    """``points`` of this rank; ``held``, ``held1``, …: those of each body that an outflow holds at the edge;
    ``grid``: its own cells, each on one rank only, with nodal fields of the last step; ``interface``: whole,
    on rank 0. Collective."""
    parts = {"points": _points(mpm), "grid": _grid(mpm)}
    for n, held in enumerate(mpm.held()):
        parts[f"held{n or ''}"] = held.x, {"vertex": np.arange(len(held))[:, None]}, {"gid": held.gid,
                                                                                      "mass": held.mass}
    interface = mpm.interface
    if interface is not None:
        (x, v), u = mpm.surface(), mpm.displacement()
        kind = ["vertex", "line", "triangle"][interface.elements.shape[1] - 1]
        if mpm.comm.rank == 0:
            parts["interface"] = x, {kind: interface.elements}, {"velocity": v, "displacement": u}
    return {name: part for name, part in parts.items() if len(part[0])}


def _points(mpm):
    """Points of this rank, body after body in the order of their numbers, see ``Points.migrate``; what is
    held at the edge is not among them."""
    data = _point_fields(mpm.bodies)
    x = data.pop("x")
    return x, {"vertex": np.arange(len(x))[:, None]}, data


def _grid(mpm):
    """Cells and nodes in the order of the whole grid. A node of mass in a cell of this rank is in this rank's
    active cells, for that reaches one layer beyond the filled cells; so nobody has to be asked."""
    background = mpm.background
    vertices, cells = background.whole
    vertices = vertices + background.origin
    own = np.sort(background.original_cell[:background.cells_owned])
    own = cells[own[own < len(cells)]]
    nodes, corners = np.unique(own, return_inverse=True)
    mass, velocity = np.zeros(len(vertices)), np.zeros(vertices.shape)
    if mpm.steps and mpm.step.grid is not None:
        grid = mpm.step.grid
        mass, velocity = by_vertex(background, mpm.step.active_cells, grid.mass, grid.v)
    kind, order = AROUND[mpm.grid.cell]
    corners = corners.reshape(own.shape)[:, order]
    if kind in ("triangle", "tetra"):
        turned = corner_volumes(vertices[own])[:, 0] < 0
        corners[turned, -2:] = corners[turned, -2:][:, ::-1]
    return vertices[nodes], {kind: corners}, {"mass": mass[nodes], "velocity": velocity[nodes]}


def _point_fields(bodies):
    """Fields of this rank's points, body after body, as name → array. State variables that a law does not
    have are zero; ``body`` tells several bodies apart, ``force_cell`` the force cells of named
    ones."""
    shown = {"x": "x", "gid": "gid", "velocity": "v", "acceleration": "a", "mass": "mass", "F": "F"}
    fields = {name: np.concatenate([getattr(body.points, field) for body in bodies])
              for name, field in shown.items()}
    fields["cauchy_stress"] = np.concatenate([body.cauchy_stress() for body in bodies])
    states = [body.points.state for body in bodies]
    for name in dict.fromkeys(name for state in states for name in state.dtype.names if name != "unused"):
        like = next(state[name] for state in states if name in state.dtype.names)
        fields[name] = np.concatenate([state[name] if name in state.dtype.names
                                       else np.zeros((len(state), *like.shape[1:]), like.dtype)
                                       for state in states])
    if hasattr(bodies[0].points, "force_cell"):
        fields["force_cell"] = np.concatenate([body.points.force_cell for body in bodies])
    if len(bodies) > 1:
        fields["body"] = np.repeat(np.arange(len(bodies)), [len(state) for state in states])
    return fields


def describe(mpm):
    """Entries of report.json: ``solver``; ``ghost_since`` [s], and ``helped``, what helped where Newton's
    method failed → [first time [s], number of steps], see ``ladder``; ``imbalance``, most
    points on one rank over the mean, now; ``rebalances``, a list of [step, imbalance before, after] of the
    new distributions over the ranks; ``exchanged``, bytes of the interface that the ranks have got from each
    other since the start; ``transfer_losses``, see ``MPM.transfer_losses``, as lists.
    Collective."""
    losses = mpm.transfer_losses and {
        way: {name: np.asarray(value).tolist() for name, value in sums.items()}
        for way, sums in mpm.transfer_losses.items()}
    return {"transfer_losses": losses, "solver": mpm.step.newton.describe(), "ghost_since": mpm.ghost_since,
            "helped": mpm.helped,
            "imbalance": round(mpm.imbalance(), 4),
            "exchanged": int(total(mpm.comm, mpm.exchanged)),
            "rebalances": [[step, round(before, 4), round(after, 4)]
                           for step, before, after in mpm.rebalances]}
