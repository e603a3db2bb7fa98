"""Named physical groups in Gmsh's files: of those meshio keeps one for each entity and one for each name.

An entity (point, curve, surface or volume of the geometry) may belong to several groups, and a number or a
name may stand for one group in each dimension. Files of version 2 repeat an element for each of its groups
instead; there the number is at the element. A minus before a number turns the element round, the group is the
same.
"""
import re
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np


class Groups(NamedTuple):
    """names: (dimension, number of the group) → name; entities: (dimension, entity) → numbers of its groups,
    or None in a file of version 2, whose elements have the numbers themselves."""

    names: dict
    entities: Optional[dict]


def read_groups(path: Path) -> Optional[Groups]:
    """The ``Groups`` of the file, None of one not by Gmsh. ValueError for a section that is cut."""
    with open(path, "rb") as file:
        data = file.read()
    head = re.search(rb"^\$MeshFormat\s*\n\s*(\d+)\.?(\d*)\s+(\d)\s+(\d+)", data, re.MULTILINE)
    if head is None:
        return None
    version, binary, size = int(head[1]), int(head[3]), int(head[4])
    names = {}
    for line in _section(data, b"PhysicalNames").decode("utf-8", "replace").splitlines()[1:]:
        found = re.match(r"\s*(\d+)\s+(-?\d+)\s+\"(.*)\"", line)
        if found:
            names[int(found[1]), abs(int(found[2]))] = found[3]
    if version < 4:
        return Groups(names, None)
    box_of_point = 6 if head[2] == b"0" else 3  # version 4.0, or 4 and 4.1
    return Groups(names, _entities(_section(data, b"Entities"), binary, size, box_of_point))


def _section(data: bytes, name: bytes) -> bytes:
    """What stands between $name and $Endname, b"" when there is no such section."""
    start = re.search(rb"^\$" + name + rb"[ \r]*\n", data, re.MULTILINE)
    end = data.rfind(b"$End" + name)
    return data[start.end():end] if start and end >= 0 else b""


def _entities(section: bytes, binary: int, size: int, box_of_point: int) -> Dict[Tuple[int, int], List[int]]:
    """(dimension, entity) → numbers of its physical groups. size: bytes of a size_t; box_of_point: numbers
    that say where a point is, of other entities 6."""
    if not section:
        return {}
    tokens, place = section.split(), 0
    entities: Dict[Tuple[int, int], List[int]] = {}
    kinds = {"int": np.dtype("i4"), "size": np.dtype(f"u{size}"), "real": np.dtype("f8")}

    def take(kind: str, count: int) -> np.ndarray:
        nonlocal place
        start = place
        if binary:
            place += count * kinds[kind].itemsize
            return np.frombuffer(section, kinds[kind], count, start)
        place += count
        return np.array([] if kind == "real" else tokens[start:place], int)

    for dim, number in enumerate(take("size", 4).tolist()):
        for _ in range(number):
            entity = int(take("int", 1)[0])
            take("real", box_of_point if dim == 0 else 6)
            entities[dim, entity] = np.abs(take("int", int(take("size", 1)[0]))).tolist()
            if dim:
                take("int", int(take("size", 1)[0]))  # what bounds it
    return entities
