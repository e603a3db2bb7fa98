"""The command that measures everything anew: sections land between their markers, a part that fails does not
end it."""
import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture
def reporter(tmp_path, monkeypatch):
    """The module tests/benchmarks/make_report.py in a project that has two documents and two small parts."""
    spec = importlib.util.spec_from_file_location("make_report",
                                                  Path(__file__).parent / "benchmarks/make_report.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/report.md").write_text("# Measured\n\n<!-- good: made by ./dev report -->\nold\n"
                                             "<!-- end of good -->\n\nafter\n")
    (tmp_path / "docs/other.md").write_text("# Other\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "WARM_UP", [])
    monkeypatch.setattr(module, "PARTS", {
        "good": module.Part("Good", [sys.executable, "-c", "print('| 1 | 2 |')"]),
        "bad": module.Part("Bad", [sys.executable, "-c", "raise SystemExit(3)"], "docs/other.md"),
        "slow": module.Part("Slow", [sys.executable, "-c", "import time; time.sleep(60)"], limit=0.5),
        "absent": module.Part("Absent", ["nothing"], needs="coupling/nothing.py")})
    return module


def test_sections_and_failures(reporter, tmp_path, capsys):
    assert reporter.main([f"out={tmp_path}/out"]) == 1
    text = (tmp_path / "docs/report.md").read_text()
    assert "| 1 | 2 |" in text and "old" not in text and "\nafter\n" in text and ", load " in text
    assert "## Slow" in text and "**This part failed.**" in text and "Absent" not in text
    assert "**This part failed.**" in (tmp_path / "docs/other.md").read_text()
    said = capsys.readouterr()
    assert "bad failed (3)" in said.err and "slow failed (more than 0.5 s)" in said.err
    assert "good: " in said.out


def test_parts_alone_keep_the_other_sections(reporter, tmp_path):
    assert reporter.main(["parts=good", f"out={tmp_path}/out"]) == 0
    first = (tmp_path / "docs/report.md").read_text()
    assert reporter.main(["parts=slow", f"out={tmp_path}/out"]) == 1
    second = (tmp_path / "docs/report.md").read_text()
    assert first.count("\n| 1 | 2 |") == second.count("\n| 1 | 2 |") == 1 and second.count("## Good") == 1
    with pytest.raises(SystemExit, match="parts=wrong: choose of good, bad"):
        reporter.main(["parts=wrong"])


def test_every_part_of_the_real_report_exists():
    """Scripts, cases and documents that the parts name are there, and each document has its markers."""
    root = Path(__file__).parents[1]
    spec = importlib.util.spec_from_file_location("make_report", root / "tests/benchmarks/make_report.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, part in module.PARTS.items():
        files = [word for word in part.command if word.endswith(".py")]
        assert all((root / file).is_file() for file in files), name
        assert f"<!-- {name}: made by ./dev report -->" in (root / part.document).read_text(), name
    assert (root / module.OVERLAY.partition("=")[2]).is_file()


@pytest.mark.parametrize("rows, sentence",
                         [(["2e-3,4e-6,0.33,ok,0.0018", "5e-3,4e-6,0.2,ok,0.02"],
                           "met, 0.18% in 0.33 s (h=2e-3, dt=4e-6)"),
                          (["2e-3,4e-6,0.7,ok,0.0018"], "**missed**, 0.18% in 0.70 s"),
                          (["2e-3,4e-6,0.3,ok,0.01"], "**no run has")])
def test_targets(reporter, tmp_path, rows, sentence):
    folder = tmp_path / "out/beam_2d"
    folder.mkdir(parents=True)
    (folder / "work_precision.csv").write_text("\n".join(["h,dt,window_s,status,error_force", *rows, ""]))
    assert sentence in reporter.targets(tmp_path / "out")
