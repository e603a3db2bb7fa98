"""Windows that a run chooses: which limit counts, that points cross no more than they may, that it goes
on."""
import numpy as np
import pytest

from coupling import Output, Run, Scheme, Steps, march
from coupling.automatic import choose_window
from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from mpm_fenicsx import MPM, Body, Box, Grid, Support, linear, of_points

H = 0.1


def block(g=10.0, v=0.0, fall=0.4, interface=False):
    body = Body(Box((0.0, fall), (0.2, fall + 0.2)), (2, 2), 2, linear(1e5, 0.3), 1000.0, velocity=(0.0, -v))
    grid = Grid(Box((-0.2, 0.0), (0.4, fall + 0.4)), (6, round(10 * fall) + 4))
    return MPM(grid, body, [Support(lambda x: x[:, 1] < 1e-9, "xy")], of_points(body) if interface else None,
               gravity=(0.0, -g), inertia="lumped")


def rock(solid, E=1e5):
    at = 0.05 + 0.025 + solid.interface.x[:, 1].max()
    ball = Spheres([(0.1, at)], [(0.0, 0.0)], 0.05, 2600.0)
    return Scene(ball, Wall.discs(solid.interface.x, 0.025), Material(1e9, 0.3), Material(E, 0.3),
                 at_wall=Interaction(1.0, 0.3), gravity=(0.0, -10.0))


def test_the_smallest_limit_counts(capsys):
    solid, t_end = block(), 0.4
    expected = 0.5 * H / np.sqrt(2.0 * 10.0 * 0.6)  # from the highest place to the floor
    chosen = choose_window(Steps(None, t_end), solid, None)
    assert chosen.dt <= expected < t_end / (round(t_end / chosen.dt) - 1) and chosen.courant == 0.5
    assert "cross 0.5 of a cell in 0.014 s" in capsys.readouterr().out
    assert choose_window(Steps(None, t_end, speed=10.0), solid, None).dt == pytest.approx(0.5 * H / 10.0)
    waves = choose_window(Steps(None, t_end, waves=1.0), solid, None).dt
    assert waves <= solid.resolution()["explicit_limit"] < 1.1 * waves
    given = Steps(1e-3, t_end)
    assert choose_window(given, solid, None) is given
    solid.close()


def test_contact_and_its_steps():
    solid = block(interface=True)
    grains = rock(solid)
    chosen = choose_window(Scheme(None, 0.4), solid, grains)
    rule = grains.contact_rule(solid.contact_scales(), solid.contact_scales().speed)
    assert chosen.dt <= rule.window and chosen.inner <= rule.inner and chosen.substeps in 2 ** np.arange(12)
    stiff = grains.fitted(solid.contact_scales(), 1.0)
    weak, repeated = (choose_window(Scheme(None, 0.4, iterate=n, speed=1.0), solid, stiff) for n in (0, 20))
    assert weak.dt <= stiff.contact_rule(solid.contact_scales(), 1.0).window < 0.3 * repeated.dt
    solid.close()


def test_points_cross_half_a_cell_at_most():
    """A block that falls: steps of the length that a slow one bears become shorter as it gets faster."""
    solid, speeds = block(fall=2.0), []
    march(solid, Steps(0.05, 0.5, courant=0.5), [lambda step: speeds.append((step.dt, solid.fastest()))])
    dt, speed = np.array(speeds).T
    before = np.concatenate([[0.0], speed[:-1]])  # at the start of a step
    assert (dt * before <= 0.5 * H * (1 + 1e-9)).all() and dt.max() == 0.05 and dt.min() == 0.05 / 8
    assert speed[-1] == pytest.approx(5.0, rel=1e-6)
    solid.close()


def test_a_run_without_dt_goes_on(tmp_path):
    def run(t_end, **more):
        solid = block(v=-1.0, interface=True)
        grains = rock(solid).fitted(solid.contact_scales(), 1.0)
        return Run("fall", solid, grains, Scheme(None, t_end, speed=2.0), Output(tmp_path, **more))

    first = run(0.04, checkpoint="end").go()["reference"]
    assert 0.0 < first["deepest_ball"].max() < 0.1 and len(first["time"]) > 5
    (tmp_path / "report.json").read_text().index('"deepest_ball"')
    run(0.08, restart=tmp_path).go()


def test_a_soft_contact_is_warned_of(tmp_path):
    solid = block(v=-2.0, interface=True)
    with pytest.warns(UserWarning, match="spacing deep in the balls of the soil"):
        Run("fall", solid, rock(solid, E=3e3), Scheme(1e-3, 0.1, substeps=10), Output(tmp_path)).go()


def test_bad_input():
    solid = block(g=0.0)
    with pytest.raises(ValueError, match="dt is none, and nothing limits the window"):
        choose_window(Steps(None, 0.1), solid, None)
    with pytest.raises(ValueError, match="dt is none, and only a Run chooses"):
        march(solid, Steps(None, 0.1))
    with pytest.raises(ValueError, match="courant"):
        Steps(1e-3, 0.1, courant=-1.0)
    solid.close()
