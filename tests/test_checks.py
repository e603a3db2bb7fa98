"""One validator per kind of value: what passes, and the one sentence for what does not."""
import os

import numpy as np
import pytest

import mpm_dem_checks as check


@pytest.mark.parametrize("value", ["1", None, True, np.nan, np.inf, 1j, [1.0], object(), 10**400, 1e31])
def test_a_number_is_a_finite_number(value):
    with pytest.raises(ValueError, match=r"^v is .* m: give "):
        check.finite("v", value, "m")
    with pytest.raises(ValueError, match="^v is .*: give "):
        check.count("v", value)


def test_kinds_of_numbers():
    assert check.finite("v", np.float32(2)) == check.positive("v", np.array(2)) == check.count("v", 2.0) == 2
    assert check.not_negative("v", -0.0) == 0.0 and check.count("v", 0, 0) == 0
    for bad in (-1, 1e-300):
        with pytest.raises(ValueError, match=f"v is {bad}: give "):
            check.not_negative("v", bad)
    with pytest.raises(ValueError, match="v is 0: give a positive number"):
        check.positive("v", 0)
    with pytest.raises(ValueError, match="v is 2.5: give a whole number of at least 1"):
        check.count("v", 2.5)
    with pytest.raises(ValueError, match="v is 3000000000: give a whole number of at least 1 and at most "
                       "2147483647"):
        check.count("v", 3000000000)


@pytest.mark.parametrize("ends, inside", [("[]", (0, 1)), ("(]", (1,)), ("[)", (0,)), ("()", ())])
def test_intervals(ends, inside):
    for end in (0, 1):
        if end in inside:
            assert check.between("v", end, 0, 1, ends=ends) == end
        else:
            with pytest.raises(ValueError, match=f"v is {end}: give a number from 0 to 1 without .*{end}"):
                check.between("v", end, 0, 1, ends=ends)
    with pytest.raises(ValueError, match="v is -0.1: "):
        check.between("v", -0.1, 0, 1, ends=ends)


@pytest.mark.parametrize("value, sentence", [((1, 2, 3), "give 2 whole numbers, each at least 1"),
                                             (5, "give 2 whole"), ("12", "give 2 whole"),
                                             ((1, np.inf), "give 2 whole"), ((0, 1), "give 2 whole"),
                                             ((1.5, 1), "give 2 whole"), (((1, 2), 3), "give 2 whole")])
def test_several_whole_numbers(value, sentence):
    with pytest.raises(ValueError, match=f"n is .*: {sentence}"):
        check.counts("n", value, 2)
    assert check.counts("n", np.array([3.0, 4.0]), 2) == (3, 4)


def test_several_numbers():
    assert check.numbers("g", [0, -9.81], 2) == (0.0, -9.81)
    with pytest.raises(ValueError, match=r"g is \(0, 1, 2\) m: give 2 numbers"):
        check.numbers("g", (0, 1, 2), 2, "m")
    with pytest.raises(ValueError, match=r"g \(number 2 of 2\) is nan m: give a finite number"):
        check.numbers("g", (0, np.nan), 2, "m")


@pytest.mark.parametrize("value, sentence",
                         [([[1.0, np.nan]], r"x \(entry 0, 1\) is nan m: give finite numbers"),
                          ("abc", "x is 'abc': give numbers of shape"),
                          ([[1], [1, 2]], "give numbers of shape"),
                          (3.0, r"x is 3.0: give numbers of shape \(n, 2\) or \(n, 3\)"),
                          (np.zeros((2, 4)), r"x has shape \(2, 4\)"), ({}, "x is {}")])
def test_arrays(value, sentence):
    with pytest.raises(ValueError, match=sentence):
        check.array("x", value, ("n", 2), ("n", 3), unit="m")


@pytest.mark.parametrize("value, sentence",
                         [([[0, 5]], r"elements name nodes 0..5, there are 5: give " r"numbers from 0 to 4"),
                          ([[-1, 0]], "name nodes -1..0"), ([[0.5, 1]], "give whole numbers, those of nodes"),
                          ([["a", "b"]], "give numbers of shape"),
                          ([[0, 1, 2]], r"elements is \[\[0, 1, 2\]\]: give numbers of shape \(n, 2\)"),
                          ([[0, np.nan]], "give whole numbers")])
def test_indices(value, sentence):
    with pytest.raises(ValueError, match=sentence):
        check.indices("elements", value, 5, (2,), "nodes")
    assert check.indices("elements", [[0.0, 4.0]], 5, (2,), "nodes").tolist() == [[0, 4]]


def test_words_and_functions():
    assert check.choice("law", "linear", ("linear", "other")) == "linear" and check.truth("f",
                                                                                          np.True_) is True
    for bad in ("liner", None, 3, np.zeros(2), []):
        with pytest.raises(ValueError, match="law is .*: choose one of linear, other"):
            check.choice("law", bad, ("linear", "other"))
    with pytest.raises(ValueError, match="f is 1: give True or False"):
        check.truth("f", 1)


@pytest.mark.parametrize("where, sentence", [
    (lambda x: x[:, 0], r"where gives float64 of shape \(3,\) for positions of shape \(3, 2\): let it say "
     r"True or False"),
    (lambda x: True, r"where gives bool of shape \(\)"),
    (lambda x: x[7], r"where fails for shape \(3, 2\) \(IndexError"),
    ("left", "where is 'left': give a function")])
def test_a_mask_is_true_or_false_of_each(where, sentence):
    with pytest.raises(ValueError, match=sentence):
        check.mask("where", where, np.zeros((3, 2)))
    assert check.mask("where", lambda x: x[:, 0] == 0, np.zeros((3, 2))).all()


def test_paths(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "x").write_text("")
    os.mkfifo(tmp_path / "pipe")
    assert check.path("out", "~/x") == check.file("mesh", "~/x") == tmp_path / "x"
    for bad in ("", "a\0b", b"\xff".decode(errors="surrogateescape"), 3, "~nobody-of-this-name/x"):
        with pytest.raises(ValueError, match="^out is .*: give ") as caught:
            check.path("out", bad)
        str(caught.value).encode()
    for bad, why in (("pipe", "this is a folder, pipe or device"), (".", "this is a folder"),
                     ("y", "does not exist")):
        with pytest.raises(ValueError, match=why):
            check.file("mesh", tmp_path / bad)


def test_sizes(monkeypatch):
    check.check_memory("2 cells", 1e3, "")
    check.check_work("2 steps", 1e11, "")
    with pytest.raises(ValueError, match="^1 cell need about 1e.06 GB of memory, .* GB for each process: "
                       "take fewer"):
        check.check_memory("1 cell", 1e15, "take fewer")
    with pytest.raises(ValueError, match="^3 steps take about 2e.12 operations, more than 1e.12: take fewer"):
        check.check_work("3 steps", 2e12, "take fewer")
    alone = check.memory()
    monkeypatch.setenv("OMPI_COMM_WORLD_LOCAL_SIZE", "4")
    assert check.memory() == alone / 4
