"""Runs that are restarted: history, figures' data and report are those of one run, bit for bit."""
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from coupling.records import manifest
from coupling.records.history import read
from coupling.records.writing import OutputError
from mpm_dem_store import StoreError

SCRIPT = Path(__file__).parents[2] / "cases/beam_impact.py"
BLOCKS = dict(h=0.02, dt=1e-3, substeps=50, t_end=0.1, at=0.12, box=(0.3, 0.4), restitution=0.3)
COLUMN = dict(h=0.025, dt=1e-3, t_end=0.05)


@pytest.fixture
def restarted(tmp_path):
    """``restarted(main, keys)``: runs the case with checkpoints, then again from the one before the last, in
    a copy of its folder; checks that both leave the same rows; returns the folders."""
    def both(main, keys):
        first, again = tmp_path / "first", tmp_path / "again"
        main(out=first, **keys)
        shutil.copytree(first, again)
        (again / "checkpoint.h5").unlink()
        main(restart=again)
        assert (first / "history.csv").read_bytes() == (again / "history.csv").read_bytes()
        return first, again

    return both


def report(folder):
    return json.loads((folder / "report.json").read_text())


@pytest.mark.parametrize("keys", [
    dict(), dict(iterate=20, f_bar=True), dict(iterate=20, relax="iqn"), dict(adapt=0.05),
    dict(spread=2e-3, take_out=True, friction=0.3, wall_segments=(37,)), dict(transfer="tpic", basis="gimp")],
    ids=["weak", "aitken", "iqn", "adapt", "spread", "tpic"])
def test_the_beam_goes_on_bit_for_bit(restarted, case, coarse_keys, keys, backend):
    first, again = restarted(case.main, {**coarse_keys, "dem": backend, "checkpoint": "14", **keys})
    old, new = report(first), report(again)
    for name in ("windows", "newton_mean", "coupling_mean", "retries", "errors", "points"):
        assert old[name] == new[name], name
    assert [entry["ranks"] for entry in new["restarts"]] == [1] and "restarts" not in old
    assert 20 < new["restarts"][0]["window"] < new["windows"]
    assert old["checkpoints"]["count"] >= 4 > new["checkpoints"]["count"] >= 1
    assert old["checkpoints"]["bytes"] == (first / "checkpoint.h5").stat().st_size
    assert manifest.read(again).state == "complete"


@pytest.mark.validation
def test_the_beam_in_space_goes_on_bit_for_bit(restarted, case):
    restarted(case.main, dict(dim=3, h=4e-3, points=2, dt=4e-6, substeps=40, t_end=8e-5, checkpoint=8))


@pytest.mark.parametrize("keys", [dict(contact="outline"), dict(contact="points", basis="gimp")],
                         ids=["outline", "points"])
def test_soil_and_blocks_go_on_bit_for_bit(restarted, blocks, keys, backend):
    """A resampled outline, clusters that lie on each other, pictures at given times, an animation."""
    keys = {**BLOCKS, "dem": backend, "checkpoint": 40, "animation": 30, **keys}
    first, again = restarted(blocks.main, keys)
    push = read(first / "history.csv")["push"]
    assert np.abs(push[:80]).max() > 0.0
    for name in ("granular_blocks_flow.gif", "granular_blocks_flow.png", "granular_blocks.png"):
        assert (first / name).read_bytes() == (again / name).read_bytes(), name


def test_a_solid_alone_goes_on_bit_for_bit(restarted, column):
    more = dict(checkpoint="20", losses=True, transfer="tpic", basis="gimp")
    restarted(column.main, {**COLUMN, **more})


def test_paraview_series_are_those_of_one_run(restarted, case, coarse_keys, pieces):
    """Later files than the checkpoint's are removed, written again, and listed once; in another folder the
    earlier ones are copied."""
    first, again = restarted(case.main, {**coarse_keys, "paraview": 5, "checkpoint": 14})
    elsewhere = again.parent / "elsewhere"
    case.main(restart=again, out=elsewhere)
    for folder in (again, elsewhere):
        assert {path.name for path in folder.glob("*.vtu")} == {path.name for path in first.glob("*.vtu")}
        for name in ("points", "interface", "particles", "wall"):
            old, new = (pieces(place, name) for place in (first, folder))
            assert [time for time, _ in old] == [time for time, _ in new]
            assert np.array_equal(old[-1][1][None].points, new[-1][1][None].points)
    assert (elsewhere / "history.csv").read_bytes() == (first / "history.csv").read_bytes()


def test_both_back_ends_go_on(case, coarse_keys, tmp_path, liggghts):
    """Of a comparison the first back end is done when the second one is interrupted."""
    keys = {**coarse_keys, "dem": "compare", "checkpoint": 14}
    straight = case.main(out=tmp_path, **keys)
    (tmp_path / "checkpoint.h5").unlink()
    again = case.main(restart=tmp_path)
    for name in ("liggghts", "reference"):
        assert np.array_equal(straight[name]["force"], again[name]["force"])
    assert "back_ends" in report(tmp_path)["errors"] and report(tmp_path)["restarts"][0]["window"] == 42


def test_a_run_goes_on_beyond_its_end(case, coarse_keys, tmp_path):
    """From the checkpoint at its end, with longer windows in the place of some; a second time nothing is left
    to do."""
    keys = dict(coarse_keys, t_end=1e-4)
    case.main(out=tmp_path / "short", **keys, checkpoint="end")
    case.main(restart=tmp_path / "short", t_end=2e-4)
    case.main(out=tmp_path / "long", **coarse_keys)
    rows = [(tmp_path / name / "history.csv").read_text().split("\n")[2:] for name in ("short", "long")]
    assert rows[0] == rows[1]
    (history,) = case.main(restart=tmp_path / "short").values()
    assert len(history) == 50 and len(report(tmp_path / "short")["restarts"]) == 2
    (history,) = case.main(restart=tmp_path / "short", dt=8e-6, substeps=160, t_end=2.48e-4, solver="lu",
                           checkpoint=None).values()
    assert len(history) == 56 and history["window"][-1] == pytest.approx(8e-6) and report(
        tmp_path / "short")["parameters"]["solver"] == "lu"


@pytest.mark.parametrize("keys, words", [
    (dict(v0=0.02), "v0=0.02 contradicts the checkpoint, where it is 0.01: leave it out, or begin a new run"),
    (dict(dem="liggghts"), "dem=liggghts contradicts the checkpoint, where it is reference: leave it out"),
    (dict(dt=8e-6), "dt=8e-06 contradicts the checkpoint, where it is 4e-06: the step of the DEM, "
                    "dt/substeps, must stay 5e-08 s, and would be 1e-07 s"),
    (dict(iterate=20), "iterate=20 contradicts the checkpoint, where it is 0: windows stay weak, or stay"),
    (dict(t_end=4e-5), "t_end is 4e-05 s, and the run has already come to 6e-05 s: give a later end"),
    (dict(t_end=6.1e-5), "t_end is 6.1e-05 s, which is not a multiple of dt")])
def test_what_contradicts_a_checkpoint_is_refused_by_name(case, coarse_keys, tmp_path, keys, words):
    case.main(out=tmp_path, **{**coarse_keys, "t_end": 6e-5}, checkpoint=10)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(ValueError, match=words):
        case.main(restart=tmp_path, **keys)
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.name != "manifest.txt"}
    assert after == {name: before[name] for name in after} and len(after) == len(before) - 1


def test_files_that_are_no_checkpoint_are_refused(case, column, coarse_keys, tmp_path):
    """One sentence each; a damaged newest one gives way to the one before."""
    case.main(out=tmp_path, **{**coarse_keys, "t_end": 6e-5}, checkpoint=5)
    newest, before = (tmp_path / name for name in ("checkpoint.h5", "checkpoint_before.h5"))
    whole = newest.read_bytes()
    with pytest.raises(ValueError, match="is of column_collapse|is of beam_impact, whose keys are others"):
        column.main(restart=tmp_path)
    newest.write_bytes(whole[:-100])
    with pytest.warns(UserWarning, match=f"{newest} .*; the checkpoint before it is taken"):
        (history,) = case.main(restart=tmp_path, checkpoint=None).values()
    assert len(history) == 15
    for content in (b"", whole[:1000], whole[:5000] + b"x" + whole[5001:]):
        newest.write_bytes(content)
        with pytest.raises(StoreError, match=str(newest)):
            case.main(restart=newest)
    newest.unlink(), before.unlink()
    with pytest.raises(ValueError, match=f"restart={tmp_path} has no checkpoint.h5: give the folder of a"):
        case.main(restart=tmp_path)
    with pytest.raises(ValueError, match="nowhere does not exist: give the folder of a run"):
        case.main(restart=tmp_path / "nowhere")


def test_a_checkpoint_without_its_history_is_refused(case, coarse_keys, tmp_path):
    keys = {**coarse_keys, "t_end": 6e-5, "checkpoint": 10}
    case.main(out=tmp_path / "run", **keys)
    lone = tmp_path / "lone.h5"
    shutil.copy(tmp_path / "run/checkpoint.h5", lone)
    with pytest.raises(OutputError, match=f"the history of {lone} is neither in .* nor in {tmp_path}: put"):
        case.main(restart=lone, out=tmp_path / "other")
    (history,) = case.main(restart=lone, out=tmp_path / "run").values()
    assert len(history) == 15
    (tmp_path / "run/history.csv").write_text("# nothing\n")
    with pytest.raises(OutputError, match="history.csv has 10 bytes, fewer than the .* that it had when the "
                       "checkpoint was written: put back the history of that run"):
        case.main(restart=tmp_path / "run")
