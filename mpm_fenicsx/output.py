"""What the MPM shows to ParaView: name → (positions, {cell type: connectivity}, data), on rank 0 whole."""
import numpy as np

from .mesh import corner_volumes

AROUND = {"triangle": ("triangle", [0, 1, 2]), "quadrilateral": ("quad", [0, 1, 3, 2]),
          "tetrahedron": ("tetra", [0, 1, 2, 3]), "hexahedron": ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6])}


def snapshot(mpm):
    """Points, background grid (nodal fields of the last step) and interface. Collective; empty but on rank 0."""
    points, comm = mpm.points, mpm.comm
    fields = {"x": points.x, "gid": points.gid, "velocity": points.v, "acceleration": points.a, "mass": points.mass,
              "F": points.F, "cauchy_stress": mpm.cauchy_stress()}
    fields |= {name: points.state[name] for name in points.state.dtype.names if name != "unused"}
    whole = {name: _gather(comm, values) for name, values in fields.items()}
    nodal = _gather_nodes(mpm)
    x, v = mpm.surface()
    if comm.rank != 0:
        return {}
    order = np.argsort(whole["gid"])
    whole = {name: values[order] for name, values in whole.items()}
    vertices, cells = mpm.background.whole
    kind, order = AROUND[mpm.grid.cell]
    cells = cells[:, order]
    if kind in ("triangle", "tetra"):
        turned = corner_volumes(vertices[cells], mpm.grid.cell)[:, 0] < 0
        cells[turned, -2:] = cells[turned, -2:][:, ::-1]
    positions = whole.pop("x")
    elements = np.empty((0, 2), int) if mpm.interface is None else mpm.interface.elements
    start = x if mpm.interface is None else mpm.interface.x
    return {"points": (positions, {"vertex": np.arange(len(positions))[:, None]}, whole),
            "grid": (vertices, {kind: cells}, nodal),
            "interface": (x, {"line" if mpm.dim == 2 else "triangle": elements}, {"velocity": v, "displacement": x - start})}


def _gather(comm, values):
    parts = comm.gather(values)
    return np.concatenate(parts) if comm.rank == 0 else None


def _gather_nodes(mpm):
    """Nodal mass and velocity on the vertices of the whole grid."""
    background, cover, D = mpm.background, mpm.step.cover, mpm.dim
    if not mpm.steps:
        local = (np.zeros(0, int), np.zeros(0), np.zeros((0, D)))
    else:
        own = cover.node[:cover.owned]
        local = (background.vertex_of[own], mpm.step.mass[:cover.owned], mpm.step.v[:cover.owned])
    parts = mpm.comm.gather(local)
    if mpm.comm.rank != 0:
        return None
    mass, velocity = np.zeros(len(background.whole[0])), np.zeros((len(background.whole[0]), D))
    for number, m, v in parts:
        mass[number], velocity[number] = m, v
    return {"mass": mass, "velocity": velocity}
