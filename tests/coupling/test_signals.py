"""Signals, closed pipes, full disks and deleted folders end a run with one sentence and leave what it had."""
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from coupling import signals
from coupling.records import manifest
from coupling.records.history import read

ROOT = Path(__file__).parents[2]
LONG = "t_end=1000 pause=0.001"


@pytest.fixture
def start(tmp_path, start_process):
    """``start("key=value …")``: the toy case as a process of its own, results in ``tmp_path/out``."""
    def begin(more="", **keys):
        words = [sys.executable, ROOT / "tests/coupling/toy_case.py", *more.split()]
        words += [] if "out=" in more else [f"out={tmp_path / 'out'}"]
        return start_process(words, {**os.environ, "PYTHONPATH": str(ROOT)}, **keys)

    return begin


def wait_for_rows(process, folder):
    """Until the history has some."""
    while process.poll() is None and not ((path := folder / "history.csv").exists()
                                          and path.read_text().count("\n") > 50):
        time.sleep(0.02)
    assert process.poll() is None, process.communicate()


def check_what_is_left(folder, error):
    """History and report of a run that was stopped, all of it named in its manifest; returns the history."""
    found = json.loads((folder / "report.json").read_text())
    rows = read(folder / "history.csv")["time"]
    assert found["error"].startswith(error) and found["windows"] == len(rows) > 0
    assert manifest.read(folder).state == "stopped"
    assert {path.name for path in folder.iterdir()} == {"manifest.txt", "history.csv", "report.json"}
    return rows


def defaults():
    """A process group of its own, in which no signal is ignored, whatever started the tests."""
    for number in signals.SIGNALS:
        signal.signal(number, signal.SIG_DFL)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGPIPE", "SIGUSR1"])
def test_a_signal_ends_a_run_in_order(start, tmp_path, name):
    process = start(LONG, preexec_fn=defaults)
    wait_for_rows(process, tmp_path / "out")
    process.send_signal(getattr(signal, name))
    process.send_signal(signal.SIGTERM)  # they often come in pairs
    out, err = process.communicate(timeout=20)
    assert process.returncode == 130 and err.startswith("error: interrupted; ") and err.count("\n") == 1, err
    check_what_is_left(tmp_path / "out", f"KeyboardInterrupt: {name}")


def test_a_signal_that_went_nowhere_is_raised_again():
    """As one that arrives while numba compiles: its library calls Python back, and drops what is raised
    there."""
    signals.raise_again()
    with signals.like_interrupts():
        with pytest.raises(KeyboardInterrupt, match="SIGUSR1"):
            os.kill(os.getpid(), signal.SIGUSR1)
            time.sleep(1)
        with pytest.raises(KeyboardInterrupt, match="SIGUSR1"):
            signals.raise_again()
    signals.raise_again()


def send(name):
    os.kill(os.getpid(), getattr(signal, name))


def test_a_deferred_signal_is_noted_and_said_at_once(capfd):
    """Also one of those that come in pairs; afterwards signals are raised again."""
    with signals.like_interrupts():
        with signals.deferred():
            assert signals.noted() is None
            send("SIGUSR1")
            send("SIGTERM")
            assert signals.noted() == "SIGUSR1"
            signals.raise_again()
        assert signals.noted() == "SIGUSR1"
        assert capfd.readouterr() == ("", (
            "warning: SIGUSR1: a checkpoint is written when this window is done; another signal, 5 s from "
            "now or later, ends the run at once\n"))
        signals.raise_again()
    assert signals.noted() is None


def test_another_signal_ends_a_run_at_once_all_the_same(monkeypatch):
    monkeypatch.setattr(signals, "QUIET", 0.0)
    with signals.like_interrupts():
        with signals.deferred():
            send("SIGUSR1")
            with pytest.raises(KeyboardInterrupt, match="SIGTERM"):
                send("SIGTERM")
            with pytest.raises(KeyboardInterrupt, match="SIGTERM"):  # where that went nowhere
                signals.raise_again()
        with pytest.raises(KeyboardInterrupt, match="SIGUSR2"):
            send("SIGUSR2")


def test_signals_are_deferred_in_a_script_that_knows_nothing_of_them():
    before = signal.getsignal(signal.SIGTERM)
    with signals.deferred():
        send("SIGTERM")
        assert signals.noted() == "SIGTERM"
    assert signals.noted() is None and signal.getsignal(signal.SIGTERM) == before


def test_a_deferred_signal_outlives_standard_error():
    """Nobody reads it: the signal of its broken pipe comes on top."""
    reader, writer = os.pipe()
    os.close(reader)
    code = ("import os, signal; from coupling import signals\n"
            "with signals.deferred():\n    os.kill(os.getpid(), signal.SIGHUP)\n    print(signals.noted())")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=writer,
                          text=True, timeout=60, preexec_fn=defaults)
    os.close(writer)
    assert (done.returncode, done.stdout) == (0, "SIGHUP\n")


def test_a_run_under_nohup_outlives_its_terminal(start, tmp_path):
    process = start(LONG, preexec_fn=lambda: (defaults(), signal.signal(signal.SIGHUP, signal.SIG_IGN)))
    wait_for_rows(process, tmp_path / "out")
    process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=20)
    check_what_is_left(tmp_path / "out", "KeyboardInterrupt: SIGTERM")


def test_a_closed_terminal_takes_no_report_away(start, tmp_path):
    """Whatever the run then prints is an error, and it gets SIGHUP."""
    primary, secondary = os.openpty()
    process = start(LONG, stdout=secondary, stderr=secondary, stdin=secondary, preexec_fn=lambda: (
        os.setsid(), __import__("fcntl").ioctl(0, __import__("termios").TIOCSCTTY, 0), defaults()))
    os.close(secondary)
    wait_for_rows(process, tmp_path / "out")
    os.close(primary)
    assert process.wait(timeout=20) == 130
    check_what_is_left(tmp_path / "out", "KeyboardInterrupt: SIGHUP")


@pytest.mark.parametrize("words", ["toy_case.py --help", "../../cases/sphere_drop.py --help",
                                   "-m coupling.stability --help", "-m coupling.work_precision --help"])
def test_a_manual_that_nobody_reads_prints_nothing_ugly(words):
    reader, writer = os.pipe()
    os.close(reader)
    begin = [sys.executable, *words.split()]
    done = subprocess.run(begin, cwd=ROOT / "tests/coupling", env={**os.environ, "PYTHONPATH": str(ROOT)},
                          stdout=writer, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_summary_that_nobody_reads_takes_no_results_away(start, tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    process = start(stdout=writer)
    os.close(writer)
    _, err = process.communicate(timeout=20)
    assert "Traceback" not in err and "Exception ignored" not in err and err.count("\n") <= 1
    report = json.loads((tmp_path / "out/report.json").read_text())
    assert "error" not in report and manifest.read(tmp_path / "out").state == "complete"


# ---------------------------------------------------------------- places that take no more


@pytest.fixture
def small_disk(disk):
    """A folder on a disk of 256 kB."""
    return disk("256k") / "out"


@pytest.mark.parametrize("keys, full", [("wide=50", "history.csv"), ("paraview=1", "points")])
def test_a_full_disk_is_a_sentence_and_the_report_is_kept(start, small_disk, keys, full):
    """Whether a row or a file for ParaView has no more room."""
    process = start(f"t_end=100 {keys} out={small_disk}")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1 and err.count("\n") == 1, err
    assert err.startswith(f"error: {small_disk}/{full}") and err.endswith(
        "cannot be written (No space left on device): free some space on that disk or choose another "
        "folder\n"), err
    report = json.loads((small_disk / "report.json").read_text())
    rows = read(small_disk / "history.csv")["time"]
    assert report["error"].startswith("OutputError: ") and report["windows"] == len(rows) > 20
    assert manifest.read(small_disk).state == "stopped"


def test_the_limit_of_a_file_is_a_sentence(start, tmp_path):
    process = start("t_end=100 wide=50 pause=0.001")
    wait_for_rows(process, tmp_path / "out")
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (100_000, 100_000))
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1 and err.count("\n") == 1
    assert ("history.csv cannot be written (File too large): raise the limit of the size of a file "
            "(ulimit -f)") in err
    assert len(read(tmp_path / "out/history.csv")["time"]) > 50
    assert "(File too large)" in json.loads((tmp_path / "out/report.json").read_text())["error"]


def test_a_disk_that_is_full_at_the_start_leaves_the_old_set(start, small_disk):
    process = start(f"out={small_disk}")
    assert process.communicate(timeout=20)[1] == ""
    before = {path.name: path.read_bytes() for path in small_disk.iterdir()}
    with open(small_disk.parent / "big", "wb") as file, suppress(OSError):
        file.write(bytes(1 << 19))
    process = start(f"t_end=0.02 out={small_disk}")
    _, err = process.communicate(timeout=20)
    assert process.returncode == 1 and err.count(
        "\n") == 1 and "(No space left on device): free some space" in err
    assert {path.name: path.read_bytes() for path in small_disk.iterdir()} == before


@pytest.mark.parametrize("gone", ["out", "out/history.csv"])
def test_what_somebody_deletes_is_noticed_and_put_back(start, tmp_path, gone):
    process = start(LONG)
    wait_for_rows(process, tmp_path / "out")
    so_far = len(read(tmp_path / "out/history.csv")["time"])
    (shutil.rmtree if gone == "out" else os.unlink)(tmp_path / gone)
    _, err = process.communicate(timeout=20)
    kind = "folder" if gone == "out" else "file"
    assert process.returncode == 1 and err.count("\n") == 1
    assert err.startswith(f"error: the {kind} {tmp_path / gone} has been deleted while the run wrote into "
                          "it: ")
    assert len(check_what_is_left(tmp_path / "out", "OutputError: ")) > so_far
