"""Compile the LIGGGHTS shim, if LIGGGHTS is there: without it the package is complete but for
dem=liggghts."""
import os
import shutil
import subprocess
import sys
import sysconfig
import zlib
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

# LIGGGHTS of one's own: the folder it was installed or built in, with headers and library. Its headers alone
# may also be named by LIGGGHTS_INCLUDE.
PREFIX = os.environ.get("LIGGGHTS_PREFIX")
FOLDER = "dem_liggghts/liggghts/shim"
SHIM = sorted(str(path) for path in Path(FOLDER).iterdir() if path.suffix in (".cpp", ".h"))
# Headers that are generated when LIGGGHTS is built and are not in the package: they include the models, here
# those used
MODELS = {"surface": "surface_model_default.h", "normal": "normal_model_hertz.h", "rolling": None,
          "contact": None, "tangential": "tangential_model_history.h", "cohesion": "cohesion_model_sjkr.h"}


def first_with(name, *folders):
    """The first of the folders of PREFIX that has the file ``name``."""
    for folder in folders:
        if Path(PREFIX, folder, name).exists():
            return os.path.abspath(Path(PREFIX, folder))
    sys.exit(f"error: LIGGGHTS_PREFIX is {PREFIX}, which has no {name} in {', '.join(folders)}: give "
             "the folder that LIGGGHTS was installed in, with headers and shared library, or leave it out")


def liggghts():
    """Folder of LIGGGHTS' headers, and those of its library that the linker does not know."""
    headers = os.environ.get("LIGGGHTS_INCLUDE")
    if not PREFIX:
        return headers or "/usr/include/liggghts", []
    multiarch = f"lib/{sysconfig.get_config_var('MULTIARCH')}"
    library = first_with("libliggghts.so", "lib", "lib64", multiarch, "src", "build")
    return headers or first_with("lammps.h", "include/liggghts", "include", "src"), [library]


def mpi_flags(what):
    """Words that mpicxx adds, ``what`` as Open MPI names them; of the MPI that LIGGGHTS was built with, as
    another one may come first on the path, like that of a wheel."""
    compiler = shutil.which("mpicxx.openmpi") or "mpicxx"
    return subprocess.run([compiler, f"--showme:{what}"], check=True, capture_output=True,
                          text=True).stdout.split()


def shim():
    """The extension that speaks with LIGGGHTS, or none where something for it is missing."""
    headers, libraries = liggghts()
    try:
        include, link_flags = mpi_flags("incdirs"), mpi_flags("link")
    except (OSError, subprocess.CalledProcessError):
        return without("mpicxx of Open MPI is missing (apt install libopenmpi-dev)")
    if not Path(headers, "lammps.h").exists():
        return without(f"no LIGGGHTS headers in {headers} (apt install libliggghts-dev)")
    # library.py recognises an old shim by it
    source = zlib.crc32(b"".join(Path(name).read_bytes() for name in SHIM))
    return [Extension("dem_liggghts.liggghts.libdemshim", [f"{FOLDER}/shim.cpp"], depends=SHIM,
                      libraries=["liggghts"], library_dirs=libraries, runtime_library_dirs=libraries,
                      optional=not PREFIX,  # who names it wants it
                      include_dirs=include,  # before those of the environment, which may have another mpi.h
                      define_macros=[("SHIM_SOURCE", f"{source}u")],
                      extra_link_args=link_flags,
                      extra_compile_args=["-std=c++14", "-O2", "-g0", "-isystem", headers])]


def without(reason):
    """No extension, and a line that says why; an error for who has named LIGGGHTS."""
    if PREFIX:
        sys.exit(f"error: LIGGGHTS_PREFIX is given, but {reason}")
    print(f"mpm-dem: built without LIGGGHTS, dem=reference works: {reason}")
    return []


class BuildCases(build_py):
    """The cases go along as ``mpm_dem_cases``, where the command mpm-dem finds them."""

    def run(self):
        """In the source tree they stay where they are."""
        super().run()
        if not getattr(self, "editable_mode", False):
            shutil.copytree("cases", Path(self.build_lib, "mpm_dem_cases"), dirs_exist_ok=True,
                            ignore=shutil.ignore_patterns("__pycache__"))


class BuildShim(build_ext):
    """A plain shared library, opened with ctypes: no Python in its name, no module behind it."""

    def get_ext_filename(self, fullname):
        """Without the version of Python."""
        return fullname.replace(".", os.sep) + ".so"

    def get_export_symbols(self, ext):
        """No function that Python looks for."""
        return []

    def build_extension(self, ext):
        """First the headers that LIGGGHTS' own build would make."""
        stubs = Path(self.build_temp, "stubs")
        stubs.mkdir(parents=True, exist_ok=True)
        for kind, model in MODELS.items():
            (stubs / f"style_{kind}_model.h").write_text(f'#include "{model}"\n' if model else "")
        ext.extra_compile_args = [*ext.extra_compile_args, "-isystem", str(stubs)]
        super().build_extension(ext)


setup(ext_modules=shim(), cmdclass={"build_ext": BuildShim, "build_py": BuildCases})
