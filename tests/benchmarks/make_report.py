"""All measured numbers, made anew by one command: ./dev report. Writes docs/report.md, its pictures, and the
tables in docs/solvers.md and docs/error_floor.md.

    ./dev report [parts=beam_2d,solvers,…] [peer=PYTHON script=FILE column=FILE] [out=out/report]

peer: the interpreter of another program; script: its script of the beam, see cases/studies/peer.py; without
it the stored numbers of cases/references/kratos_beam.csv stand beside ours. column: its script of a column of
soil, see bench_throughput.py; without it no peer's throughput is told. Every part runs by itself with a limit
of time; one that fails says so in its section, the others go on, and the exit status is 1. A part that is not
asked for keeps its last section, each of which says on what machine it was measured. The machine should do
nothing else meanwhile; the load before each part is in the report.
"""
import csv
import os
import platform
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "cases")]
from studies.sweep import environment  # noqa: E402

WORK = [sys.executable, "-m", "coupling.work_precision"]
OVERLAY = "overlay=cases/references/kratos_beam.csv"
PEER_RUNS = ["peer_ppe=4", "peer_dt=4e-6,2e-6,1e-6,5e-7"]
MISSING = "(nothing yet: run ./dev report)"


class Part(NamedTuple):
    """A section: what it is called, its command, where its Markdown goes, seconds it may take, and the module
    or case without which it is left out."""

    title: str
    command: list
    document: str = "docs/report.md"
    limit: float = 300.0
    needs: str = ""


def bench(name, *words):
    return [sys.executable, f"tests/benchmarks/{name}.py", *words]


PARTS = {"beam_2d": Part("Error against run time: beam in the plane",
                         [*WORK, "cases/beam_impact.py", "h=5e-3,2.5e-3,2e-3", "dt=8e-6,4e-6,2e-6,1e-6",
                          "repeat=2", "show=force,u_beam"], limit=600.0),
         "beam_3d": Part("Error against run time: beam in space", [*WORK, "cases/beam_impact.py", "dim=3",
                                                                   "h=5e-3,3.3333e-3,2e-3",
                                                                   "dt=8e-6,4e-6,2e-6", "show=force,u_beam"],
                         limit=400.0), "three_impacts": Part("Error against run time: three impacts",
                                                             [*WORK, "cases/multiple_impact.py",
                                                              "h=5e-3,2.5e-3,2e-3", "dt=4e-6,2e-6",
                                                              "show=force,u_beam,peak_1,peak_2,peak_3"],
                                                             limit=400.0),
         "needs": Part("What a scene does not need", bench("bench_needs", "repeat=2", "parts=needs")),
         "start": Part("Start-up", bench("bench_needs", "repeat=2", "parts=start")),
         "stability": Part("Stability of stiff and extreme cases",
                           [sys.executable, "-m", "coupling.stability"], limit=600.0,
                           needs="cases/studies/stability.py"),
         "throughput": Part("Throughput, and what the machine could do", bench("bench_throughput"),
                            limit=600.0),
         "solvers": Part("Tables", bench("bench_solvers"), "docs/solvers.md", 600.0),
         "floor": Part("Tables", bench("bench_floor"), "docs/error_floor.md", 600.0)}
WARM_UP = [("column_collapse", "t_end=1e-3"), ("beam_impact", "t_end=2e-5"),
           ("beam_impact", "dim=3", "t_end=4e-6"), ("multiple_impact", "t_end=2e-5"),
           ("beam_impact", "dem=liggghts", "t_end=2e-5")]  # so that no part measures the compiler
PICTURES = {"beam_2d": "work_precision.png", "beam_3d": "work_precision.png",
            "three_impacts": "work_precision.png", "stability": "stability.png",
            "throughput": "throughput.png"}


def run(name, part, folder, more):
    """Run the part; its Markdown, or None when it failed, and the seconds it took."""
    folder.mkdir(parents=True, exist_ok=True)
    begin, draws = perf_counter(), part.command[1] == "-m" or name in PICTURES
    with open(folder / "output.md", "w") as out, open(folder / "log.txt", "w") as log:
        process = subprocess.Popen([*part.command, *more, *([f"out={folder}"] if draws else [])], cwd=ROOT,
                                   stdout=out, stderr=log, env=environment(), start_new_session=True)
        try:
            status = process.wait(part.limit)
        except subprocess.TimeoutExpired:
            status = f"more than {part.limit:g} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGTERM)  # with the runs that it has started
                process.wait()
    seconds = perf_counter() - begin
    if status != 0:
        print(f"{name} failed ({status}): see {folder / 'log.txt'}", file=sys.stderr, flush=True)
        return None, seconds
    # a file of its own first
    made = next(iter(sorted(folder.glob("*.md"), key=lambda path: path.name == "output.md")))
    return made.read_text(encoding="utf-8"), seconds


def section(name, part, text, seconds, where):
    """Markdown of a section; where: see ``machine``."""
    words = [word if word != sys.executable else "python" for word in part.command]
    lines = [f"## {part.title}\n" if part.document == "docs/report.md" else "",
             f"`{' '.join(words)}`, {seconds:.0f} s on {where}", "",
             text.strip() if text else "**This part failed.**"]
    if text and name in PICTURES:
        lines += ["", f"![{part.title}]({name}.png)"]
    return "\n".join(lines).strip() + "\n"


def put(document, name, text):
    """Put ``text`` between the markers of that name in a document of the project."""
    path = ROOT / document
    begin, end = f"<!-- {name}: made by ./dev report -->", f"<!-- end of {name} -->"
    old = path.read_text(encoding="utf-8")
    if begin not in old:
        old = old.rstrip("\n") + f"\n\n{begin}\n{MISSING}\n{end}\n"
    before, rest = old.split(begin)
    path.write_text(f"{before}{begin}\n\n{text}\n{end}{rest.split(end)[1]}", encoding="utf-8")


def targets(folder):
    """What the numbers have to reach, from the sweep of the beam in the plane."""
    with open(folder / "beam_2d" / "work_precision.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "ok" and float(row["error_force"])
                <= 0.008]
    if not rows:
        return "Beam in the plane: **no run has a force error of at most 0.8 %.**\n"
    best = min(rows, key=lambda row: float(row["window_s"]))
    verdict = "met" if float(best["window_s"]) <= 0.6 else "**missed**"
    return ("Beam in the plane, force error of at most 0.8 % in at most 0.6 s of window time on one rank: "
            f"{verdict}, "
            f"{float(best['error_force']):.2%} in {float(best['window_s']):.2f} s (h={best['h']}, "
            f"dt={best['dt']}).\n")


def warm_up(folder):
    """Compile every kernel the parts need."""
    for case, *words in WARM_UP:
        subprocess.run([sys.executable, f"cases/{case}.py", *words, f"out={folder / 'warm_up'}"], cwd=ROOT,
                       env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def machine():
    """What a part is going to run on."""
    known = {}
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        known.setdefault(key.strip(), value.strip())
    kind = (f"{known['model name']} (family {known.get('cpu family')}, model {known.get('model')})"
            if "model name" in known else platform.machine())
    return (f"{kind}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before, Python "
            f"{platform.python_version()}")


def of_peer(name, given):
    """Words for the parts that a peer can stand beside."""
    if name == "beam_2d":
        return ([f"peer={given['peer']}", f"script={given['script']}", *PEER_RUNS] if "script" in given
                else [OVERLAY])
    if name == "throughput" and "column" in given:
        return [f"peer={given['peer']}", f"script={given['column']}"]
    return []


def main(words):
    given = dict(word.split("=", 1) for word in words)
    chosen = given.get("parts", ",".join(PARTS)).split(",")
    if unknown := set(chosen) - set(PARTS):
        sys.exit(f"error: parts={','.join(sorted(unknown))}: choose of {', '.join(PARTS)}")
    folder, begin, failed, costs = Path(given.get("out",
                                                  ROOT / "out/report")).resolve(), perf_counter(), False, []
    pictures = ROOT / "docs"
    warm_up(folder)
    print(f"warm-up: {perf_counter() - begin:.0f} s", flush=True)
    for name in chosen:
        part = PARTS[name]
        if part.needs and not (ROOT / part.needs).is_file():
            continue
        shutil.rmtree(folder / name, ignore_errors=True)
        where = machine()
        text, seconds = run(name, part, folder / name, of_peer(name, given))
        failed |= text is None
        put(part.document, name, section(name, part, text, seconds, where))
        costs.append((name, seconds))
        print(f"{name}: {seconds:.0f} s", flush=True)
        if text and name in PICTURES and (folder / name / PICTURES[name]).is_file():
            shutil.copy(folder / name / PICTURES[name], pictures / f"{name}.png")
        if text and name == "beam_2d":
            put("docs/report.md", "targets", targets(folder))
    put("docs/report.md", "cost", "What the parts took [s]: " + ", ".join(f"{n} {s:.0f}" for n, s in costs)
        + f"; {perf_counter() - begin:.0f} in all.\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
