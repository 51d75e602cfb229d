# SPDX-License-Identifier: GPL-2.0-only
# Sourced by the other scripts: where things are, which Python to use, how mpirun behaves.
# shellcheck shell=bash

EVP_REPOSITORY=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
EVP_BUILD=$EVP_REPOSITORY/build
export EVP_LMP=${EVP_LMP:-$EVP_BUILD/lmp}
export EVP_MPIRUN=${EVP_MPIRUN:-mpirun}
export PYTHONPATH=$EVP_REPOSITORY/tools${PYTHONPATH:+:$PYTHONPATH}
export EVP_CORES=${EVP_CORES:-$(env -u OMP_NUM_THREADS nproc)}  # OMP_NUM_THREADS is set below, and nproc heeds it
EVP_PYTHON_MODULES="numpy scipy matplotlib pytest mpmath yaml"

# Two ranks must start on any machine: one core, a container, root. Other MPIs ignore these.
export OMPI_MCA_rmaps_base_oversubscribe=${OMPI_MCA_rmaps_base_oversubscribe:-1}
export OMPI_MCA_hwloc_base_binding_policy=${OMPI_MCA_hwloc_base_binding_policy:-none}
export OMPI_MCA_btl_vader_single_copy_mechanism=${OMPI_MCA_btl_vader_single_copy_mechanism:-none}
# A single process needs no daemon beside it: starts are quicker, and a start looks no host name up.
export OMPI_MCA_ess_singleton_isolated=${OMPI_MCA_ess_singleton_isolated:-1}
# Ranks of one machine talk through its memory: a start that looks for no network takes half the time.
export OMPI_MCA_pml=${OMPI_MCA_pml:-ob1}
# Where the machine's own name does not resolve (a bare container), mpirun waits for the name server at every start.
if ! timeout 1 getent hosts "${HOSTNAME:-localhost}" >/dev/null 2>&1; then
  export RES_OPTIONS=${RES_OPTIONS:-timeout:1 attempts:1} LOCALDOMAIN=${LOCALDOMAIN:-}
fi
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
if [ "$(id -u)" -eq 0 ]; then
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

# LAMMPS builds are kept outside the checkout, so that a clean clone does not build them again.
evp_cache_dir() {
  local home=${HOME:-}
  [ -n "$home" ] || home=$(getent passwd "$(id -u)" | cut -d: -f6)
  printf '%s\n' "${EVP_CACHE:-${XDG_CACHE_HOME:-${home:-/var/tmp}/.cache}/evp}"
}

# Where the build folder $1 was made, if it was moved or copied since: it holds paths of there.
evp_moved_from() {
  local made=
  [ ! -f "$1/CMakeCache.txt" ] || made=$(sed -n 's/^CMAKE_CACHEFILE_DIR:INTERNAL=//p' "$1/CMakeCache.txt")
  [ -z "$made" ] || [ "$made" -ef "$1" ] || printf '%s\n' "$made"
}

# evp_configure FOLDER OPTION...: CMake of this checkout in a folder, by Ninja where it is.
evp_configure() {
  local folder=$1 generator=()
  shift
  [ -f "$folder/CMakeCache.txt" ] || ! command -v ninja >/dev/null || generator=(-G Ninja)
  cmake -S "$EVP_REPOSITORY" -B "$folder" ${generator[@]+"${generator[@]}"} -DPython_EXECUTABLE="$PYTHON" "$@"
}

# The Python modules, of those we need, that interpreter $1 lacks.
evp_missing_modules() {
  "$1" - "$EVP_PYTHON_MODULES" <<'END' 2>/dev/null || printf '%s\n' "$EVP_PYTHON_MODULES"
import importlib.util, sys
print(*[name for name in sys.argv[1].split() if importlib.util.find_spec(name) is None])
END
}

# Sets PYTHON to the first interpreter that has every module; `python3` on PATH may be one without.
evp_find_python() {
  local candidate
  for candidate in "${PYTHON:-}" "$(command -v python3 || true)" /usr/bin/python3; do
    if [ -n "$candidate" ] && command -v "$candidate" >/dev/null &&
        [ -z "$(evp_missing_modules "$candidate")" ]; then
      PYTHON=$(command -v "$candidate")
      export PYTHON
      return 0
    fi
  done
  return 1
}
