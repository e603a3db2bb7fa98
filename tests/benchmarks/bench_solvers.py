"""What each preset of the linear solver costs, case by case: iterations, factor and solve time, total.

    python tests/benchmarks/bench_solvers.py [scenes=plane,space,…] [solvers=direct,lu,…] [out=FILE]

Each scene is a few windows of a case, each run a process of its own. Prints a Markdown table per scene;
nothing passes or fails here. The times are those of PETSc's events: "factor" is the set-up of the
preconditioner, "solve" the Krylov method or the two triangular solves. Options of the table's last rows are
what a user can type.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NEW = ["-mpm_snes_lag_jacobian", "1"]
SCENES = {  # name → (title, script, words)
    "plane": ("beam in the plane, as it is", "beam_impact", ["t_end=2e-4"]),
    "plane_new": ("the same, new tangent in every iteration", "beam_impact", ["t_end=1e-4", *NEW]),
    "paper": ("beam in the plane, paper's grid and window", "beam_impact", ["preset=paper", "t_end=5e-6"]),
    "space": ("beam in space, as it is", "beam_impact", ["dim=3", "t_end=6e-5"]),
    "space_new": ("the same, new tangent in every iteration", "beam_impact", ["dim=3", "t_end=2e-5", *NEW]),
    "space_paper": ("beam in space, paper's window (5e-8 s), new tangent in every iteration", "beam_impact",
                    ["dim=3", "dt=5e-8", "substeps=1", "t_end=5e-7", *NEW]),
    "three": ("three impacts", "multiple_impact", ["t_end=2e-4"]),
    "column": ("granular column", "column_collapse", ["t_end=0.01"])}
SOLVERS = {"direct": ["solver=direct"], "lu": ["solver=lu"], "cg": ["solver=cg"], "gmres": ["solver=gmres"],
           "gamg": ["solver=gamg"], "hypre": ["solver=hypre"], "cg -mpm_pc_type jacobi": ["solver=cg",
                                                                                          "-mpm_pc_type",
                                                                                          "jacobi"],
           "direct -mpm_pc_factor_mat_solver_type mumps": ["solver=direct", "-mpm_pc_factor_mat_solver_type",
                                                           "mumps"]}
EVENTS = {"factor": ("PCSetUp", "PCSetUpOnBlocks"), "solve": ("KSPSolve",)}


def measure(script, words, out):
    """In a process of its own: run the case and write what its solver did."""
    sys.path[:0] = [str(ROOT), str(ROOT / "cases")]
    from petsc4py import PETSc

    import mpm_fenicsx  # noqa: F401  PETSc hears the options

    PETSc.Log.begin()
    from coupling import cli
    from mpm_fenicsx.solve.equations import Equations
    from mpm_fenicsx.solve.snes import Newton

    done = {"solves": 0, "linear": 0, "factors": 0}
    run, tangent = Newton._run, Equations.tangent

    def counted(self, *arguments):
        answer = run(self, *arguments)
        done["solves"] += answer[1]
        done["linear"] += self.snes.getLinearSolveIterations()
        return answer

    def assembled(self, trial):
        done["factors"] += 1
        return tangent(self, trial)

    Newton._run, Equations.tangent = counted, assembled
    case = __import__(script)
    case.main(**cli.parse(case.main, [*words, f"out={out}"]))
    events = {name: [PETSc.Log.Event(event).getPerfInfo() for event in names]
              for name, names in EVENTS.items()}
    done |= {name: sum(info["time"] for info in infos) for name, infos in events.items()}
    (Path(out) / "solver.json").write_text(json.dumps(done))


def run(script, words):
    """What the solver did and the report of the run, or the reason why there is none."""
    with tempfile.TemporaryDirectory() as out:
        answer = subprocess.run([sys.executable, __file__, f"measure={script}", f"out={out}", *words],
                                text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                env={"OMP_NUM_THREADS": "1", **os.environ})
        if answer.returncode:
            lines = answer.stderr.strip().splitlines() or ["failed"]
            return next((line.split("Error: ", 1)[-1] for line in reversed(lines) if "Error: " in line),
                        lines[-1])
        return [json.loads((Path(out) / name).read_text()) for name in ("solver.json", "report.json")]


def table(title, script, words, solvers):
    print(f"\n{title} (`python cases/{script}.py {' '.join(words)}`)\n")
    print("| solver | in PETSc's words | Newton per window | linear per Newton | factors made | factor [ms] "
          "| " "solve [ms] | solver per window [ms] | whole window [ms] |\n" + "|" + " --- |" * 9)
    run(script, [*words, "solver=direct"])  # the first run compiles
    for name in solvers:
        answer = run(script, [*words, *SOLVERS[name]])
        if isinstance(answer, str):
            print(f"| {name} | {answer.replace('|', '/')} |" + " |" * 7)
            continue
        done, report = answer
        windows, solves = report["windows"], max(done["solves"], 1)
        cells = [name, report["solver"].split(", ", 1)[1], f"{solves / windows:.2f}",
                 f"{done['linear'] / solves:.1f}", done["factors"],
                 f"{1e3 * done['factor'] / max(done['factors'], 1):.2f}",
                 f"{1e3 * done['solve'] / solves:.3f}",
                 f"{1e3 * (done['factor'] + done['solve']) / windows:.2f}",
                 f"{1e3 * report['window_s'] / windows:.2f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def main(given):
    scenes = given.get("scenes", ",".join(SCENES)).split(",")
    for scene in scenes:
        title, script, words = SCENES[scene]
        if not (ROOT / "cases" / f"{script}.py").is_file():
            continue
        table(title, script, words, given.get("solvers", ",".join(SOLVERS)).split(","))


if __name__ == "__main__":
    if sys.argv[1:] and sys.argv[1].startswith("measure="):
        measure(sys.argv[1].partition("=")[2], sys.argv[3:], sys.argv[2].partition("=")[2])
    else:
        main(dict(word.split("=", 1) for word in sys.argv[1:]))
