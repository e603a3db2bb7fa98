"""Lengths of time as a user types them."""
import math
from random import Random

import pytest

from coupling.durations import Every, read_every, seconds, shown


@pytest.mark.parametrize("text, expected", [
    ("90s", 90), ("10min", 600), ("23h50min", 85800), ("1.5h", 5400), ("2d", 172800), ("1d2h", 93600),
    ("1d2h3min4.5s", 93784.5), (".5s", 0.5), ("007s", 7), ("1h90min", 9000),
    ("23:50:00", 85800), ("0:00:01", 1), ("1-12:00:00", 129600), ("100:00:00", 360000)])
def test_a_length_of_time_is_read(text, expected):
    assert seconds("walltime", text) == expected


@pytest.mark.parametrize("text", [
    "", "0s", "0", "0:00:00", "-5min", "nan", "inf", "1e3s", "5m", "5 min", "5MIN", "min", "1min2h", "1h1h",
    "2h3", "23:50", "1-12:00", "00:60:00", "1:2:3:4", "٥min", "10mín", "1" * 400 + "s", "soon", "end",
    None, True, -1.0, math.nan, math.inf])
def test_anything_else_is_one_sentence(text):
    with pytest.raises(ValueError, match=r"^walltime is .*: give .*such as 90s, 10min, 23h50min") as caught:
        seconds("walltime", text)
    assert "\n" not in str(caught.value)


def test_a_number_alone_is_asked_for_its_unit():
    with pytest.raises(ValueError, match="^walltime is '100': give it with a unit, such as 100s$"):
        seconds("walltime", "100")


@pytest.mark.parametrize("length, text", [
    (85800, "23h50min"), (0.25, "0.25s"), (60, "1min"), (59.9999, "1min"), (129600, "1d12h"),
    (90061, "1d1h1min1s"), (0, "0s"), (1e-5, "0s")])
def test_a_length_of_time_is_shown(length, text):
    assert shown(length) == text


def test_what_is_shown_is_read_as_what_it_was():
    draw = Random(1).uniform
    for _ in range(500):
        length = round(10 ** draw(-3, 7), 3)
        assert seconds("walltime", shown(length)) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("value, expected", [
    (None, None), ("end", Every()), ("10min", Every(seconds=600.0)), ("0:10:00", Every(seconds=600.0)),
    ("500", Every(windows=500)), (500, Every(windows=500)), ("5e2", Every(windows=500)),
    (1, Every(windows=1))])
def test_how_often_a_checkpoint_is_written(value, expected):
    assert read_every(value) == expected


@pytest.mark.parametrize("value", ["0", "-3", "1.5", 0, -1, 2.5, True, "never", "", "0s", "5e99", "1e400",
                                   b"end"])
def test_anything_else_does_not_say_how_often(value):
    with pytest.raises(ValueError, match="^checkpoint is .*: give a number of windows such as 500, a run "
                       "time such as 10min, or end$"):
        read_every(value)
