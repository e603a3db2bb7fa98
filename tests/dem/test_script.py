"""The LIGGGHTS commands of a scene, without LIGGGHTS."""
import pytest

from dem_liggghts import Interaction, Material, Scene, Spheres, Wall
from dem_liggghts.liggghts.script import FEW, commands


def scene(dim=2, E=1e7, nu=0.3, wall_E=2e7, count=1, **more):
    floor = Wall([[-1, 0], [1, 0]], [[0, 1]]) if dim == 2 else Wall([[0, 0, 0], [1, 0, 0], [0, 1, 0]],
                                                                    [[0, 1, 2]])
    balls = Spheres([[0.03 * i] + [0.1] * (dim - 1) for i in range(count)], [[0.0] * dim] * count, 0.01,
                    2500.0)
    return Scene(balls, floor, Material(E, nu), Material(wall_E, 0.2), **more)


def line(lines, start):
    found = [text for text in lines if text.startswith(start)]
    assert len(found) == 1, f"{start!r} in {lines}"
    return found[0]


def test_numbers_survive_the_text():
    lines = commands(scene(E=215.82e9 / 3), 1e-7 / 3)
    assert float(line(lines, "timestep").split()[1]) == 1e-7 / 3
    assert [float(w) for w in line(lines, "fix E").split()[-2:]] == [215.82e9 / 3, 2e7]
    assert [float(w) for w in line(lines, "fix nu").split()[-2:]] == [0.3, 0.2]


@pytest.mark.parametrize("E, consent", [(1e7, []), (4.9e6, ["soft"]), (5e6, []), (1e9, []),
                                        (2.16e11, ["hard"])])
def test_stiffness_beyond_the_limits_of_liggghts_needs_consent(E, consent):
    lines = commands(scene(E=E), 1e-7)
    assert [text.split("_")[0] for text in lines if "_particles" in text] == consent
    if consent:
        assert lines.index(f"{consent[0]}_particles yes") < lines.index(line(lines, "fix E"))


def test_stiff_wall_and_soft_spheres_need_both():
    lines = commands(scene(E=1e5, wall_E=1e10), 1e-7)
    assert "soft_particles yes" in lines and "hard_particles yes" in lines


def test_damping_ratio_and_attraction_per_pair():
    meet = dict(between=Interaction(0.05, adhesion=10.0), at_wall=Interaction(0.5))
    lines = commands(scene(**meet), 1e-7)
    ratios = [float(word) for word in line(lines, "fix dampingRatio").split()[-4:]]
    assert ratios == pytest.approx([0.69011, 0.25528, 0.25528, 0.0], abs=1e-5)
    assert line(lines, "fix attraction").split()[-4:] == ["1", "0", "0", "0"]


def test_no_friction_no_history():
    lines = commands(scene(), 1e-7)
    assert "tangential off" in line(lines, "pair_style") and "tangential off" in line(lines, "fix wall")
    lines = commands(scene(at_wall=Interaction(1.0, 0.3)), 1e-7)
    assert "tangential off" in line(lines, "pair_style") and "tangential coulomb" in line(lines, "fix wall")


def test_gravity_in_any_direction_or_none():
    assert not [text for text in commands(scene(), 1e-7) if "gravity" in text]
    words = line(commands(scene(3, gravity=(3.0, 0.0, -4.0)), 1e-7), "fix gravity").split()
    assert [float(w) for w in words[4:5] + words[6:]] == [5.0, 3.0, 0.0, -4.0]


def test_box_holds_the_spheres_at_the_start():
    low_x, high_x, low_y, high_y, low_z, high_z = map(float,
                                                      line(commands(scene(), 1e-7), "region").split()[3:9])
    assert low_x < -0.01 and high_x > 0.01 and low_y < 0.09 and high_y > 0.11 and low_z < 0.0 < high_z


def test_many_spheres_are_searched_with_bins():
    assert line(commands(scene(count=FEW), 1e-7), "neighbor").endswith("nsq")
    assert line(commands(scene(count=FEW + 1), 1e-7), "neighbor").endswith("bin")


def test_negative_poisson_ratio_is_refused():
    with pytest.raises(ValueError, match=r"nu is -0\.1: LIGGGHTS takes .* dem=reference"):
        commands(scene(nu=-0.1), 1e-7)
