"""The recipe of razy for Spack 1.0 or newer: `spack dev-build razy@main` in the folder of razy."""

from spack.package import conflicts, depends_on, version
from spack_repo.builtin.build_systems.cmake import CMakePackage


class Razy(CMakePackage):
    """Vibration of machines with impacts, clearances and friction."""

    version("main")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("mpi")
    depends_on("hdf5@1.10:+fortran+hl")
    depends_on("lapack")
    depends_on("blas")
    depends_on("arpack-ng")
    depends_on("python@3.11:", type="run")
    for package in ("f90nml", "h5py", "matplotlib", "numpy", "typeguard", "xarray"):
        depends_on(f"py-{package}", type="run")

    conflicts("%gcc@:11")

    def cmake_args(self):
        """Leave out the tests."""
        return [self.define("RAZY_TESTS", False)]

    def setup_run_environment(self, env):
        """Make `import razy` work."""
        env.prepend_path("PYTHONPATH", self.prefix.share.razy.python)
