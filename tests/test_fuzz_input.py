"""A part of the fuzz script of the benchmarks: every snippet, and of the command lines those that are refused
at once."""
import importlib
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parent / "benchmarks"


@pytest.fixture
def fuzz(monkeypatch):
    """The module ``fuzz_input``."""
    monkeypatch.setattr(sys, "argv", ["fuzz"])
    for folder in (BENCHMARKS, BENCHMARKS.parents[1] / "cases"):
        monkeypatch.syspath_prepend(str(folder))
    return importlib.import_module("fuzz_input")


def test_snippets_are_right_or_refused_in_one_sentence(fuzz, tmp_path):
    from fuzz_snippets import snippets

    slow = "MPM", "march", "couple", "open_dem", "DEM"  # the whole script has them too
    found = [(label, attempt) for label, attempt in snippets(tmp_path, fuzz.sentence)
             if not label.startswith(slow)]
    assert len(found) > 900
    assert not [(label, what) for label, attempt in found if (what := fuzz.timed(attempt))]


@pytest.mark.parametrize("case, words", [("beam_impact", "h=1e-5"), ("beam_impact", "cells=10000,10000"),
                                         ("beam_impact", "body=100000,100000"),
                                         ("beam_impact", "substeps=1e9"), ("beam_impact", "dt=1e-12 t_end=1"),
                                         ("column_collapse", "refine=100 h=0.001"),
                                         ("column_collapse", "box=1e30,1e30"),
                                         ("column_collapse", "ratio=-1"), ("granular_blocks", "spheres=500"),
                                         ("granular_blocks", "blocks=1e9"),
                                         ("granular_blocks", "spacing=1e-6"),
                                         ("granular_blocks", "disc_E=-1"), ("extreme", "h=1e-7"),
                                         ("extreme", "scene=rest"), ("extreme", "scene=swing friction=0.3")])
def test_sizes_beyond_the_machine_and_keys_without_effect(fuzz, tmp_path, case, words, monkeypatch):
    """At once, in one sentence that names the last key."""
    monkeypatch.setattr(fuzz, "PATIENCE", 10)
    key = "gravity" if words == "scene=rest" else words.split()[-1].split("=")[0]
    if words.startswith("dt="):
        key = "dt"
    assert fuzz.timed(fuzz.judge, case, [*words.split(), f"out={tmp_path}"], key, True) is None
