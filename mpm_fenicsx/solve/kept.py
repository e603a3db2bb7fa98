"""What a step keeps from the one before, by numbers of the whole grid, see ``numbered``: active nodes, the
weights of a ghost penalty and the tangent."""
import numpy as np

from mpm_dem_store import Table

from .tangents import Tangent


def get_checkpoint(step, numbered):
    """Of ``step``, a ``step.Step``, as name → value or ``Table``. Collective."""
    tangents, cells, ghost = step.tangents, step.active_cells, step.ghost
    dt, idle_scale, stiffness2, ratio, excess = tangents.now
    tree = {"filled": numbered.cells(step.filled),
            "nodes": numbered.nodes(cells, active=step.active, mass_then=step.equations.mass_then),
            "solver": step.newton.linear.preset, "kept": tangents.holds,
            "tangent": {"dt": dt, "idle_scale": idle_scale, "stiffness_over_inertia": ratio, "excess": excess,
                        "stiffness2": Table({"part": np.array([stiffness2])})}}
    if tangents.holds:
        tree["matrix"] = numbered.matrix(cells)
    step.newton.linear.forget_factors()  # as after ``set_checkpoint``, so that both go on alike
    if ghost:
        tree["ghost"] = {"facets": numbered.facets(ghost.cells, weight=ghost.weight), "of_u": ghost.of_u}
    return tree


def set_checkpoint(step, tree, numbered):
    """Go back to what ``get_checkpoint`` gave; the ``step`` is on the same cells. Collective."""
    nodes = numbered.take_nodes(step.active_cells, tree["nodes"])
    step.active = nodes["active"][:, 0] > 0.0
    step.equations.remember(nodes["mass_then"][:, 0].copy())
    if step.ghost:
        weight = numbered.take_facets(step.ghost.cells, tree["ghost"]["facets"])["weight"]
        step.ghost.weight, step.ghost.of_u = weight, tree["ghost"]["of_u"]
    kept, now = tree["kept"], tree["tangent"]
    if kept:
        numbered.take_matrix(step.active_cells, tree["matrix"])
    step.newton.linear.choose_again(tree["solver"])
    step.tangents.take(Tangent(now["dt"], now["idle_scale"], float(now["stiffness2"].fields["part"].sum()),
                               now["stiffness_over_inertia"], now.get("excess", 0.0)), kept)
