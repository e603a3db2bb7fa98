"""A folder shows the results of one run, whenever a run ends and whatever ends it."""
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from coupling.records import manifest, results
from coupling.records.results import Results
from coupling.records.writing import OutputError

ROOT = Path(__file__).parents[2]
FIRST, LATER = ("history.csv", "report.json", "old.png"), "old_1.vtu"


def write(results, *names):
    """Files that say which run has written them."""
    for name in names:
        results.path(name).write_text(results._run)


def old_set(folder):
    """A complete set, beside a file of the user; returns what its files say."""
    folder.mkdir(exist_ok=True)
    (folder / "notes.txt").write_text("mine")
    run = Results(folder, "old", names=FIRST)
    write(run, *FIRST)
    run.start()
    write(run, LATER)
    run.end("complete")
    run.close()
    return run._run


def shown(folder):
    """Name → content of the results in a folder."""
    return {path.name: path.read_text() for path in folder.iterdir()
            if path.is_file() and path.name not in (manifest.NAME, "notes.txt")}


def test_a_new_run_replaces_the_whole_set_when_its_first_window_is_done(tmp_path):
    before = old_set(tmp_path)
    run = Results(tmp_path, "new", names=["history.csv", "report.json"])
    write(run, "history.csv", "points_0.vtu")
    assert set(shown(tmp_path)) == {*FIRST, LATER} and set(shown(tmp_path).values()) == {before}
    run.start()
    write(run, "points_1.vtu", "report.json")
    assert set(shown(tmp_path)) == {"history.csv", "points_0.vtu", "points_1.vtu", "report.json"}
    assert set(shown(tmp_path).values()) == {run._run} and manifest.read(tmp_path).state == "running"
    run.end("complete")
    run.close()
    found = manifest.read(tmp_path)
    assert (found.state, set(found.files)) == ("complete", set(shown(tmp_path))) and found.run == run._run
    assert (tmp_path / "notes.txt").read_text() == "mine" and not (tmp_path / results.HIDDEN).exists()


def test_a_failed_start_leaves_the_old_set(tmp_path):
    before = old_set(tmp_path)
    for failed in (False, True):
        run = Results(tmp_path, "new", names=["history.csv"])
        write(run, "history.csv")
        if failed:
            assert not run.make_room()
        run.close()
        assert set(shown(tmp_path)) == {*FIRST, LATER} and set(shown(tmp_path).values()) == {before}
        assert manifest.read(tmp_path).state == "complete" and not (tmp_path / results.HIDDEN).exists()


def test_a_further_run_of_one_process_and_key_adds_to_the_set(tmp_path):
    """As of two back ends that are compared; again, or in another process, they are a new set."""
    for _ in range(2):
        for name in ("a.csv", "b.csv"):
            run = Results(tmp_path, "case", "keys", [name])
            write(run, name)
            run.start()
            run.end("complete")
            run.close()
        assert set(shown(tmp_path)) == {"a.csv", "b.csv"} == set(manifest.read(tmp_path).files)
        assert len(set(shown(tmp_path).values())) == 1
    other = Results(tmp_path, "case", "other keys", ["c.csv"])
    other.start()
    other.close()
    assert shown(tmp_path) == {}


def test_files_of_nobody_are_left_alone(tmp_path):
    (tmp_path / "history.csv").write_text("by hand")
    with pytest.raises(OutputError, match=r"history.csv is not of a run that left a manifest.txt: move it "
                       r"away, or"):
        Results(tmp_path, "case", names=["history.csv"])
    assert shown(tmp_path) == {"history.csv": "by hand"} and not (tmp_path / results.HIDDEN).exists()
    (tmp_path
     / manifest.NAME).write_text("state: running\nfile: ../outside\nfile: .\nfile: a.png\nfile: half a na")
    assert manifest.read(tmp_path).files == ("a.png",)


KILLED = """
import os, pathlib, signal, sys
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/tests/coupling"]
from test_results import Results, old_set, write
folder, last = pathlib.Path(sys.argv[2]), 0

def counted(function):
    def call(*arguments, **keys):
        global left
        left -= 1
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **keys)
    return call

for name in "replace", "open", "write", "unlink", "mkdir", "rmdir":  # all that changes a folder
    setattr(os, name, counted(getattr(os, name)))
pathlib.Path.unlink, pathlib.Path.write_text = counted(pathlib.Path.unlink), counted(pathlib.Path.write_text)
for point in range(1000):
    left = 10**9
    place = folder / str(point)
    place.mkdir()
    old_set(place)
    child = os.fork()
    if not child:
        left = point
        run = Results(place, "new", names=["history.csv", "report.json"])
        write(run, "history.csv", "points_0.vtu")
        run.start()
        write(run, "points_1.vtu", "report.json")
        run.end("complete")
        run.close()
        os._exit(0)
    if os.waitpid(child, 0)[1] == 0:
        sys.exit(print(point))
"""


def test_killed_at_any_point_a_folder_has_files_of_one_run(tmp_path):
    """Before each change of the folder a process is killed. The next run removes what the manifest names."""
    done = subprocess.run([sys.executable, "-c", KILLED, ROOT, tmp_path], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 0, done.stderr
    points, old, new = int(done.stdout), 0, 0
    for point in range(points + 1):
        place = tmp_path / str(point)
        found, files = manifest.read(place), shown(place)
        assert len(set(files.values()) - {""}) <= 1, (point, files)
        assert set(files) <= set(found.names), (point, files, found)
        whole = set(files) == {*FIRST, LATER}
        old, new = old + whole, new + (found.run.startswith("new") and found.state != "starting")
        assert whole or found.run.startswith("new"), (point, files, found)
        run = Results(place, "last")
        run.start()
        run.close()
        assert shown(place) == {} and (place / "notes.txt").read_text() == "mine"
    assert points > 20 and old > 5 and new > 5


def test_a_folder_belongs_to_one_run_at_a_time(tmp_path):
    """Until its process is dead, however it dies."""
    code = ("import sys, time; from coupling.records.results import Results; run = Results(sys.argv[1], "
            "'case');print('here', flush=True); time.sleep(60)")
    holder = subprocess.Popen([sys.executable, "-c", code, tmp_path], stdout=subprocess.PIPE, text=True,
                              env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert holder.stdout.readline() == "here\n"
    with pytest.raises(OutputError,
                       match=rf"belongs to a run that has not ended \(process {holder.pid} on .*\): wait"):
        Results(tmp_path, "case")
    holder.send_signal(signal.SIGKILL)
    holder.communicate()
    run = Results(tmp_path, "case")
    with pytest.raises(OutputError, match="belongs to a run that has not ended"):
        Results(tmp_path, "case")
    run.close()
    Results(tmp_path, "case").close()


def test_a_folder_that_is_gone_is_made_again_for_the_last_lines(tmp_path):
    import shutil

    for replaced in (False, True):
        run = Results(tmp_path / "out", "case", names=["history.csv", "report.json"])
        run.start()
        shutil.rmtree(tmp_path / "out")
        assert "has been deleted while" in run.lost()
        if replaced:
            other = Results(tmp_path / "out", "other")
            assert "has been replaced by another one" in run.lost() and not run.make_room()
            run.close()
            with pytest.raises(OutputError):
                Results(tmp_path / "out", "third")
            other.close()
        else:
            assert run.make_room() and not run.lost()
            write(run, "report.json")
            run.end("stopped")
            run.close()
            assert set(shown(tmp_path / "out")) == {"report.json"}
            assert manifest.read(tmp_path / "out").state == "stopped"


def test_a_file_system_without_locks_is_a_warning(tmp_path, monkeypatch):
    def unknown(*_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("fcntl.flock", unknown)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Results(tmp_path, "case").close()
    assert "file system without locks" in str(caught[0].message)
