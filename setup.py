"""Compile the LIGGGHTS shim, if LIGGGHTS is there: without it the package is complete but for
dem=liggghts."""
import os
import shutil
import subprocess
import zlib
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HEADERS = os.environ.get("LIGGGHTS_INCLUDE", "/usr/include/liggghts")
FOLDER = "dem_liggghts/liggghts/shim"
SHIM = sorted(str(path) for path in Path(FOLDER).iterdir() if path.suffix in (".cpp", ".h"))
# Headers that are generated when LIGGGHTS is built and are not in the package: they include the models, here
# those used
MODELS = {"surface": "surface_model_default.h", "normal": "normal_model_hertz.h", "rolling": None,
          "contact": None, "tangential": "tangential_model_history.h", "cohesion": "cohesion_model_sjkr.h"}


def mpi_flags(what):
    """Words that mpicxx adds, ``what`` as Open MPI names them; of the MPI that LIGGGHTS was built with, as
    another one may come first on the path, like that of a wheel."""
    compiler = shutil.which("mpicxx.openmpi") or "mpicxx"
    return subprocess.run([compiler, f"--showme:{what}"], check=True, capture_output=True,
                          text=True).stdout.split()


def shim():
    """The extension that speaks with LIGGGHTS, or none where something for it is missing."""
    try:
        include, link_flags = mpi_flags("incdirs"), mpi_flags("link")
    except (OSError, subprocess.CalledProcessError):
        return without("mpicxx of Open MPI is missing (apt install libopenmpi-dev)")
    if not Path(HEADERS, "lammps.h").exists():
        return without(f"no LIGGGHTS headers in {HEADERS} (apt install libliggghts-dev)")
    # library.py recognises an old shim by it
    source = zlib.crc32(b"".join(Path(name).read_bytes() for name in SHIM))
    return [Extension("dem_liggghts.liggghts.libdemshim", [f"{FOLDER}/shim.cpp"], depends=SHIM,
                      libraries=["liggghts"], optional=True,
                      include_dirs=include,  # before those of the environment, which may have another mpi.h
                      define_macros=[("SHIM_SOURCE", f"{source}u")],
                      extra_link_args=link_flags,
                      extra_compile_args=["-std=c++14", "-O2", "-g0", "-isystem", HEADERS])]


def without(reason):
    """No extension, and a line that says why."""
    print(f"mpm-dem: built without LIGGGHTS, dem=reference works: {reason}")
    return []


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


setup(ext_modules=shim(), cmdclass={"build_ext": BuildShim})
