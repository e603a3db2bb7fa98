"""Physical groups in Gmsh's files: several of one entity, one name or number in several dimensions, turned
elements."""
import re

import numpy as np
import pytest

from mpm_fenicsx import Interface, read_mesh

NAMES = '$PhysicalNames\n4\n1 1 "soil"\n1 2 "side"\n2 1 "left"\n2 2 "soil"\n$EndPhysicalNames\n'
# Two triangles make a square. The lower one belongs to left and soil, the upper one to soil; the curve below
# to the surface soil and, turned round, to side, the others only to the surface soil.
ENTITIES = """0 3 2 0
1 0.5 0 0 1 0 0 2 1 -2 0
2 0 0 0 0 1 0 1 1 0
3 -0.5 0 0 1 1 0 1 1 2 7 -8
1 0 0 0 1 1 0 2 1 2 0
2 0 0 0 1 1 0 1 2 3 1 2 3
"""
NODES = "1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
ELEMENTS = ("5 6 1 6\n1 1 1 1\n1 1 2\n1 2 1 1\n2 4 1\n1 3 1 2\n3 2 3\n4 3 4\n2 1 2 1\n"
            "5 1 2 3\n2 2 2 1\n6 1 3 4\n")
KINDS_OF_ELEMENTS = {1: 3, 2: 4}  # line and triangle → numbers of one element
VERSION_2 = """$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
9
1 1 2 1 1 1 2
2 1 2 -2 1 2 1
3 1 2 1 2 4 1
4 1 2 1 3 2 3
5 1 2 1 3 3 4
6 2 2 1 1 1 2 3
7 2 2 2 1 1 2 3
8 2 2 2 2 1 3 4
9 15 2 1 1 1
$EndElements
"""


def binary_entities():
    words, out = iter(ENTITIES.split()), b""
    take = lambda kind, n: np.array([next(words) for _ in range(n)], float).astype(kind)  # noqa: E731
    numbers = take("u8", 4)
    for number in numbers:
        for _ in range(number):
            parts = [take("i4", 1), take("f8", 6)]
            for _ in range(2):  # groups, and what bounds it
                count = take("u8", 1)
                parts += [count, take("i4", int(count[0]))]
            out += b"".join(part.tobytes() for part in parts)
    return numbers.tobytes() + out


def binary_nodes():
    words = np.array(NODES.split(), float)
    return (words[:4].astype("u8").tobytes() + words[4:7].astype("i4").tobytes()
            + words[7:12].astype("u8").tobytes() + words[12:].tobytes())


def binary_elements():
    words = list(map(int, ELEMENTS.split()))
    out, place = np.array(words[:4], "u8").tobytes(), 4
    while place < len(words):
        kind, count = words[place + 2:place + 4]
        n = count * KINDS_OF_ELEMENTS[kind]
        out += np.array(words[place:place + 3], "i4").tobytes() + np.array([count,
                                                                            *words[place + 4:place + 4 + n]],
                                                                           "u8").tobytes()
        place += 4 + n
    return out


def write(path, kind):
    if kind == "2.2":
        path.write_text(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{NAMES}{VERSION_2}")
    elif kind == "4.1":
        path.write_text(f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{NAMES}$Entities\n{ENTITIES}$EndEntities\n"
                        f"$Nodes\n{NODES}$EndNodes\n$Elements\n{ELEMENTS}$EndElements\n")
    else:
        path.write_bytes(b"$MeshFormat\n4.1 1 8\n" + np.array(1, "i4").tobytes() + b"\n$EndMeshFormat\n"
                         + NAMES.encode() + b"$Entities\n" + binary_entities() + b"\n$EndEntities\n$Nodes\n"
                         + binary_nodes() + b"\n$EndNodes\n$Elements\n" + binary_elements()
                         + b"\n$EndElements\n")
    return path


@pytest.mark.parametrize("kind", ["2.2", "4.1", "4.1 binary"])
def test_every_group_of_an_element_counts(tmp_path, kind):
    mesh = read_mesh(write(tmp_path / "m.msh", kind), 2)
    np.testing.assert_array_equal(mesh.cells, [[0, 1, 2], [0, 2, 3]])  # each once
    assert {name: sorted(cells) for name, cells in mesh.groups.items()} == {"left": [0], "soil": [0, 1]}
    sides = {name: {frozenset(facet) for facet in facets.tolist()} for name, facets in mesh.surfaces.items()}
    assert sides == {"soil": {frozenset(s) for s in ((0, 1), (3, 0), (1, 2), (2, 3))},
                     "side": {frozenset((0, 1))}}
    assert len(Interface.of_mesh(mesh, "soil").elements) == 4 and len(mesh.part("left").cells) == 1


def test_a_file_that_meshio_cannot_read_names_the_remedy(tmp_path):
    """Elements of groups and others in one file: meshio's arrays then do not fit each other."""
    text = write(tmp_path / "m.msh", "4.1").read_text()
    (tmp_path / "m.msh").write_text(re.sub("\n2 0 0 0 1 1 0 1 2 3", "\n2 0 0 0 1 1 0 0 3", text))
    with pytest.raises(ValueError, match=r"others to none, which meshio cannot read: .*Mesh.SaveAll = 0"):
        read_mesh(tmp_path / "m.msh", 2)
