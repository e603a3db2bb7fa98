"""Bad input of scenes with clusters: one clear sentence with the value and the remedy."""
import numpy as np
import pytest

from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, check_start, quaternion

WOOD = Material(5e7, 0.3)


def block(x=(0.0, 0.05), **more):
    return Cluster.box((0.02, 0.018), (8, 8), x, 500.0, 0.1, **more)


def scene(*clusters, **more):
    floor = Wall([[-0.3, 0.0], [0.3, 0.0]], [[0, 1]])
    return Scene(clusters=clusters, wall=floor, material=WOOD, wall_material=WOOD, **more)


@pytest.mark.parametrize("make, message",
                         [(lambda: Cluster.box((1, 1), (8, 8), (0, 0), 1.0), "depth is None m: a solid box "
                           "in a plane scene needs its depth"),
                          (lambda: Cluster.box((1, 1), (1, 8), (0, 0), 1.0, 1.0),
                           "at least two spheres along each"),
                          (lambda: Cluster.box((1, 0.1), (2, 2), (0, 0), 1.0, 1.0),
                           r"spheres of radius 0.25 m do not fit into a box"),
                          (lambda: Cluster.box((1, 1), (2, 2), (0, 0), 1.0, mass_of="air"),
                           "mass_of is 'air': choose one of solid, spheres"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0), -1.0, 1.0), "mass of the cluster is -1.0 "
                           "kg: it must be positive"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0), 1.0, [1.0, 1.0, 1.0]),
                           r"inertia of the cluster has shape \(3,\): give a number"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0), 1.0, -1.0), "inertia of the cluster is "
                           "-1.0: it must be symmetric and positive"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0, 0), 1.0, 1.0), "x of the cluster has shape"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0), 1.0, 1.0, free=(1, 1)),
                           r"free of the cluster is \(1, 1\): give one truth value, or 3"),
                          (lambda: Cluster([[0, 0]], 0.1, (0, 0), 1.0, 1.0, omega=(1, 0, 0)),
                           "a plane body spins about the third axis only"),
                          (lambda: Cluster([[0, 0, 0]], 0.1, (0, 0, 0), 1.0, [1, 1, 1], omega=2.0),
                           "give a number in a plane, three in space"),
                          (lambda: Cluster([[0, 0, 0]], 0.1, (0, 0, 0), 1.0, [1, 1, 1],
                                           quaternion=(1, 1, 0, 0)), r"of norm 1"),
                          (lambda: Interaction(adhesion=-1.0),
                           "adhesion is -1.0 Pa: it must not be negative"),
                          (lambda: Wall([[0, 0], [1, 0]], [[0, 1]], depth=-1.0),
                           "depth of the wall is -1.0 m: give none, or how far"),
                          (lambda: scene(block(material="glass")),
                           r"there is no material 'glass' in the scene: it has \['spheres', 'wall'\]"),
                          (lambda: scene(block(material="oak"), materials={"oak": WOOD}),
                           "no interaction says how 'oak' meets 'wall': add one"),
                          (lambda: scene(block(), interactions={("spheres", "wal"): Interaction(0.3)}),
                           "interactions say how spheres and wal meet, and the scene has no material "
                           "'wal': give names out of spheres, wall"),
                          *((lambda key=key: scene(block(), interactions={key: Interaction(0.3)}),
                             "a key of interactions is .*: give a pair of names of materials, such as")
                            for key in ("wall", ("wall",), ("wall", "wall", "spheres"), ("wall", 3), 3,
                                        frozenset())),
                          (lambda: scene(Cluster([[0, 0, 0]], 0.1, (0, 0, 0), 1.0, [1, 1, 1])),
                           r"dimensions \[2, 3\]: use one dimension"),])
def test_nonsense_values(make, message):
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def test_clusters_that_overlap(dem):
    dem(scene(block(), block((0.02, 0.05))), 1e-6)
    with pytest.raises(ValueError,
                       match=r"cluster 1 \(its sphere \d+\) and cluster 2 \(its sphere \d+\) overlap "
                       "by 0.001 m at the start: move them apart"):
        dem(scene(block(), block((0.019, 0.05))), 1e-6)
    with pytest.raises(ValueError, match=r"sphere 1 and cluster 1 .* overlap by"):
        dem(scene(block(), spheres=Spheres([[0.01, 0.05]], [[0, 0]], 1e-3, 500.0)), 1e-6)


def test_cluster_inside_the_body_or_in_a_wall(dem):
    with pytest.raises(ValueError,
                       match=r"cluster 1 \(its sphere 1\) at .* lies inside the body, .* move it out"):
        dem(scene(block((0.0, -0.05))), 1e-6)
    with pytest.raises(ValueError, match=r"cluster 1 .* overlaps the wall by 0.001 m at the start: move it "
                       r"away"):
        dem(scene(block((0.0, 0.008))), 1e-6)
    side = Wall([[0.0, 0.0], [0.0, 0.2]], [[0, 1]])
    with pytest.raises(ValueError, match=r"cluster 1 .* overlaps fixed wall 1 by"):
        dem(scene(block((-0.0095, 0.05)), walls=[side]), 1e-6)


def test_cluster_in_two_pieces(dem):
    apart = Cluster.of_spheres([[0, 0], [0.02, 0], [0.05, 0]], 0.01, 500.0, (0.0, 0.1))
    with pytest.raises(ValueError,
                       match=r"cluster 1 is in two pieces: its sphere 3 at \[0.05 0.  \] m does not hang "
                       "together with its sphere 1 .*use larger or more spheres"):
        dem(scene(apart), 1e-6)
    check_start(scene(Cluster.of_spheres([[0, 0], [0.02, 0], [0.04, 0]], 0.01, 500.0, (0.0, 0.1))))


@pytest.mark.parametrize("restitution", [0.0, 0.04])
def test_smallest_restitutions(dem, restitution):
    """Nothing that could be seen bounces."""
    dead = dem(scene(block((0.0, 0.0095), v=(0.0, -0.1)), at_wall=Interaction(restitution)), 1e-6)
    nodes = np.array(dead.scene.wall.nodes)
    dead.advance(30000, nodes, 0 * nodes)
    assert abs(dead.bodies()["v"][0, 1]) < 0.006


def test_adhesion_and_a_deep_wall(dem):
    floor = Wall([[-0.3, 0.0], [0.3, 0.0]], [[0, 1]], depth=0.002)
    deep = Scene(clusters=[block()], wall=floor, material=WOOD, wall_material=WOOD,
                 at_wall=Interaction(1, 0, 5.0))
    with pytest.raises(ValueError, match="has adhesion and a depth of 0.002 m: .* the smallest radius, "
                       "0.00125 m"):
        dem(deep, 1e-6)


def test_replacement_that_does_not_fit(dem):
    one = dem(scene(block()), 1e-6)
    with pytest.raises(ValueError, match="the new wall is 3D, the scene 2D"):
        one.replace_wall(Wall(np.eye(3), [[0, 1, 2]]))
    with pytest.raises(ValueError, match="there is no material 'snow' in the scene"):
        one.replace_wall(Wall([[0, 0], [1, 0]], [[0, 1]], material="snow"))


def test_quaternions():
    q = quaternion.of_angle(0.7)
    assert quaternion.angle(q) == pytest.approx(0.7)
    turned = quaternion.matrix(q) @ [1.0, 0.0, 0.0]
    assert turned == pytest.approx([np.cos(0.7), np.sin(0.7), 0.0])
    random = np.random.default_rng(1)
    for p, q in random.normal(size=(20, 2, 4)):
        p, q = p / np.linalg.norm(p), q / np.linalg.norm(q)
        assert quaternion.matrix(quaternion.product(p, q)) == pytest.approx(quaternion.matrix(p)
                                                                            @ quaternion.matrix(q))
        back = quaternion.of_matrix(quaternion.matrix(q))
        assert back == pytest.approx(q if q[0] > 0 else -q)
        assert quaternion.product(q, quaternion.inverse(q)) == pytest.approx([1.0, 0.0, 0.0, 0.0])
