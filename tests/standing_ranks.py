"""Ranks that stay for the next test: what a start costs them, 1.5 s of processor time each for imports and
compiled kernels, is paid once per number of ranks.

As a program, one of them: ``mpirun -n N python standing_ranks.py FOLDER``. It works on ``0.json``,
``1.json``, … in the folder as they come: ``code`` with ``words`` as its arguments, those that begin with
``-mpm_`` for PETSc, and ``places`` where it imports from. It answers each with ``0.R.json`` for rank R, and
puts back what the code has changed. Nobody waits in MPI for the next one, which would keep a core busy. One
without code is the last.
"""
import contextlib
import gc
import importlib
import io
import json
import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

PAUSE = 1e-3, 2e-2  # [s] between two looks: at first, and after long
PATCHED = ("mpm_fenicsx.mpm", "MPM"), ("mpm_fenicsx.solve.step", "Step")  # classes that tests set numbers of


def pauses():
    """Wait before each look."""
    pause, longest = PAUSE
    while True:
        time.sleep(pause)
        yield
        pause = min(1.1 * pause, longest)


def put(path, thing):
    """Write a file that is there as a whole or not at all."""
    draft = path.with_suffix(".draft")
    draft.write_text(json.dumps(thing))
    draft.rename(path)


class StandingRanks:
    """``size`` of them, which work in ``folder``; ``command`` and ``env`` start them."""

    def __init__(self, size, folder, command, env):
        self.size, self._folder, self._count = size, Path(folder), 0
        self._said = self._folder / "said"  # by libraries: what Python says goes into the answers
        with self._said.open("w") as said:
            self._process = subprocess.Popen(command, env=env, stdout=said, stderr=subprocess.STDOUT)

    def run(self, code, *words, places=(), timeout=240):
        """What ``subprocess.run`` would tell of ``python -c code *words`` on these ranks."""
        job = self._ask(code, words, places)
        answers = [job.with_suffix(f".{rank}.json") for rank in range(self.size)]
        end = time.monotonic() + timeout
        for _ in pauses():
            if all(answer.exists() for answer in answers) or not self.stand:
                break
            if time.monotonic() > end:
                self.close()
                raise subprocess.TimeoutExpired(["ranks", *words], timeout)
        found = [json.loads(answer.read_text()) for answer in answers if answer.exists()]
        out, err = ("".join(one[name] for one in found) for name in ("out", "err"))
        if len(found) < self.size or any(one["failed"] for one in found):
            err += self.close()
            return subprocess.CompletedProcess(words, 1, out, err)
        return subprocess.CompletedProcess(words, 0, out, err)

    def _ask(self, code, words=(), places=()):
        """File of a job."""
        job, self._count = self._folder / f"{self._count}.json", self._count + 1
        put(job, {"code": code, "words": [str(word) for word in words],
                  "places": [str(place) for place in places]})
        return job

    @property
    def stand(self):
        """Whether they can take another job."""
        return self._process.poll() is None

    def close(self):
        """End them; what they have written."""
        self._ask(None)
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        return self._said.read_text()


def put_back(before):
    """Search path, modules of tests, numbers of classes and PETSc's options as they were ``before``, whether
    words or code have set them."""
    path, modules, numbers, options = before
    sys.path[:] = path
    here = str(Path(__file__).parent)
    for name in set(sys.modules) - modules:
        if str(getattr(sys.modules[name], "__file__", None)).startswith(here):
            del sys.modules[name]
    for kind, values in numbers.items():
        for name, value in values.items():
            if getattr(kind, name) is not value:
                setattr(kind, name, value)
    database = petsc_options()
    now = database.getAll()
    for name in set(now) - set(options):
        database.delValue(name)
    for name, text in options.items():
        if now.get(name) != text:
            database[name] = text


def petsc_options():
    """PETSc's options, after the project has started PETSc."""
    from petsc4py import PETSc
    return PETSc.Options()


def state():
    """What ``put_back`` brings back."""
    kinds = [getattr(importlib.import_module(module), name) for module, name in PATCHED]
    numbers = {kind: {name: value for name, value in vars(kind).items() if isinstance(value, (int, float))}
               for kind in kinds}
    return list(sys.path), set(sys.modules), numbers, petsc_options().getAll()


def work(job):
    """Run the code of a ``job``: its answer."""
    words = job["words"]
    options = {word[1:]: value for word, value in zip(words, words[1:]) if word.startswith("-mpm_")}
    before, out, err, failed = state(), io.StringIO(), io.StringIO(), False
    sys.path[:0] = job["places"]
    sys.argv = ["-c", *words]
    for name, value in options.items():
        petsc_options()[name] = value
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            exec(compile(job["code"], "<job>", "exec"), {"__name__": "__main__"})
        except BaseException:  # SystemExit too: whoever leaves before the others would let them wait
            traceback.print_exc()
            failed = True
    put_back(before)
    return {"out": out.getvalue(), "err": err.getvalue(), "failed": failed}


def main(folder):
    from mpi4py import MPI
    comm, count, parent = MPI.COMM_WORLD, 0, os.getppid()
    state()  # loads the project
    gc.freeze()  # it stays: only what jobs leave is looked through after each
    while True:
        asked = Path(folder, f"{count}.json")
        for _ in pauses():
            if asked.exists():
                break
            if os.getppid() != parent:  # mpirun is gone
                return
        job = json.loads(asked.read_text())
        if job["code"] is None:
            return
        answer = work(job)
        if not answer["failed"]:
            comm.Barrier()
            gc.collect()  # solids that were not closed: on all ranks at once
        put(asked.with_suffix(f".{comm.rank}.json"), answer)
        if answer["failed"]:
            comm.Abort(1)
        count += 1


if __name__ == "__main__":
    main(sys.argv[1])
