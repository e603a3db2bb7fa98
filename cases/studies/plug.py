"""A plug of sand strikes the cube of the flume at a known speed and depth: what its force consists of.

    python cases/studies/plug.py                 the first pulse and the force of the stream, over rho v^2 h w
    python cases/studies/plug.py E=1e6           softer sand: slower waves
    python cases/studies/plug.py width=6         more room beside the cube
"""
import sys
from pathlib import Path
from typing import Dict

from coupling import History, Output, Run, Steps, case
from mpm_fenicsx import MPM, Body, Box, Grid, Soil, Structure, Terrain

sys.path.insert(0, str(Path(__file__).parents[1]))
from references import flume as reference  # noqa: E402

FIRST, STREAM = 0.06, (0.1, 0.2)  # the first pulse is over; the force is that of the stream [s]


@case()
def main(
    h: float = 0.4,  # size of the background cells [m]
    soil: Soil = Soil(E=1e7, nu=0.3, rho=1700.0, phi=40.0, law="drucker_prager"),
    v: float = 26.0,  # of the plug [m/s]
    depth: float = 0.8,  # of the plug [m]
    length: float = 8.0,  # of the plug [m]
    width: float = 2.0,  # of the flume [m]
    across: float = 1.0,  # width of the cube, in the middle of the flume [m]
    scheme: Steps = Steps(dt=4e-3, t_end=0.32),
    output: Output = Output(Path("out/plug")),
) -> Run:
    """Force on the cube over that of a stream whose momentum it takes, in the first pulse and after it."""
    plug = Box((79.5 - length, 0.0, 0.0), (79.5, width, depth))
    body = Body(plug, Grid.counts(tuple(plug.size), h), 2, soil.material(3), soil.rho, f_bar=True,
                velocity=(v, 0.0, 0.0))
    start = 70.0 - max(length - 8.0, 0.0)
    ground = Terrain.function(reference.bed, Box((start, -h), (reference.END, width + h)), h)
    sides = Box((start, -h, -1.0), (reference.SIDES, width + h, 5.0))
    left = 0.5 * (width - across)
    cube = Box((reference.FRONT, left, 0.0), (reference.FRONT + 1.0, left + across, reference.HIGH))
    structures = [ground.structure("bed"), Structure.plane("left", (0.0, 0.0, 0.0), "+y", sides),
                  Structure.plane("right", (0.0, width, 0.0), "-y", sides), Structure.box("cube", cube)]
    solid = MPM(ground.grid(h, above=5.0), body, gravity=reference.GRAVITY, inertia="lumped",
                structures=structures, outflow="remove")
    coming = soil.rho * v**2 * depth * across

    def compare(histories: Dict[str, History]) -> Dict[str, float]:
        (history,) = histories.values()
        time, force = history["time"], history["force_soil_cube_x"] / coming
        stream = (time > STREAM[0]) & (time < STREAM[1])
        return {"first_pulse": float(force[time < FIRST].max(initial=0.0)),
                "stream": float(force[stream].mean()) if stream.any() else float("nan")}

    return Run("plug", solid, None, scheme, output, errors=compare)


if __name__ == "__main__":
    main.run()
