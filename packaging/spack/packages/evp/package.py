# SPDX-License-Identifier: GPL-2.0-only
# spack repo add packaging/spack && spack install --no-checksum evp, in the folder that holds evp-VERSION.tar.gz.
# NOT RUN: no Spack was at hand; see doc/install.rst.
import os

from spack_repo.builtin.build_systems.cmake import CMakePackage

from spack.package import Executable, depends_on, license, resource, run_after, version

# A plugin works with one LAMMPS release only, and an installed LAMMPS has a part of its headers: the others are taken
# from the source of that release. LAMMPS in Spack: tag of LAMMPS' repository.
RELEASES = {"20250722.4": "stable_22Jul2025_update4"}


class Evp(CMakePackage):
    """LAMMPS plugin for elastoviscoplastic solids of discrete elements."""

    # git archive --prefix=evp-1.0.0/ --output=evp-1.0.0.tar.gz HEAD
    url = f"file://{os.getcwd()}/evp-1.0.0.tar.gz"
    manual_download = True

    license("GPL-2.0-only")

    version("1.0.0")

    depends_on("cxx", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("mpi")
    depends_on("lammps+plugin+lib+mpi lammps_sizes=smallbig", type=("build", "link", "run"))
    depends_on("lammps@" + ",".join(f"={release}" for release in RELEASES))
    depends_on("python@3.9:", type="run")
    for module in ("py-numpy", "py-scipy", "py-matplotlib"):
        depends_on(module, type="run")

    for release, tag in RELEASES.items():
        resource(name=f"lammps-{release}", git="https://github.com/lammps/lammps.git", tag=tag,
                 placement="lammps-source", when=f"^lammps@={release}")

    def cmake_args(self):
        return [
            self.define("LAMMPS_SOURCE_DIR", os.path.join(self.stage.source_path, "lammps-source")),
            self.define("LAMMPS_ROOT", self.spec["lammps"].prefix),
            self.define("BUILD_TESTING", False),
        ]

    def setup_run_environment(self, env):
        # Spack's LAMMPS names the same folder of its own prefix, so that a view with both needs no variable.
        env.prepend_path("LAMMPS_PLUGIN_PATH", os.path.join(self.prefix, "lib", "lammps", "plugins"))

    @run_after("install")
    def check_install(self):
        check = Executable(os.path.join(self.stage.source_path, "packaging", "check_install.sh"))
        check.add_default_env("LAMMPS_PLUGIN_PATH", os.path.join(self.prefix, "lib", "lammps", "plugins"))
        check(os.path.join(self.spec["lammps"].prefix.bin, "lmp"))
