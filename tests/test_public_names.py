"""What a package hands out in ``__all__``: its examples run, its functions say what they take and return."""
import doctest
import importlib
import inspect

import numpy as np
import pytest

PACKAGES = ("mpm_fenicsx", "dem_liggghts", "coupling", "mpm_dem_store")


def public():
    """(package, name) of every function and class that a package hands out."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isclass(thing) or inspect.isfunction(thing):
                yield package, name


def examples(package, name):
    """Doctests of a public name. They may use the names of its file and of its package, and ``np``."""
    face = importlib.import_module(package)
    thing = getattr(face, name)
    home = inspect.getmodule(thing)
    known = {**vars(home), **{each: getattr(face, each) for each in face.__all__}, "np": np}
    return [test for test in doctest.DocTestFinder().find(thing, name, home, known) if test.examples]


@pytest.mark.parametrize("package, name", [pair for pair in public() if examples(*pair)])
def test_examples(package, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        np.set_printoptions(legacy="1.25")  # 1.0 and not np.float64(1.0), as the examples show it
    said, runner = [], doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    for test in examples(package, name):
        runner.run(test, out=said.append)
    assert not runner.failures, "".join(said)


def is_error(package, name):
    thing = getattr(importlib.import_module(package), name)
    return inspect.isclass(thing) and issubclass(thing, Exception)


def test_public_names_have_examples():
    """All but errors."""
    without = [pair for pair in public() if not examples(*pair) and not is_error(*pair)]
    assert len(without) <= 23, without


def functions(thing, name):
    """(name, function) of a function, or of the public methods of a class that are its own."""
    if not inspect.isclass(thing):
        yield name, thing
        return
    for key, member in vars(thing).items():
        member = getattr(member, "fget", None) or getattr(member, "__func__", member)
        own = key == "__init__" and not getattr(thing, "_is_protocol", False)  # typing gives protocols one
        if inspect.isfunction(member) and (own or not key.startswith("_")):
            yield f"{name}.{key}", member


def missing_annotations(function):
    signature = inspect.signature(function)
    missing = [p.name for p in signature.parameters.values() if p.annotation is p.empty]
    if signature.return_annotation is signature.empty and function.__name__ != "__init__":
        missing.append("return")
    return [name for name in missing if name not in ("self", "cls")]


def test_public_functions_have_annotations():
    missing = {}
    for package, name in public():
        for key, function in functions(getattr(importlib.import_module(package), name), name):
            if found := missing_annotations(function):
                missing[f"{package}.{key}"] = found
    assert len(missing) <= 38, missing
