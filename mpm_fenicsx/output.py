"""What the MPM shows to ParaView: name → (positions, {cell type: connectivity}, data), on rank 0 whole."""
import numpy as np

AROUND = {"triangle": ("triangle", [0, 1, 2]), "quadrilateral": ("quad", [0, 1, 3, 2]),
          "tetrahedron": ("tetra", [0, 1, 2, 3]), "hexahedron": ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6])}


def snapshot(mpm):
    """Points, background grid (nodal fields of the last step) and interface. Collective; empty but on rank 0."""
    comm, fields = mpm.comm, _point_fields(mpm.parts)
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
    positions = whole.pop("x")
    elements = np.empty((0, 2), int) if mpm.interface is None else mpm.interface.elements
    start = x if mpm.interface is None else mpm.interface.x
    return {"points": (positions, {"vertex": np.arange(len(positions))[:, None]}, whole),
            "grid": (vertices, {kind: cells}, nodal),
            "interface": (x, {"line" if mpm.dim == 2 else "triangle": elements}, {"velocity": v, "displacement": x - start})}


def _point_fields(parts):
    """Fields of this rank's points, body after body, as name → array. State variables that a law does not have are
    zero; ``body`` tells several bodies apart."""
    shown = {"x": "x", "gid": "gid", "velocity": "v", "acceleration": "a", "mass": "mass", "F": "F"}
    fields = {name: np.concatenate([getattr(part.points, field) for part in parts]) for name, field in shown.items()}
    fields["cauchy_stress"] = np.concatenate([part.cauchy_stress() for part in parts])
    states = [part.points.state for part in parts]
    for name in dict.fromkeys(name for state in states for name in state.dtype.names if name != "unused"):
        like = next(state[name] for state in states if name in state.dtype.names)
        fields[name] = np.concatenate([state[name] if name in state.dtype.names
                                       else np.zeros((len(state), *like.shape[1:]), like.dtype) for state in states])
    if len(parts) > 1:
        fields["body"] = np.repeat(np.arange(len(parts)), [len(state) for state in states])
    return fields


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
