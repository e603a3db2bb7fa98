"""The stack of wooden blocks that the granular column of Singer et al. 2022 meets."""
import math
from dataclasses import dataclass
from typing import Tuple

import mpm_dem_checks as check
from dem_liggghts import Cluster, Interaction, Material, Scene, Spheres, Wall, check_size, critical_step

WOOD, WOOD_RHO = Material(50e6, 0.5), 500.0  # table 1 of the paper [kg/m^3]


@dataclass(frozen=True)
class Stack:
    """Blocks one on the other, the lowest one fixed, on a floor at y = 0. ValueError for impossible ones."""

    restitution: float = 0.05  # of blocks with each other and the floor [-]
    adhesion: float = 30.0  # of blocks with each other; with the floor it is twice that [Pa]
    blocks: int = 3  # in the stack, of which the lowest is fixed [-]
    block: Tuple[float, float] = (0.02, 0.018)  # width and height of one [m]
    spheres: int = 8  # in a block along each side [-]
    at: float = 0.30  # left faces of the blocks [m]

    def __post_init__(self) -> None:
        check.count("blocks", self.blocks)
        check.count("spheres", self.spheres, 2)
        check.not_negative("adhesion", self.adhesion, "Pa")
        check.numbers("block", self.block, 2, "m", check.positive)
        check.not_negative("at", self.at, "m")

    @property
    def known(self) -> bool:
        """Whether this is the stack of the paper."""
        return (self.blocks, self.block, self.at) == (Stack.blocks, Stack.block, Stack.at)

    @property
    def sphere(self) -> float:
        """Largest distance of the spheres of a block [m]."""
        return max(self.block) / self.spheres

    def check_steps(self, depth: float, inner: float, substeps: int) -> None:
        """ValueError for blocks of ``depth`` [m] that are too light, or whose spheres need much shorter steps
        of the DEM than ``inner`` [s]; what a scene says itself takes time to build."""
        mass = WOOD_RHO * depth * math.prod(self.block)
        for name, value, unit in (("mass", mass, "kg"),
                                  ("inertia", mass * math.hypot(*self.block)**2 / 12, "kg m^2")):
            check.positive(f"{name} of a block (block, depth)", value, unit)
        radius = 0.5 * self.sphere
        one = Spheres([[0.0, 0.0]], [[0.0, 0.0]], radius, WOOD_RHO)
        limit = min(critical_step(Scene(one, material=WOOD)))
        if inner > 100.0 * limit:
            raise ValueError(f"spheres is {self.spheres}: spheres of {radius:.3g} m need DEM steps of about "
                             f"{limit:.3g} s, take fewer of them or more substeps")
        check_size(self.blocks * self.spheres**2, f"blocks={self.blocks} spheres={self.spheres}", substeps)

    def scene(self, soil: Wall, surface: Material, touch: Interaction, depth: float, length: float,
              gravity: float) -> Scene:
        """The blocks of ``depth`` [m] on a floor of ``length`` [m], and the moving wall of the soil, whose
        ``surface`` they ``touch``; gravity: downward [m/s^2]."""
        (width, height), counts = self.block, (self.spheres, self.spheres)
        stack = [Cluster.box(self.block, counts, (self.at + width / 2, (k + 0.5) * height), WOOD_RHO, depth,
                             free=k > 0, material="wood") for k in range(self.blocks)]
        floor = Wall([[0.0, 0.0], [length, 0.0]], [[0, 1]], material="floor")
        meet = {("wood", "wood"): Interaction(self.restitution, 0.6, self.adhesion),
                ("wood", "floor"): Interaction(self.restitution, 0.3, 2 * self.adhesion),
                ("wood", "soil"): touch}
        return Scene(wall=soil, clusters=tuple(stack), walls=(floor,), gravity=(0.0, -gravity),
                     interactions=meet, materials={"wood": WOOD, "floor": WOOD, "soil": surface})
