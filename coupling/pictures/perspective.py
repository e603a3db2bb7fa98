"""Pictures in perspective of spheres, triangles and lines, computed pixel by pixel with a depth buffer.

No screen and no graphics driver is needed, so that a picture is the same on a laptop and on a cluster's node.
Lengths are in whatever unit the scene has, x: places, shape (n, 3); colours are red, green and blue from 0 to
1, shape (n, 3) or (3,).
"""
from typing import NamedTuple, Tuple, Union

import numpy as np

# to the lamp: right, up, towards the eye
LIGHT = np.array([-0.45, 0.65, 0.6]) / np.linalg.norm([-0.45, 0.65, 0.6])
AMBIENT, SHINE = 0.45, 0.25
GREY = np.full(3, 0.7)
SMALL = 12.0  # [pixels] radius up to which spheres are of one kind; beyond, of twice the radius at most
LOT = 100_000  # pixels that are drawn at once
AROUND = np.arange(8) * np.pi / 4
RIM = np.vstack([np.zeros((1, 2)), 0.9 * np.column_stack([np.cos(AROUND), np.sin(AROUND)])])  # of a disc
FINE = 2  # pixels of the buffer per pixel of the picture and direction


class Camera:
    """Looks at the box from ``low`` to ``high``, shape (3,), so that it fills a picture ``width`` pixels
    wide; its ``height`` follows. elevation, azimuth: of the eye [degrees], the latter from ``level_axes``;
    away: of the eye, in diagonals of the box; up: the axis that points upward.

    ``axes``: right, up and back, shape (3, 3); what lies (right, up, back) from the ``eye`` is on pixel
    ``shift`` + ``scale`` (right, -up) / -back, shape (2,), of a buffer of ``height`` x ``width``."""

    def __init__(self, low: np.ndarray, high: np.ndarray, width: int = 900, elevation: float = 20.0,
                 azimuth: float = -62.0, away: float = 2.2, up: int = 1) -> None:
        rise, turn = np.radians((elevation, azimuth))
        ahead, left, upward = level_axes(up)
        back = np.cos(rise) * (np.cos(turn) * ahead + np.sin(turn) * left) + np.sin(rise) * upward
        right = np.cross(upward, back)
        right /= np.linalg.norm(right)
        self.axes = np.array([right, np.cross(back, right), back])
        self.eye = 0.5 * (low + high) + away * np.linalg.norm(high - low) * back
        corners = np.array([[(low, high)[(k >> d) & 1][d] for d in range(3)] for k in range(8)])
        self.scale, self.shift = 1.0, np.zeros(2)
        place = self(corners)[0]
        least, most = place.min(axis=0), place.max(axis=0)
        self.width, margin = FINE * width, 0.02 * FINE * width
        self.scale = (self.width - 2 * margin) / (most[0] - least[0])
        self.height = int((most[1] - least[1]) * self.scale + 2 * margin)
        self.shift = margin - least * self.scale

    @property
    def picture_height(self) -> int:
        """Of the picture [pixels]."""
        return self.height // FINE

    def __call__(self, x: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pixels, shape (n, 2), depths, shape (n,), and pixels per unit of length there."""
        right, up, back = ((x - self.eye) @ self.axes.T).T
        size = self.scale / -back
        return np.column_stack([right * size, -up * size]) + self.shift, -back, size

    def normals(self, vectors: np.ndarray) -> np.ndarray:
        """Directions as the eye sees them: right, up, towards it."""
        return vectors @ self.axes.T


class Spheres(NamedTuple):
    """As the camera sees them: ``centre`` (n, 2) and radius in ``pixels`` (n,) on the picture; ``depth`` (n,)
    and ``radius`` (n,) in units of length; ``colour`` (n, 3)."""

    centre: np.ndarray
    depth: np.ndarray
    radius: np.ndarray
    pixels: np.ndarray
    colour: np.ndarray


class Triangles(NamedTuple):
    """As the camera sees them: ``corner`` (n, 3, 2) on the picture, ``edges`` (n, 2, 2) from the first corner
    and twice the ``area`` (n,) that they span, ``depth`` (n, 3) of the corners, ``colour`` (n, 3)."""

    corner: np.ndarray
    edges: np.ndarray
    area: np.ndarray
    depth: np.ndarray
    colour: np.ndarray


class Canvas:
    """What the ``camera`` sees. Things may be drawn in any order, but see-through ones last."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        self._depth = np.full(camera.height * camera.width, np.inf)
        self._colour = np.ones((camera.height * camera.width, 3))

    def picture(self) -> np.ndarray:
        """Array of shape (height, width, 3)."""
        height, width = self.camera.height // FINE, self.camera.width // FINE
        whole = self._colour.reshape(self.camera.height, self.camera.width, 3)[:height * FINE,
                                                                                 :width * FINE]
        return whole.reshape(height, FINE, width, FINE, 3).mean(axis=(1, 3))

    def depths(self) -> np.ndarray:
        """Of what is seen at each pixel of the buffer, infinite where there is nothing; shape (height *
        width,)."""
        return self._depth

    def _put(self, place: np.ndarray, depth: np.ndarray, colour: np.ndarray, opacity: float = 1.0) -> None:
        """Pixels at ``place``, shape (n, 2), where nothing is in front of them."""
        column, row = place.T
        seen = (column >= 0) & (column < self.camera.width) & (row >= 0) & (row < self.camera.height)
        number, depth, colour = (row * self.camera.width + column)[seen], depth[seen], colour[seen]
        free = depth < self._depth[number]
        if opacity < 1.0:
            self._colour[number[free]] += opacity * (colour[free] - self._colour[number[free]])
            return
        while free.any():  # of several at one pixel the last is written, until none is in front of it
            number, depth, colour = number[free], depth[free], colour[free]
            self._depth[number], self._colour[number] = depth, colour
            free = depth < self._depth[number]

    def spheres(self, x: np.ndarray, radius: Union[float, np.ndarray], colour: np.ndarray) -> None:
        """Shaded spheres, radius: shape (n,). Those of similar size are drawn in lots, from front to back, so
        that the hidden ones, most of a body, can be left out."""
        (centre, depth, size), colour = self.camera(x), np.broadcast_to(colour, x.shape)
        radius = np.broadcast_to(radius, len(x))
        pixels, scene = radius * size, Spheres(centre, depth, radius, radius * size, colour)
        kinds = np.ceil(np.log2(np.maximum(pixels, SMALL) / SMALL))
        for kind in np.unique(kinds):
            chosen = np.flatnonzero(kinds == kind)
            chosen = chosen[np.argsort(depth[chosen], kind="stable")]
            reach = int(np.ceil(pixels[chosen].max()))
            lots = 1 + len(chosen) * (2 * reach + 1) // LOT
            for lot in np.array_split(chosen, lots):
                self._lot(lot[~self._hidden(lot, scene)], scene, reach)

    def _hidden(self, chosen: np.ndarray, scene: "Spheres") -> np.ndarray:
        """Mask of the ``chosen`` spheres in front of whose middle and rim something has been drawn."""
        front, hidden = scene.depth[chosen] - scene.radius[chosen], np.ones(len(chosen), bool)
        for arm in RIM:
            at = scene.centre[chosen] + scene.pixels[chosen, None] * arm
            column, row = np.rint(at).astype(int).T
            seen = (column >= 0) & (column < self.camera.width) & (row >= 0) & (row < self.camera.height)
            number = np.where(seen, row * self.camera.width + column, 0)
            hidden &= ~seen | (self._depth[number] < front)
        return hidden

    def _lot(self, chosen: np.ndarray, scene: "Spheres", reach: int) -> None:
        """The pixels of the ``chosen`` spheres, column by column of each, up to ``reach`` from the
        middles."""
        span = np.arange(-reach, reach + 1)
        middle, owner = np.rint(scene.centre[chosen]).astype(int), np.repeat(chosen, len(span))
        for right in span if len(chosen) else ():
            place = np.stack(np.broadcast_arrays(middle[:, :1] + right, middle[:, 1:] + span), axis=-1)
            place = place.reshape(-1, 2)
            off = (place - scene.centre[owner]) / np.maximum(scene.pixels[owner], 0.5)[:, None]
            height2 = 1.0 - (off**2).sum(axis=1)
            on = height2 > 0.0
            own, normal = owner[on], np.column_stack([off[on, 0], -off[on, 1], np.sqrt(height2[on])])
            self._put(place[on], scene.depth[own] - scene.radius[own] * normal[:, 2],
                      shaded(scene.colour[own], normal))

    def triangles(self, x: np.ndarray, elements: np.ndarray, colour: np.ndarray,
                  opacity: float = 1.0) -> None:
        """Shaded on both sides; elements: shape (m, 3). Those of similar size are drawn in lots."""
        place, depth, _ = self.camera(x)
        normal = unit(self.camera.normals(normals(x, elements)))
        normal *= np.where(normal[:, 2:] > 0, 1.0, -1.0)
        colour = shaded(np.broadcast_to(colour, (len(elements), 3)), normal)
        corner, depth = place[elements], depth[elements]
        edges = corner[:, 1:] - corner[:, :1]
        area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        low = np.maximum(np.ceil(corner.min(axis=1)).astype(int), 0)
        high = np.minimum(np.floor(corner.max(axis=1)).astype(int),
                          (self.camera.width - 1, self.camera.height - 1))
        span = high - low + 1  # pixels along both directions
        seen = np.flatnonzero((span > 0).all(axis=1) & (np.abs(area) > 1e-9))
        kinds = np.ceil(np.log2(np.maximum(span.max(axis=1), SMALL) / SMALL))
        for kind in np.unique(kinds[seen]):
            chosen = seen[kinds[seen] == kind]
            for lot in np.array_split(chosen, 1 + int(span[chosen].prod(axis=1).max()) * len(chosen) // LOT):
                width, height = span[lot].max(axis=0, initial=1)
                rows = max(1, LOT // (int(width) * max(len(lot), 1)))
                for row in range(0, int(height), rows):
                    self._faces(Triangles(corner[lot], edges[lot], area[lot], depth[lot], colour[lot]),
                                low[lot] + [0, row], (width, rows), opacity)

    def _faces(self, some: "Triangles", low: np.ndarray, span: Tuple[int, int], opacity: float) -> None:
        """The pixels of ``some`` triangles, out of the columns and rows of the ``span`` from ``low`` on."""
        column, row = (a.ravel() for a in np.meshgrid(np.arange(span[0]), np.arange(span[1])))
        place = low[:, None] + np.column_stack([column, row])
        off, (one, two) = place - some.corner[:, :1], np.moveaxis(some.edges[:, :, None], 1, 0)
        s = (off[..., 0] * two[..., 1] - off[..., 1] * two[..., 0]) / some.area[:, None]
        t = (off[..., 1] * one[..., 0] - off[..., 0] * one[..., 1]) / some.area[:, None]
        on = (s >= 0) & (t >= 0) & (s + t < 1)
        s, t, own = s[on], t[on], np.nonzero(on)[0]
        # linear on the picture, unlike depth
        inverse = ((1 - s - t) / some.depth[own, 0] + s / some.depth[own, 1] + t / some.depth[own, 2])
        self._put(place[on], 1.0 / inverse, some.colour[own], opacity)

    def lines(self, starts: np.ndarray, ends: np.ndarray, colour: np.ndarray, opacity: float = 1.0) -> None:
        """Two pixels wide, straight ways from starts to ends, shape (n, 3) both."""
        for a, b in zip(starts, ends):
            t = np.linspace(0.0, 1.0,
                            2 + int(np.abs(np.diff(self.camera(np.array([a, b]))[0], axis=0)).max()))[:,
                                                                                                       None]
            place, depth, _ = self.camera((1 - t) * a + t * b)
            for shift in ((0, 0), (1, 0), (0, 1)):
                self._put(np.rint(place).astype(int) + shift, depth, np.broadcast_to(colour, (len(t), 3)),
                          opacity)


def shaded(colour: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Colours under the lamp, of surfaces with these normals as the eye sees them, shape (n, 3) both."""
    light = np.clip(normal @ LIGHT, 0.0, 1.0)[:, None]
    glance = np.clip(normal @ ((LIGHT + [0, 0, 1]) / np.linalg.norm(LIGHT + [0, 0, 1])), 0.0, 1.0)[:,
                                                                                                   None] ** 30
    return np.clip(colour * (AMBIENT + (1.0 - AMBIENT) * light) + SHINE * glance, 0.0, 1.0)


def level_axes(up: int) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two level directions, the second to the left of the first, and upward, where the axis ``up`` points
    upward."""
    ahead, upward = np.eye(3)[0 if up else 1], np.eye(3)[up]
    return ahead, np.cross(upward, ahead), upward


def normals(x: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Normals of triangles, as long as twice their area, to the side that sees them counter-clockwise."""
    a, b, c = (x[column] for column in elements.T)
    return np.cross(b - a, c - a)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Of length one, but for zeros."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def edges_of(low: np.ndarray, high: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Starts and ends of the twelve edges of a box."""
    corner = np.array([[(low, high)[(k >> d) & 1][d] for d in range(3)] for k in range(8)])
    pairs = [(k, k | 1 << d) for k in range(8) for d in range(3) if not (k >> d) & 1]
    return corner[[a for a, _ in pairs]], corner[[b for _, b in pairs]]


def radius_of_points(x: np.ndarray) -> float:
    """A bit more than half the usual distance between neighbours: spheres of this radius hide what is inside
    a body."""
    from scipy.spatial import cKDTree  # takes time to import, and few runs need it

    some = x[::max(1, len(x) // 2000)]
    return 0.62 * float(np.median(cKDTree(x).query(some, k=2)[0][:, 1])) if len(x) > 1 else 1.0
