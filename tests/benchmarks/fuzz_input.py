"""Bad input, by the thousand: command lines of every case and snippets of every public class, all in one
process.

    python tests/benchmarks/fuzz_input.py [every=N] [first=N] [show=all]

Each must come out right, with finite numbers, or be refused in one sentence that names the key and the
remedy. What is neither is printed and counted; the exit status is 1 unless nothing is left. every: makes only
each N-th line, first: begins with that one. The values come from the type of each key, the same in every run.
"""
import contextlib
import copy
import functools
import importlib
import io
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import typing
import warnings
from pathlib import Path

import numpy as np
from numba.core.compiler_lock import global_compiler_lock

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "cases"), str(Path(__file__).parent)]
PATIENCE = 15  # [s] for one of them
MEMORY = 6e9  # bytes: what asks for more is wrong

BEAM = "h=5e-3 body=12,2 points=2 segments=12 dt=4e-6 substeps=40 t_end=1.2e-5"
LONG = BEAM.replace("body=12", "body=24").replace("segments=12", "segments=24")
COLUMN = "h=0.05 dt=1e-3 t_end=3e-3"
BLOCKS = "h=0.025 dt=5e-4 t_end=1.5e-3 spheres=2"
EXTREME = "length=0.04 height=0.02 h=0.01 points=2 windows=3"
SCENES = [  # case, words that run in a moment
    ("beam_impact", BEAM), ("multiple_impact", LONG), ("column_collapse", COLUMN),
    ("granular_blocks", BLOCKS),
    *(("extreme", f"scene={scene} {EXTREME}{more}") for scene, more in (
        ("beam", ""), ("block", ""), ("free", ""), ("layers", " contrast=10"),
        ("rest", " gravity=10 E_ball=1e7"),
        ("swing", ""), ("flight", " fly=1")))]

FLOATS = ["nan", "-inf", "-1", "0", "1e30", "1e-300", "1e300", "abc", "1,2", "1_0", "٣", ""]
INTS = ["-1", "0", "1.5", "nan", "1e9", "1000000000", "4294967316", "abc", "1_0", "٣", ""]
BOOLS = ["maybe", "2", "", "nan"]
PATHS = ["", "/dev/null/x", "\udcff\udcfe", "a\0b", "x" * 300, "~nobody-of-this-name/x", "{folder}/pipe",
         "/proc/x"]
# right for no number
NEVER = {"nan", "inf", "-inf", "1e999", "abc", "1e", "1_0", "٣", "0x10", "1+1", "maybe", ""}
SIGNED = {"at", "fly", "angle", "shift", "nu", "floor"}  # keys of which a negative number may be right
ZERO = {"restitution", "soil_restitution", "friction", "shift", "gap", "cohesion", "psi", "phi", "nu",
        "picture", "v0", "gravity", "adhesion", "inset", "adapt", "spread", "tension", "ratio", "fly",
        "angle", "at", "floor", "iterate", "paraview", "animation"}  # of which zero may be
UNUSED = [  # case, words with a key that has no effect beside the others
    *(("column_collapse", words) for words in (
        "ratio=-1", "ratio=0.5", "depth=0.3", "open_side=yes", "law=von_mises cohesion=1e3 phi=30",
        "law=von_mises cohesion=1e3 tension=1", "law=von_mises cohesion=1e3 psi=5")),
    *(("granular_blocks", words) for words in (
        "disc_E=-1", "disc_E=1e6", "disc=0.4", "contact=points wall_E=1e6", "contact=points inset=0.1",
        "contact=points spacing=0.01", "tol=1e-3", "relax=iqn")),
    *((case, words) for case in ("beam_impact", "multiple_impact") for words in (
        "tol=1e-3", "relax=iqn", "cells=10,8 h=4e-3", "iterate=0 tol=0.5")),
    *(("beam_impact", words) for words in (
        "mapping=nearest", "dim=3 body=8,2,2 segments=8,2 plane=strain")),
    *(("extreme", f"scene={scene} {words}") for scene, keys in (
        ("beam", "contrast=2"), ("block", "contrast=2"), ("free", "contrast=2"),
        ("rest", "v0=1 angle=3 contrast=2"),
        ("swing", "gap=0.1 restitution=0.5 friction=0.5 gravity=1 angle=3 at=0.001"),
        ("flight", "gap=0.1 restitution=0.5 friction=0.5 gravity=1 angle=3"))
      for words in keys.split()),
    *(("extreme", words) for words in (
        "dt=1e-6 cfl=1", "dt=1e-6 per_contact=20 cfl=1", "cfl=1 per_contact=20",
        "width=0.02 dim=3 plane=strain"))]
RUINS = [  # sizes beyond all machines, which must be refused at once
    *((case, words) for case in ("beam_impact", "multiple_impact") for words in (
        "h=1e-5", "cells=10000,10000", "body=100000,100000", "segments=1000000000", "substeps=1000000000",
        "dt=1e-12 t_end=1", "dim=3 h=1e-5")),
    *(("column_collapse", words) for words in (
        "h=1e-5", "refine=100 h=0.001", "box=1e30,1e30", "box=1e6,1e6", "dt=1e-12 t_end=1", "dim=3 h=1e-4")),
    *(("granular_blocks", words) for words in (
        "h=1e-5", "spheres=500", "blocks=1000000000", "spacing=1e-6", "substeps=1000000000",
        "dt=1e-12 t_end=1",
        "box=1e30,1e30", "block=1e15,1e15", "iterate=1000000000", "adapt=1e30")),
    *(("extreme", words) for words in (
        "h=1e-7", "refine=10000", "substeps=1000000000", "windows=99999999999999", "length=1e9"))]
# values that are right though nobody waits: the most windows of a run
SLOW = {("extreme", "windows"): (1e9,)}
OTHERS = [  # words that are wrong as such
    "=", "=1", "h", "h==1", "--h=1", "-h=1", "h=1e-3 h=2e-3", "nonsense=1", "preset=none-such", "H=1",
    "out=/",
    "--options_file={folder}/missing"]
RAW = re.compile(
    r"broadcast|out of bounds|bug in the program|Traceback|operand|Unable to allocate|math domain|"
    r"could not convert|invalid literal|not supported between|object is not|has no attribute|must be real|"
    r"unexpected keyword|error code|negative dimensions|cannot convert|array element|too many values|"
    r"not enough values|Errno|division by zero|overflow|too large|zero-size|empty sequence|embedded null|"
    r"surrogates|LinAlg|Singular matrix|positional|\bCODEC|codec can't|maximum recursion|NoneType", re.I)
REMEDY = re.compile(
    r"\b(give|take|choose|move|enlarge|leave|look|use|try|remove|repair|must|separate|let|needs?|known|"
    r"cannot be read as|shorten|reverse|name|add|seed|say|end)\b")


class TimeUp(BaseException):
    """Nothing may take that long."""


def too_late(*_):
    """Called by the alarm. A compilation is not interrupted: its callbacks swallow exceptions; it has time
    once more."""
    signal.alarm(PATIENCE)
    if not global_compiler_lock.is_locked():
        raise TimeUp


def lines():
    """(case, words, key, whether it must be refused; None: must be accepted) of all command lines."""
    for case, base in SCENES:
        yield case, base.split(), None, None
        given = dict(word.split("=", 1) for word in base.split())
        for key, kind in kinds(case).items():
            for value, wrong in values(key, kind):
                if too_slow(case, key, value):
                    continue
                words = " ".join(f"{k}={v}" for k, v in given.items() if k != key)
                yield case, [*words.split(), f"{key}={value}"], key, wrong
            twice = given.get(key, "1")
            yield case, [*base.split(), f"{key}={twice}", f"{key}={twice}"], key, True
    for table, wrong in ((UNUSED, True), (RUINS, True)):
        for case, words in table:
            base = dict(word.split("=", 1) for word in dict(SCENES)[case].split())
            if case == "extreme":
                base = dict(word.split("=", 1) for word in ("scene=beam " + EXTREME).split())
            new = [word for word in words.split()]
            kept = [f"{k}={v}" for k, v in base.items() if k not in {word.split("=")[0] for word in new}]
            yield case, [*kept, *new], new[-1].split("=")[0], wrong
    for case, base in SCENES[:4]:
        for words in OTHERS:
            yield case, [*base.split(), *words.split()], None, True


def kinds(case):
    """Key → annotation of a case."""
    from coupling import cli

    return {name: key.kind for name, key in cli.as_case(importlib.import_module(case).main).keys.items()}


def too_slow(case, key, value):
    """Is the value one of ``SLOW``?"""
    return (case, key) in SLOW and value not in NEVER and float(value) in SLOW[case, key]


def values(key, kind):
    """(text, whether it must be refused) of bad values for a key of that annotation."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Union:
        return values(key, args[0])
    if origin is typing.Literal:
        return [(text, True) for text in ("", "none-such", str(args[0]).upper() + "x", "nan",
                                          f"{args[0]},{args[-1]}")]
    if origin is tuple:
        return list(tuples(key, args))
    if kind is bool:
        return [(text, True) for text in BOOLS]
    if key == "out":
        return [(text, True) for text in PATHS] + [("~/x", False)]
    if key == "floor":
        return [(text, text in NEVER or text.startswith("-") or "," in text) for text in (*FLOATS, "rough")]
    return [(text, must_refuse(key, text)) for text in (INTS if kind is int else FLOATS)]


def tuples(key, args):
    one = args[0] is int
    for text in ("", ",", "1,", "1,2,3,4", "nan,1", "1,inf", "-1,-1", "0,0", "1e30,1e30", "1e-300,1e-300",
                 "abc", "1;2", "(1,2", "1_0,2", "٣,3", "9999999999,9999999999", "1.5,2.5"):
        parts = text.strip("()").split(",")
        wrong = any(p in NEVER for p in parts) or ";" in text or len(parts) > 3 or (one and "." in text) or \
            "(" in text or any(must_refuse(key, p) for p in parts) or "e30" in text and key != "at"
        yield text, wrong or key == "at" and "e30" in text


def must_refuse(key, text):
    if text in NEVER or "," in text:
        return True
    number = float(text)
    return number < 0 and (key not in SIGNED or key == "nu") or number == 0 and key not in ZERO


def judge(case, words, key, wrong):
    """What is bad about the outcome of a command line; None when it is right or well refused."""
    from coupling import cli

    module, kept = importlib.import_module(case), []
    main = copy.copy(cli.as_case(module.main))
    start, main.start = main.start, lambda *arguments: kept.append(start(*arguments))
    out, err, status = io.StringIO(), io.StringIO(), 0
    sys.argv = [f"{case}.py", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            cli.run(main)
    except SystemExit as end:
        status = end.code
    said = [line for line in err.getvalue().splitlines() if not line.startswith("warning: ")]
    if status == 0:
        return accepted(kept, wrong)
    if len(said) != 1 or not said[0].startswith("error: "):
        return f"not one sentence: {' / '.join(said)[-300:]}"
    if wrong is None:
        return f"refused: {said[0]}"
    return sentence(said[0][len("error: "):], key if wrong else None)


def accepted(kept, wrong):
    """What is bad about a run that came to its end."""
    if wrong:
        return "accepted"
    for histories in kept:
        for history in histories.values() if isinstance(histories, dict) else [histories]:
            lost = [name for name in history.columns if not np.isfinite(history[name]).all()]
            if lost:
                return f"accepted, and {', '.join(lost)} not finite"
    return None


def sentence(text, key):
    """What is bad about a sentence; key: which it must name, or None."""
    # what a user's function says
    own = re.sub(r"\(\w+: [^)]*\)", "", text) if "look at this function" in text else text
    if RAW.search(own):
        return f"raw: {text}"
    if "\n" in text or len(text) > 600:
        return f"not one sentence: {text[:300]}"
    if key and not re.search(rf"(?<![A-Za-z]){re.escape(key.replace('_', ' '))}|(?<!\w){re.escape(key)}",
                             text):
        return f"does not name {key}: {text}"
    return None if REMEDY.search(text) else f"no remedy: {text}"


def timed(attempt, *arguments):
    """What is bad about an attempt, also when it takes too long twice, the first time perhaps for
    compilation, or fails in a way of its own."""
    late = f"takes more than {PATIENCE} s"
    what = once(attempt, arguments, late)
    return once(attempt, arguments, late) if what == late else what


def once(attempt, arguments, late):
    """What is bad about an attempt; ``late`` when it takes too long."""
    signal.signal(signal.SIGALRM, too_late)
    signal.alarm(PATIENCE)
    try:
        return attempt(*arguments)
    except TimeUp:
        return late
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    finally:
        signal.alarm(0)


def attempts(folder):
    """(label, function that says what is bad) of all lines and snippets."""
    from fuzz_snippets import snippets

    for case, words, key, wrong in lines():
        words = [word.replace("{folder}", str(folder)) for word in words]
        if key != "out" and "out=/" not in words:
            words.append(f"out={folder}/out")
        yield f"{case} {' '.join(words)}", functools.partial(judge, case, words, key, wrong)
    yield from snippets(folder, sentence)


def run(every=1, first=0, show=False, limit=MEMORY):
    """(how many were made, list of (label, what is bad))."""
    bad, made = [], 0
    folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
    os.mkfifo(folder / "pipe")
    before = os.getcwd(), sys.argv, os.environ.get("HOME")
    os.chdir(folder)
    os.environ["HOME"] = str(folder)
    resource.setrlimit(resource.RLIMIT_AS, (int(limit), resource.getrlimit(resource.RLIMIT_AS)[1]))
    try:
        for number, (label, attempt) in enumerate(attempts(folder)):
            if number < first or (number - first) % every:
                continue
            made += 1
            if show:
                print(f"{number}", end="\r", file=sys.__stderr__, flush=True)
            what = timed(attempt)
            if what:
                bad.append((label, what))
                print(f"{number} {label}\n    {what}".encode(errors="backslashreplace").decode(), flush=True)
    finally:
        os.chdir(before[0])
        shutil.rmtree(folder, ignore_errors=True)
        sys.argv = before[1]
        os.environ["HOME"] = before[2] or ""
        resource.setrlimit(resource.RLIMIT_AS, (resource.getrlimit(resource.RLIMIT_AS)[1],) * 2)
    return made, bad


if __name__ == "__main__":
    keys = dict(word.split("=") for word in sys.argv[1:])
    made, bad = run(int(keys.get("every", 1)), int(keys.get("first", 0)), "show" in keys)
    print(f"{made} lines and snippets, {len(bad)} neither right nor refused in one sentence")
    sys.exit(bool(bad))
