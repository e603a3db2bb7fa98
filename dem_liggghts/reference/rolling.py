"""Rolling friction at walls: how an element turns, and the forces on its nodes that make a torque.

LIGGGHTS itself leaves both out; liggghts/shim/wall.h does the same as here.
"""
from ..compiled import compiled
from ..search.elements import corners_of


@compiled
def relative_turn(query, e, omega, vectors):
    """Angular velocity omega [rad/s] of a sphere relative to that of element ``e``, into ``vectors.turn``.

    That of the element follows from the velocities of its nodes: of a triangle sum_a l_a (A . v_a), A the
    product of two of its edges and l_a the edge opposite to the node a over A^2; of a segment in the plane
    the same with A the segment turned by 90 degrees and l = -+ e_z / A^2. The rows l_a and A go into
    ``vectors.levers``. A disc does not turn: zero.
    """
    wall, corner, levers, turn = query.wall, query.corner, vectors.levers, vectors.turn
    nodes = wall.elements[e]
    corners_of(wall, e, query.t, corner)
    levers[:] = 0.0
    if len(nodes) == 2:
        levers[3, 0], levers[3, 1] = corner[0, 1] - corner[1, 1], corner[1, 0] - corner[0, 0]
        levers[0, 2], levers[1, 2] = -1.0, 1.0
    else:
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            levers[3, k] = (corner[1, i] - corner[0, i]) * (corner[2, j] - corner[0, j]) - \
                (corner[1, j] - corner[0, j]) * (corner[2, i] - corner[0, i])
            for a in range(3):
                levers[a, k] = corner[(a + 2) % 3, k] - corner[(a + 1) % 3, k]
    size2 = levers[3, 0] ** 2 + levers[3, 1] ** 2 + levers[3, 2] ** 2
    for k in range(3):
        turn[k] = omega[k]
    for a in range(len(nodes)):
        speed = 0.0
        for k in range(3):
            speed += levers[3, k] * wall.v[nodes[a], k]
            levers[a, k] = levers[a, k] / size2 if size2 > 0.0 else 0.0
        for k in range(3):
            turn[k] -= levers[a, k] * speed


@compiled
def add_couple(vectors, share, torque, nodes, moment, on_wall):
    """Add ``share`` of the torque of rolling friction to that on the sphere, and the opposite one to the
    nodes of the element: forces -(l_a . M) A, whose sum is zero and whose power is that of the torque."""
    couple, levers = vectors.couple, vectors.levers
    for k in range(3):
        torque[k] += share * couple[k]
        on_wall.impulse[-2, k] += moment.weight * share * couple[k]
        if moment.last:
            on_wall.force[-2, k] += share * couple[k]
    for a in range(len(nodes)):
        size = 0.0
        for k in range(3):
            size += share * levers[a, k] * couple[k]
        for k in range(3):
            on_wall.impulse[nodes[a], k] -= moment.weight * size * levers[3, k]
            if moment.last:
                on_wall.force[nodes[a], k] -= size * levers[3, k]
