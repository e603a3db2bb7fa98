"""Whether anything holds the bodies in a load step without inertia.

A group of nodes joined by cells can move as a rigid body. With its rigid motions r_i, scaled to the diagonal
of the tangent K, the smallest eigenvalues of r_i . K r_j belong to the combinations that nothing resists: the
group falls, slides or turns, and there is no equilibrium if the loads do work on them."""
import numpy as np

from ..collective import total
from ..errors import MPMError
from ..grid.joined import join

FREE = 1e-8  # of the diagonal's energy, that of a motion that nothing resists
PUSHED = 1e-6  # of force times motion, the work from which loads drive it


def check_held(background, active_cells, known, grid):
    """MPMError for the first group of nodes that is free to follow its loads, by the tangent in the matrix.
    known: of the equations. Collective."""
    D, n, comm = active_cells.dim, active_cells.owned, active_cells.comm
    count, group = groups(active_cells, grid.mass > 0.0)
    x = background.x[active_cells.node[:n]]
    here = np.flatnonzero(group >= 0)
    sums = lambda values: total(comm, np.bincount(group[here], values[here], count))  # noqa: E731
    size = sums(np.ones(n))
    centre = np.column_stack([sums(x[:, d]) for d in range(D)]) / size[:, None]
    modes = _rigid(x - centre[group], background.h.max())
    modes[:, known.idle | (group < 0)[:, None]] = 0.0
    force = known.load[:n]
    diagonal, products = _products(active_cells, modes)
    if active_cells.pairs:  # groups that touch resist each other: each moves alone
        for g in range(count):
            of_g = group == g
            alone = _products(active_cells, modes * of_g[:, None])[1]
            for product, own in zip(products, alone):
                product[of_g] = own[of_g]
    energy = np.array([[sums(np.sum(a * b, axis=1)) for b in products] for a in modes])
    scale = np.array([sums(np.sum(a * a * diagonal, axis=1)) for a in modes])
    work = np.array([sums(np.sum(a * force, axis=1)) for a in modes])
    most = np.array([sums(np.sum(np.abs(a * force), axis=1)) for a in modes])
    for g in range(count):
        motion = _free_motion(energy[..., g], scale[:, g], work[:, g], most[:, g])
        if motion is not None:
            raise MPMError(f"nothing holds the body around x = {_text(centre[g] + background.origin)} m "
                           f"against its loads, it {_name(motion, D)}: without inertia it needs supports, "
                           "walls that it touches or hinges, or leave out settle")


def groups(active_cells, massive):
    """Number of groups of ``massive`` nodes, mask (nodes,), that cells join, and the group of each owned
    node, -1 of others. Collective."""
    cells = active_cells.cells[active_cells.row >= 0]
    numbers = np.where(massive[cells], active_cells.number[cells], -1)
    cells = np.concatenate(active_cells.comm.allgather(numbers))
    size = active_cells.comm.allreduce(active_cells.owned)
    one = np.broadcast_to(cells.max(axis=1, keepdims=True), cells.shape)  # of each cell's massive nodes
    pairs = np.column_stack([one.ravel(), cells.ravel()])[cells.ravel() >= 0]
    label = join(*pairs.T, size)[1]
    used = np.unique(label[pairs.ravel()])
    number = np.full(size, -1)
    number[used] = np.arange(len(used))
    own = number[label[active_cells.number[:active_cells.owned]]]
    return len(used), np.where(massive[:active_cells.owned], own, -1)


def _rigid(x, h):
    """Displacements of rigid motions at x, (n, D), from the centre of the group [m]: along the axes, then
    around them, in the same unit with the cell h; shape (modes, n, D)."""
    n, D = x.shape
    planes = [(0, 1), (1, 2), (2, 0)][:1 if D == 2 else 3]
    modes = np.zeros((D + len(planes), n, D))
    for d in range(D):
        modes[d, :, d] = 1.0
    for k, (a, b) in enumerate(planes):
        modes[D + k, :, a], modes[D + k, :, b] = -x[:, b] / h, x[:, a] / h
    return modes


def _products(active_cells, modes):
    """Diagonal of the matrix (n, D) and its products with the modes, in their shape."""
    matrix, products = active_cells.matrix, []
    shape = modes.shape[1:]
    x, y = matrix.createVecs()
    for mode in modes:
        x.array_w[:] = mode.ravel()
        matrix.mult(x, y)
        products.append(y.array_r.reshape(shape).copy())
    x.destroy()
    y.destroy()
    return matrix.getDiagonal().array.reshape(shape).copy(), products


def _free_motion(energy, scale, work, most):
    """Of each mode in the motion of one group that its loads drive and nothing resists, the part, scaled to
    the diagonal; None where there is no such motion."""
    chosen = np.flatnonzero(scale > 1e-12 * scale.max(initial=0.0))
    if not len(chosen):
        return None
    root = np.sqrt(scale[chosen])
    values, vectors = np.linalg.eigh(energy[np.ix_(chosen, chosen)] / np.outer(root, root))
    free = vectors[:, values < FREE]
    part = free @ (free.T @ (work[chosen] / root))
    share = part / root
    if not share @ work[chosen] > PUSHED * np.abs(share).max(initial=0.0) * most.max():
        return None
    motion = np.zeros(len(scale))
    motion[chosen] = part / np.linalg.norm(part)
    return motion


def _name(motion, D):
    """What a motion is, in words."""
    turns = np.linalg.norm(motion[D:]) > 0.1
    return "is free to turn" if turns else f"is free to move along {'xyz'[int(np.argmax(np.abs(motion)))]}"


def _text(x):
    return [float(f"{value:.6g}") for value in x]
