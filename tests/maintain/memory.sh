#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# AddressSanitizer, UBSan and valgrind on the plugin; see --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=tools/env.sh
source "$here/../../tools/env.sh"

die() { printf 'memory.sh: error: %s\n' "$*" >&2; exit 1; }
usage() {
  cat <<'END'
usage: tests/maintain/memory.sh [--help] [PYTEST ARGUMENT...]

Builds plugin and unit tests in build-memory with AddressSanitizer, UBSan and the assertions of libstdc++ for the LAMMPS of build, runs the
unit tests, a deck that uses every style, and tests with LAMMPS; then valgrind on the deck with a plain build.
Fails on any report with our files in it. Needs valgrind.

  PYTEST ARGUMENT    tests to run in place of the short set; not those that start LAMMPS from Python
END
}

build=$EVP_BUILD
work=$EVP_REPOSITORY/build-memory
case ${1:-} in -h|--help) usage; exit 0 ;; esac
tests=("$@")
[ $# -gt 0 ] || tests=(tests/lammps/test_forces.py tests/lammps/test_same_bits.py tests/lammps/test_dt.py tests/lammps/test_flow_between.py)
[ -f "$build/CMakeCache.txt" ] || die "$build holds no build of the plugin: run tools/setup.sh"
evp_find_python || die "no Python with $EVP_PYTHON_MODULES; give one: PYTHON=/path/to/python3"
command -v valgrind >/dev/null || die "valgrind is missing (Debian: valgrind)"

cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
value_of() { sed -n "s/^$1='\(.*\)'/\1/p" "$build/lmp"; }
lmp=$(value_of lmp)
libdir=$(value_of libdir)
asan=$(readlink -f "$(g++ -print-file-name=libasan.so)")
[ -f "$asan" ] || die "g++ has no libasan.so"

! command -v ccache >/dev/null || export CMAKE_CXX_COMPILER_LAUNCHER=ccache
# configure FOLDER OPTION...
configure() {
  mkdir -p "$1"
  evp_configure "$@" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_COMPILER=g++ -DLAMMPS_SOURCE_DIR="$(cached LAMMPS_SOURCE_DIR)" \
    -DLAMMPS_BUILD_DIR="$(cached LAMMPS_BUILD_DIR)" >"$1/configure.log" 2>&1 ||
    { tail -n 20 "$1/configure.log" >&2; die "CMake failed in $1"; }
}
compile() { cmake --build "$1" -j "$EVP_CORES" --target "${@:2}" >"$1/compile.log" 2>&1 ||
  { tail -n 30 "$1/compile.log" >&2; die "the build failed in $1"; }; }

reports=$work/reports
rm -rf "$reports"
mkdir -p "$reports" "$work/run"
failed=0
specimen=$EVP_REPOSITORY/tests/data/reference_500/specimen_500.data
deck=$here/memory/in.memory
row=$EVP_REPOSITORY/potentials/metals.evp:copper_OFHC

echo "== build with AddressSanitizer, UBSan and the assertions of libstdc++ (up to 3 min)"
configure "$work/sanitized" -DEVP_SANITIZE=address,undefined -DCMAKE_CXX_FLAGS=-D_GLIBCXX_ASSERTIONS
compile "$work/sanitized" all
# Leaks do not set the exit status, reports.py judges them; everything else aborts the process. LAMMPS has no frame
# pointers: without the slow unwinding a stack would end in its Memory class, and a leak of ours look like one of its own.
export ASAN_OPTIONS="detect_leaks=1:fast_unwind_on_malloc=0:abort_on_error=1:exitcode=0:log_path=$reports/sanitizer:detect_stack_use_after_return=1"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:abort_on_error=1:log_path=$reports/sanitizer"
export LSAN_OPTIONS="suppressions=$here/memory/lsan.supp:print_suppressions=0:log_path=$reports/sanitizer"
# Only lmp itself is preloaded, neither mpirun nor Python.
cat >"$work/lmp" <<END
#!/bin/bash
exec env LD_LIBRARY_PATH='$libdir' LAMMPS_PLUGIN_PATH="\${EVP_PLUGIN_DIR:-$work/sanitized}" LD_PRELOAD='$asan' '$lmp' "\$@"
END
chmod +x "$work/lmp"

echo "== unit tests"
# These programs have frame pointers: the quick unwinding is enough, and takes a tenth of the time.
ASAN_OPTIONS=$ASAN_OPTIONS:fast_unwind_on_malloc=1 ctest --test-dir "$work/sanitized" --output-on-failure --no-tests=error -R '^unit_' || failed=1

echo "== every style once, 1 and 2 ranks"
for ranks in 1 2; do
  (cd "$work/run" && timeout 600 "$EVP_MPIRUN" -np "$ranks" "$work/lmp" -log none -in "$deck" -var specimen "$specimen" -var row "$row") \
    >"$reports/deck-$ranks.out" 2>&1 || { tail -n 20 "$reports/deck-$ranks.out"; failed=1; }
done

echo "== tests with LAMMPS: ${tests[*]}"
EVP_LMP=$work/lmp "$PYTHON" -m pytest -q -p no:cacheprovider "${tests[@]}" || failed=1
unset ASAN_OPTIONS UBSAN_OPTIONS LSAN_OPTIONS

echo "== valgrind memcheck on every style once, 1 rank (up to 5 min)"
configure "$work/plain" -DBUILD_TESTING=off
compile "$work/plain" evpplugin
(cd "$work/run" && LD_LIBRARY_PATH=$libdir LAMMPS_PLUGIN_PATH=$work/plain timeout 1200 valgrind --quiet \
  --leak-check=full --show-leak-kinds=definite,indirect,possible --keep-debuginfo=yes --num-callers=30 \
  --track-origins=no --suppressions="$here/memory/mpi.valgrind.supp" --log-file="$reports/valgrind" \
  "$lmp" -log none -in "$deck" -var specimen "$specimen" -var row "$row") >"$reports/deck-valgrind.out" 2>&1 ||
  { tail -n 20 "$reports/deck-valgrind.out"; failed=1; }
[ -f "$reports/valgrind" ] || die "valgrind wrote no log"
grep -q "Total wall time" "$reports/deck-valgrind.out" || { echo "the deck did not end under valgrind"; failed=1; }

echo "== reports"
"$PYTHON" "$here/memory/reports.py" "$reports"/* || failed=1
[ "$failed" -eq 0 ] || die "see above; logs in $reports"
echo "no report of ours"
