"""The command ``mpm-dem``: runs cases by name or from a file, and says whether what they need is there.

    mpm-dem run CASE key=value …   a case by its name, or a script of your own; --help shows its keys
    mpm-dem cases                  which cases there are
    mpm-dem demo [key=value …]     a steel sphere strikes a beam, with LIGGGHTS where it is there
    mpm-dem doctor                 what is installed, in which version, and what is missing

Words with a dash behind CASE belong to PETSc. On several ranks: mpirun -n 2 mpm-dem run CASE …
"""
import ast
import json
import re
import runpy
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Dict, List, NamedTuple, NoReturn, Optional, Sequence

from mpm_dem_mpi import outside_mpi

HERE = Path(__file__).parent
SHIM = HERE / "dem_liggghts/liggghts/libdemshim.so"
PATIENCE = 120.0  # [s] for one piece to be imported
SOLVER = ('pip install "dolfinx-solver-real>=0.11,<0.12" (Linux, Python 3.12 or newer), or on Debian 12: '
          "apt install python3-dolfinx python3-petsc4py python3-mpi4py")
PRELUDE = """
import json, os, re, sys
def say(kind, text):
    print("\\n@" + json.dumps([kind, str(text)]))
def loaded(pattern):
    try:
        with open("/proc/self/maps") as maps:
            paths = {line.split()[-1] for line in maps if re.search(pattern, line)}
    except OSError:
        paths = ()
    return sorted({os.path.realpath(path) for path in paths})
def one_mpi():
    found = loaded(r"/libmpi(ch|_abi)?\\.so[.0-9]*$")
    if len(found) > 1:
        say("wrong", "two MPI libraries in one process, " + " and ".join(found)
            + ": take mpi4py, petsc4py and dolfinx from one source")
"""
PLAIN = """
import importlib.metadata, {0}
say("version", getattr({0}, "__version__", None) or importlib.metadata.version("{0}"))
"""
MPI4PY = """
import mpi4py, shutil, subprocess
from mpi4py import MPI
library = " ".join(MPI.Get_library_version().splitlines()[0].split(",")[0].rstrip("\\0").split())
say("version", mpi4py.__version__ + ", " + library)
one_mpi()
mpirun = shutil.which("mpirun")
if mpirun is None:
    say("note", "no mpirun on the path: runs have one rank")
else:
    answer = subprocess.run([mpirun, "--version"], capture_output=True, text=True, timeout=20).stdout
    if ("Open MPI" in answer) != ("Open MPI" in library):
        say("note", mpirun + " is of another MPI: with it each rank would be a run of its own")
"""
PETSC = """
from mpi4py import MPI
import petsc4py
petsc4py.init([])
from petsc4py import PETSc
say("version", petsc4py.__version__ + ", PETSc " + ".".join(map(str, PETSc.Sys.getVersion())))
one_mpi()
vector = PETSc.Vec().createMPI(2, comm=MPI.COMM_SELF)
if vector.comm.size != 1:
    say("wrong", "PETSc does not understand a communicator of mpi4py")
if PETSc.ScalarType(0).dtype.kind != "f":
    say("wrong", "this PETSc computes with complex numbers: install one with real numbers")
"""
DOLFINX = """
from mpi4py import MPI
import dolfinx, ufl
from dolfinx import mesh
say("version", dolfinx.__version__)
mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
one_mpi()
number = tuple(map(int, dolfinx.__version__.split(".")[:2]))
if number < (0, 5):
    say("wrong", "older than 0.5: take 0.5, 0.9 or 0.11")
elif number not in ((0, 5), (0, 9), (0, 11)):
    say("note", "tests run with 0.5, 0.9 and 0.11, not with this version")
"""
OURS = """
import mpm_fenicsx, dem_liggghts, coupling
from petsc4py import PETSc
from mpm_fenicsx.grid.compat import factorises
say("version", "in " + os.path.dirname(os.path.dirname(coupling.__file__)))
there = {"MUMPS": factorises("mumps", "lu"),
         "SuiteSparse": factorises("umfpack", "lu") and factorises("cholmod", "cholesky"),
         "hypre": PETSc.Sys.hasExternalPackage("hypre")}
say("note", "PETSc's solvers: " + ", ".join(("" if yes else "no ") + name for name, yes in there.items()))
"""
LIGGGHTS = """
from dem_liggghts.liggghts.library import SHIM, load
library = load(SHIM)
say("version", ", ".join(loaded(r"/libliggghts\\.so") or ["loaded"]))
if not library.shares_mpi:
    say("note", "of another MPI than mpi4py: each rank computes all particles")
"""


class Piece(NamedTuple):
    """Something that cases need: ``code`` imports it and says what it is; ``needed``: by every case;
    ``remedy``: what to install where it is missing."""

    name: str
    code: str
    remedy: str
    needed: bool = True


class Finding(NamedTuple):
    """What became of a piece: version, whether it works, sentences about what is wrong, and notes."""

    version: str
    works: bool
    wrong: List[str]
    notes: List[str]


PIECES = [
    *(Piece(name, PLAIN.format(name), f"pip install {name}, or on Debian: apt install python3-{name}")
      for name in ("numpy", "scipy", "numba", "matplotlib", "meshio", "h5py", "tqdm")),
    Piece("mpi4py", MPI4PY, SOLVER), Piece("petsc4py", PETSC, SOLVER), Piece("dolfinx", DOLFINX, SOLVER),
    Piece("mpm-dem", OURS, "install it anew: pip install ."),
    Piece("LIGGGHTS", LIGGGHTS, "on Debian: apt install libliggghts-dev libopenmpi-dev g++, then install "
          "mpm-dem anew from its sources; elsewhere see docs/installing.md", needed=False)]


def examined(piece: Piece) -> Finding:
    """The piece in a process of its own, which may crash or hang."""
    try:
        done = subprocess.run([sys.executable, "-c", PRELUDE + piece.code], cwd=HERE, env=outside_mpi(),
                              timeout=PATIENCE, stdin=subprocess.DEVNULL, capture_output=True)
    except subprocess.TimeoutExpired:
        return Finding("", False, [f"no answer within {PATIENCE:g} s"], [])
    said: Dict[str, List[str]] = {"version": [], "wrong": [], "note": []}
    for line in done.stdout.decode(errors="replace").splitlines():
        if line.startswith("@"):
            kind, text = json.loads(line[1:])
            said[kind].append(text)
    wrong = said["wrong"]
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        last = [re.sub(r"^[\w.]+: ", "", line) for line in last]  # without the kind of the error
        wrong = wrong + (last if done.returncode > 0 and last
                         else [f"ended by signal {-done.returncode}", *last])
    return Finding(", ".join(said["version"]), not wrong, wrong, said["note"])


def doctor() -> int:
    """Tell of every piece; status 0 when cases can run."""
    print(f"{'ok':8} {'Python':11} {sys.version.split()[0]}, {sys.executable}")
    missing = []
    with ThreadPoolExecutor(2) as pool:
        for piece, found in zip(PIECES, pool.map(examined, PIECES)):
            absent = any(re.search("No module named|is not available", text) for text in found.wrong)
            mark = "ok" if found.works else "MISSING" if absent else "BROKEN"
            print(f"{mark if piece.needed else mark.lower():8} {piece.name:11} {found.version}".rstrip())
            for sentence in (*found.wrong, *found.notes):
                print(f"{'':20} {sentence}")
            if not found.works:
                missing.append(piece)
                # a piece that misses another one says so; the remedy is told there
                if not any("No module named" in text and piece.name not in text for text in found.wrong):
                    print(f"{'':20} {piece.remedy}")
            sys.stdout.flush()
    needed = [piece.name for piece in missing if piece.needed]
    if needed:
        print(f"\ncases cannot run: first see to {needed[0]}")
        return 1
    print("\ncases can run, with " + ("dem=reference; without LIGGGHTS" if missing else
                                      "dem=reference and dem=liggghts"))
    return 0


def scripts() -> Dict[str, Path]:
    """Name → script of each case: those of the source tree, or of the package that is installed."""
    paths = next(filter(None, (sorted(HERE.glob(f"{name}/*.py")) for name in ("cases", "mpm_dem_cases"))), [])
    return {path.stem: path for path in paths}


def tell_cases() -> int:
    """For each case its name and the first paragraph of its docstring."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # who reads it may have enough, as head has
    for name, script in scripts().items():
        text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
        print(f"{name:16} {' '.join(text.split(chr(10) * 2)[0].split())}")
    return 0


def stop(sentence: str, status: int) -> NoReturn:
    """End with a sentence, which the first rank says."""
    try:
        from mpi4py import MPI

        first = MPI.COMM_WORLD.rank == 0
    except (ImportError, RuntimeError):
        first = True
    if first:
        print(f"error: {sentence}", file=sys.stderr, flush=True)
    else:
        time.sleep(0.5)  # as mpirun ends all when one has ended
    sys.exit(status)


def script_of(case: str) -> Path:
    """Script of a case by its name, or a file of the user."""
    known = scripts()
    if case in known:
        return known[case]
    if not Path(case).is_file():
        stop(f"{case} is neither a case nor a file: give one of {', '.join(known)}, or a script's path", 2)
    return Path(case).resolve()


def run(case: str, words: Sequence[str]) -> int:
    """Run the case as ``python CASE words`` would: in this process, as the program."""
    script = script_of(case)
    sys.argv = [str(script), *words]  # before anything of PETSc is imported, which reads it
    sys.path.insert(0, str(script.parent))
    try:
        runpy.run_path(str(script), run_name="__main__")
    except ImportError as error:  # errors of a run itself are told by the run
        stop(f"{error}: mpm-dem doctor says what is missing", 1)
    return 0


def demo(words: Sequence[str]) -> int:
    """The beam, with LIGGGHTS where its shim was compiled."""
    chosen = any(word.startswith("dem=") for word in words)
    return run("beam_impact", [*words, *([] if chosen or not SHIM.exists() else ["dem=liggghts"])])


def main(words: Optional[Sequence[str]] = None) -> int:
    """The command with its ``words``, those of the command line if none are given; its exit status."""
    command, *rest = [*(sys.argv[1:] if words is None else words)] or ["--help"]
    if command in ("-h", "--help", "help"):
        print(__doc__.split("\n\n", 1)[1].strip("\n"))
        return 0
    if command in ("cases", "doctor") and rest:
        stop(f"mpm-dem {command} takes no words, it got {' '.join(rest)}", 2)
    if command == "run" and not rest:
        stop("mpm-dem run needs a case: mpm-dem cases names them", 2)
    if command == "run":
        return run(rest[0], rest[1:])
    if command in ("cases", "doctor", "demo"):
        return {"cases": tell_cases, "doctor": doctor, "demo": lambda: demo(rest)}[command]()
    stop(f"mpm-dem has no command {command}: it has run, cases, demo and doctor", 2)


if __name__ == "__main__":
    sys.exit(main())
