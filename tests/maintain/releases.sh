#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# Builds and tests the plugin with every LAMMPS release, compiler and integer size; see --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
tools=$here/../../tools
# shellcheck source=tools/env.sh
source "$tools/env.sh"
cache=$(evp_cache_dir)
# shellcheck source=tools/setup_steps.sh
source "$tools/setup_steps.sh"
die() { printf 'releases.sh: error: %s\n' "$*" >&2; exit 1; }

usage() {
  cat <<'END'
usage: tests/maintain/releases.sh [--release R] [--compiler C] [--sizes S] [--build-type B] [--tests short|all]
                              [--help]

Gets and builds LAMMPS (core, PLUGIN, GRANULAR, MOLECULE, BPM, GRAPHICS) where the cache has no build, builds the plugin for it in a folder of
its own, runs the unit tests, LAMMPS' own pair tester, the tests with LAMMPS and one traction test whose curve must be
the same everywhere. Prints a table and writes it to doc/releases.md. Exit status 1 when anything failed.

  --release R      4Feb2025 or newest                  \
  --compiler C     g++ or clang++, of the plugin        | each may be given several times; what is left out is
  --sizes S        smallbig or bigbig, of LAMMPS        | all releases, g++, smallbig, Release
  --build-type B   Release, Debug or Native, of the    /
                   plugin: Native is Release by -march=native.
                   With none of them: both releases with g++, smallbig, Release, and 4Feb2025 also with
                   clang++, Debug, Native and bigbig, one at a time.
  --tests T        all (default): the whole of tests/lammps; short: forces, records, ghost velocities, timestep, bad input

The table has every result in build-releases of the same sources, so that it may be filled in several calls.

Environment: EVP_CACHE, PYTHON as for tools/setup.sh. A LAMMPS tree at EVP_CACHE/lammps-R/source is used as it is.
END
}

releases=() compilers=() sizes=() types=()
tests=all
work=$EVP_REPOSITORY/build-releases
one_of() { local name=$1 value=$2; shift 2; [[ " $* " == *" $value "* ]] || die "$name must be one of: $*; got '$value'"; }
while [ $# -gt 0 ]; do
  case $1 in -h|--help) usage; exit 0 ;; esac
  [ -n "${2:-}" ] || die "option $1 is unknown or needs a value; see tests/maintain/releases.sh --help"
  case $1 in
    --release) one_of "$1" "$2" 4Feb2025 newest; releases+=("$2") ;;
    --compiler) one_of "$1" "$2" g++ clang++; compilers+=("$2") ;;
    --sizes) one_of "$1" "$2" smallbig bigbig; sizes+=("$2") ;;
    --build-type) one_of "$1" "$2" Release Debug Native; types+=("$2") ;;
    --tests) one_of "$1" "$2" short all; tests=$2 ;;
    *) die "unknown option '$1'; see tests/maintain/releases.sh --help" ;;
  esac
  shift 2
done
cases=()
if [ $((${#releases[@]} + ${#compilers[@]} + ${#sizes[@]} + ${#types[@]})) -eq 0 ]; then
  cases=("4Feb2025 g++ smallbig Release" "newest g++ smallbig Release"
    "4Feb2025 clang++ smallbig Release" "4Feb2025 g++ smallbig Debug" "4Feb2025 g++ smallbig Native" "4Feb2025 g++ bigbig Release")
else
  [ ${#releases[@]} -gt 0 ] || releases=(4Feb2025 newest)
  [ ${#compilers[@]} -gt 0 ] || compilers=(g++)
  [ ${#sizes[@]} -gt 0 ] || sizes=(smallbig)
  [ ${#types[@]} -gt 0 ] || types=(Release)
  for r in "${releases[@]}"; do for c in "${compilers[@]}"; do for s in "${sizes[@]}"; do for t in "${types[@]}"; do
    cases+=("$r $c $s $t"); done; done; done; done
fi
lammps_tests=(tests/lammps)
if [ "$tests" = short ]; then
  lammps_tests=(tests/lammps/test_forces.py tests/lammps/test_records.py tests/lammps/test_same_bits.py
    tests/lammps/test_dt.py tests/lammps/test_bad_input.py tests/lammps/test_memory.py)
fi

mkdir -p "$work/rows" "$cache"
log=$work/log
: >"$log"
! command -v ccache >/dev/null || export CMAKE_CXX_COMPILER_LAUNCHER=ccache
install_missing_packages
cd "$EVP_REPOSITORY"
checksum=$(cat CMakeLists.txt cmake/*.* src/*/*.* src/*/*/*.* | sha256sum | cut -c1-12)

# A finished build of this tree with these integers, by tools/setup.sh or by this command; sets lammps_build.
find_lammps_build() {
  for lammps_build in "$1"/build-*; do
    if [ -f "$lammps_build/evp-complete" ] && grep -q "^LAMMPS_SIZES:STRING=$2\$" "$lammps_build/CMakeCache.txt" &&
      grep -q "^PKG_BPM:BOOL=on" "$lammps_build/CMakeCache.txt" &&
      { [ ! -d "$1/source/src/GRAPHICS" ] || grep -q "^PKG_GRAPHICS:BOOL=on" "$lammps_build/CMakeCache.txt"; }; then
      return 0
    fi
  done
  return 1
}

# Sets tree and lammps_build of release $1 with integers $2; status 1 where the release cannot be had.
get_lammps() {
  local answer=$work/tree-$1 graphics=
  exec 9>"$cache/lock-$1"
  flock -w 1800 9 || die "a set-up has been at work in $cache for 30 min"
  # in a subshell, as it ends the process where there is no source
  (get_lammps_source "$1" && printf '%s\n' "$tree" >"$answer") || return 1
  tree=$(<"$answer")
  [ ! -d "$tree/src/GRAPHICS" ] || graphics=-DPKG_GRAPHICS=on    # tools/view.py draws by it
  if ! find_lammps_build "$cache/lammps-$1" "$2"; then
    lammps_build=$cache/lammps-$1/build-core-$2
    run_logged "configuring LAMMPS $1, $2" cmake -S "$tree/cmake" -B "$lammps_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
      -DBUILD_SHARED_LIBS=on -DBUILD_MPI=on -DPKG_PLUGIN=on -DPKG_GRANULAR=on -DPKG_MOLECULE=on -DPKG_BPM=on \
      ${graphics:+"$graphics"} -DLAMMPS_SIZES="$2"
    run_logged "building LAMMPS in $lammps_build (up to 7 min)" ninja -C "$lammps_build" lmp
    touch "$lammps_build/evp-complete"
  fi
  exec 9>&-
}

# "passed failed" out of a log of ctest or pytest
count_ctest() { sed -n 's/^[0-9]*% tests passed, \([0-9]*\) tests failed out of \([0-9]*\).*/\1 \2/p' "$1" | awk '{ print $2 - $1, $1 }'; }
count_pytest() {
  tail -n 1 "$1" | awk '{ passed = bad = 0
    for (i = 2; i <= NF; i++) { if ($i ~ /^passed/) passed = $(i-1); if ($i ~ /^(failed|error|skipped)/) bad += $(i-1) }
    print passed, bad }'
}

# run_case RELEASE COMPILER SIZES TYPE: the row of the table, into $work/rows; status 1 when something failed.
run_case() {
  local release=$1 compiler=$2 size=$3 type=$4 name=$1-$2-$3-$4 build begin=$SECONDS date version
  local unit=- tester=- lammps=- failed=0 passed bad
  build=$work/$name
  date=$(lammps_date_of "$tree")
  version=$("$compiler" --version | sed -n '1s/.*[^0-9.]\([0-9][0-9]*\.[0-9.]*[0-9]\).*/\1/p')
  mkdir -p "$build"
  local build_type=(-DCMAKE_BUILD_TYPE="$type")
  [ "$type" != Native ] || build_type=(-DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-march=native)
  run_logged "plugin: configuring" evp_configure "$build" "${build_type[@]}" -DCMAKE_CXX_COMPILER="$compiler" \
    -DLAMMPS_SOURCE_DIR="$tree" -DLAMMPS_BUILD_DIR="$lammps_build"
  run_logged "plugin: compiling" cmake --build "$build" -j "$EVP_CORES"
  require_release "$build/lmp" "$lammps_build" "$date"

  say "unit tests"
  ctest --test-dir "$build" --output-on-failure --no-tests=error -R '^unit_' >"$build/unit.log" 2>&1 || failed=1
  read -r passed bad < <(count_ctest "$build/unit.log") || true
  unit="${passed:-0} / ${bad:-?}"
  if [[ $(ctest --test-dir "$build" -N -R lammps_tester) == *lammps_tester* ]]; then
    say "LAMMPS' own pair tester"
    ctest --test-dir "$build" -V -R lammps_tester >"$build/tester.log" 2>&1 || failed=1
    sed -n 's/^[0-9]*: =* \(.*passed.*\|.*failed.*\) in .*/= \1/p' "$build/tester.log" >"$build/tester.line"
    read -r passed bad < <(count_pytest "$build/tester.line")
    tester="${passed:-0} / ${bad:-?}"
  fi
  say "tests with LAMMPS: ${lammps_tests[*]}"
  EVP_BUILD=$build EVP_LMP=$build/lmp "$PYTHON" -m pytest -p no:cacheprovider "${lammps_tests[@]}" >"$build/lammps.log" 2>&1 || failed=1
  read -r passed bad < <(count_pytest "$build/lammps.log")
  lammps="$passed / $bad"
  grep -E '^(FAILED|ERROR) ' "$build/lammps.log" || true

  say "the curve"
  (cd "$build" && "$build/lmp" -log none -in "$EVP_REPOSITORY/lammps_inputs/in.traction" -var rate 50 -var strain 0.01 \
    -var specimen "$EVP_REPOSITORY/tests/data/reference_500/specimen_500.data" -var out curve) >"$build/curve.log" 2>&1 || failed=1
  "$EVP_REPOSITORY/packaging/check_install.sh" "$build/lmp" >"$build/check.log" 2>&1 || { cat "$build/check.log" >&2; failed=1; }
  printf '%s|%s|%s %s|%s|%s|%s|%s|%s|%s|%s|%s\n' "$checksum" "$date" "$compiler" "$version" "$size" "$type" "$unit" "$tester" \
    "$lammps ($tests)" "$((SECONDS - begin))" "$failed" "$name" >"$work/rows/$name"
  return "$failed"
}

status=0
for entry in "${cases[@]}"; do
  read -r release compiler size type <<<"$entry"
  phase "$release, $compiler, $size, $type"
  rm -f "$work/rows/$release-$compiler-$size-$type"
  if ! command -v "$compiler" >/dev/null; then
    printf '!!  %s is not here: left out\n' "$compiler" >&2
    [ ${#compilers[@]} -eq 0 ] || status=1
  elif ! get_lammps "$release" "$size"; then
    printf '!!  LAMMPS %s cannot be had: left out\n' "$release" >&2
    [ ${#releases[@]} -eq 0 ] || status=1
  else
    # a subshell, so that a build that fails ends its case only
    (run_case "$release" "$compiler" "$size" "$type") || { printf '!!  %s failed\n' "$entry" >&2; status=1; }
  fi
done
done_phase

"$PYTHON" "$here/releases.py" "$work" "$checksum" "$EVP_REPOSITORY/doc/releases.md" || status=1
exit "$status"
