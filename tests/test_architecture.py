"""Who may import whom, how long files and functions may be, and that what is promised exists."""
import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("mpm_fenicsx", "dem_liggghts", "coupling")
# which all may import, as they import none of them; the command is for the user, none of them imports it
LEAVES = ("mpm_dem_checks", "mpm_dem_cache", "mpm_dem_direct", "mpm_dem_store", "mpm_dem_tree",
          "mpm_dem_series", "mpm_dem_mpi", "mpm_dem_loading", "mpm_dem_command")
LEAF, CACHE, DIRECT, STORE, TREE, SERIES, OF_MPI, LOADING, COMMAND = LEAVES
FORBIDDEN = {  # packages and libraries that a package must not import, nor anything inside them
    "mpm_fenicsx": {"coupling", "dem_liggghts", "cases"},
    "dem_liggghts": {"coupling", "mpm_fenicsx", "cases", "dolfinx", "petsc4py"},
    "coupling": {"mpm_fenicsx", "dem_liggghts", "cases", "dolfinx", "petsc4py", "ufl", "basix"}}
# lines; kernels are compiled functions with loops over points
MODULE, FUNCTION, KERNEL, CASE = 260, 40, 60, 100
PARAMETERS = 8
STATE_A_SCENE = {"mpm_fenicsx/mpm.py:__init__"}  # which may have more


def sources(*packages):
    return [path for package in packages for path in sorted((ROOT / package).rglob("*.py"))]


def imports(path):
    """Top-level names of all absolute imports of a file, also of those inside functions."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_imports_upwards(package):
    wrong = {path.name: found for path in sources(package) if (found := imports(path) & FORBIDDEN[package])}
    assert not wrong, wrong


@pytest.mark.parametrize("package", ["coupling", "dem_liggghts"])
def test_packages_stand_alone(package):
    """Imported alone, a package brings nothing along that it must not know: neither directly nor by
    others."""
    code = f"import sys, {package}; print(*{{name.split('.')[0] for name in sys.modules}})"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True,
                            text=True).stdout
    assert package in loaded.split() and not FORBIDDEN[package] & set(loaded.split())


def test_liggghts_is_loaded_only_when_asked_for():
    code = "import sys, dem_liggghts; print('dem_liggghts.liggghts' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


def test_the_leaves_import_nothing_of_ours():
    assert imports(ROOT / f"{CACHE}.py") <= {"os", "pathlib", "stat", "sys", "tempfile"}
    assert imports(ROOT / f"{DIRECT}.py") <= {"typing"}
    assert imports(ROOT / f"{OF_MPI}.py") <= {"os", "re", "typing"}
    assert imports(ROOT / f"{LOADING}.py") <= {"gc", "typing", "numba", "llvmlite"}
    assert imports(ROOT / f"{LEAF}.py") <= {"contextlib", "math", "os", "pathlib", "typing", "numpy"}
    # it runs where numpy is missing, and imports MPI only to tell an error
    assert imports(ROOT / f"{COMMAND}.py") <= {"ast", "concurrent", "json", "pathlib", "re", "runpy",
                                               "signal", "subprocess", "sys", "time", "typing", "mpi4py",
                                               OF_MPI}
    assert imports(ROOT / f"{SERIES}.py") <= {"typing", "numpy", LEAF}
    plain = {"ast", "contextlib", "errno", "io", "json", "math", "os", "re", "shutil", "struct", "typing",
             "urllib", "zlib"}
    assert imports(ROOT / f"{TREE}.py") <= plain | {"numpy", "mpi4py", "h5py"}
    assert imports(ROOT / f"{STORE}.py") <= plain | {"numpy", "mpi4py", "h5py", TREE}


def test_names_that_differ_between_versions_have_their_files():
    wrapped = {"dolfinx", "ufl", "ffcx"}
    users = {str(path.relative_to(ROOT)) for path in sources(*PACKAGES) if imports(path) & wrapped}
    assert users == {f"mpm_fenicsx/{floor}/compat.py" for floor in ("grid", "laws")}, (
        "import from dolfinx and ufl in compat.py, and from there elsewhere")


DEM_SCENE = [f"dem_liggghts/scene/{name}.py" for name in ("scene", "materials", "spheres", "walls",
                                                          "clusters")]


@pytest.mark.parametrize("file", ["mpm_fenicsx/scene/bodies.py", *DEM_SCENE])
def test_scenes_are_plain_data(file):
    plain = {"dataclasses", "functools", "itertools", "typing", "numpy", "math", LEAF, SERIES}
    assert imports(ROOT / file) <= plain


FLOORS = {  # from the ground up: each imports from those before it, and from files beside them
    "mpm_fenicsx": ["laws", "scene", "basis", "grid", "points", "terms", "solve", "output"],
    "dem_liggghts": ["scene", "contact", "search", "common", "reference", "liggghts"],
    "coupling": ["ledger", "maps", "pictures", "loop", "records", "hazard"]}


@pytest.mark.parametrize("package", FLOORS)
def test_subpackages_import_downwards(package):
    for path in sources(package):
        floor = path.relative_to(ROOT / package).parts[0]
        if floor not in FLOORS[package]:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level == 2:
                names = [node.module.split(".")[0]] if node.module else [alias.name for alias in node.names]
                for name in set(names) & set(FLOORS[package]):
                    assert FLOORS[package].index(name) < FLOORS[package].index(floor), (path, name)


def imported_files(path):
    """Files of the project that a file imports, also those inside functions; a folder stands for its
    ``__init__.py`` when a name of that is taken."""
    home, found = path.relative_to(ROOT).parts[:-1], set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            base = [*home[:len(home) + 1 - node.level]] if node.level else []
            base += node.module.split(".") if node.module else []
            for alias in node.names:
                modules = [Path(*base, f"{alias.name}.py"), Path(*base, alias.name, "__init__.py"),
                           Path(*base).with_suffix(".py"), Path(*base, "__init__.py")]
                found |= {next((ROOT / module for module in modules if (ROOT / module).is_file()), None)}
        elif isinstance(node, ast.Import):
            found |= {ROOT / f"{alias.name.replace('.', '/')}.py" for alias in node.names}
    return {file for file in found if file and file.is_file()} - {path}


def reached(start, graph):
    seen, ahead = set(), [start]
    while ahead:
        new = graph.get(ahead.pop(), set()) - seen
        seen |= new
        ahead += new
    return seen


def test_files_do_not_import_each_other_in_circles():
    graph = {path: imported_files(path) for path in sources(*PACKAGES, "cases")}
    circles = {str(path.relative_to(ROOT)) for path in graph if path in reached(path, graph)}
    assert not circles


def test_cases_are_short_and_stand_alone():
    """A case is a script in ``cases``; what lies in a folder there belongs to studies."""
    cases = sorted((ROOT / "cases").glob("*.py"))
    names = {path.stem for path in cases}
    long = {path.name for path in cases if len(path.read_text(encoding="utf-8").splitlines()) > CASE}
    tied = {path.name for path in cases if imports(path) & names}
    assert not long and not tied


def test_functions_have_few_parameters():
    many = {}
    for path in [*(ROOT / f"{leaf}.py" for leaf in LEAVES), *sources(*PACKAGES)]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                names = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                if len([name for name in names if name not in ("self", "cls")]) > PARAMETERS:
                    many[f"{path.relative_to(ROOT)}:{node.name}"] = len(names)
    assert set(many) <= STATE_A_SCENE, many


@pytest.mark.parametrize("module", [*PACKAGES, "mpm_fenicsx.laws"])
def test_public_names_exist(module):
    package = importlib.import_module(module)
    missing = [name for name in getattr(package, "__all__", ()) if not hasattr(package, name)]
    assert not missing and len(set(getattr(package, "__all__", ()))) == len(getattr(package, "__all__", ()))


def lengths(path):
    """(name, lines without signature and docstring) of every function of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            yield node.name, node.end_lineno - body[0].lineno + 1 if body else 0


def is_kernel_file(path):
    """Files whose functions numba compiles."""
    text = path.read_text(encoding="utf-8")
    return any(mark in text for mark in ("@njit", "@compiled", "@called", "@inlined", "specialise"))


def test_modules_and_functions_are_short():
    modules, functions = [], []
    for path in [*(ROOT / f"{leaf}.py" for leaf in LEAVES), *sources(*PACKAGES, "cases")]:
        name = path.relative_to(ROOT)
        modules.append((len(path.read_text(encoding="utf-8").splitlines()), str(name), MODULE))
        limit = KERNEL if is_kernel_file(path) else FUNCTION
        functions += [(length, f"{name}:{function}", limit) for function, length in lengths(path)]
    for title, table in ("longest modules", modules), ("longest functions", functions):
        print(title)
        for length, name, limit in sorted(table, reverse=True)[:8]:
            print(f"  {length:4} of {limit}  {name}")
    assert not [entry for entry in modules + functions if entry[0] > entry[2]]
