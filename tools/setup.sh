#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# From a bare Debian to build/evpplugin.so and build/lmp. Idempotent; see --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=tools/env.sh
source "$here/env.sh"
cache=$(evp_cache_dir)
log=$EVP_BUILD/setup.log
# shellcheck source=tools/setup_steps.sh
source "$here/setup_steps.sh"

usage() {
  cat <<'END'
usage: tools/setup.sh [--lammps-source DIR] [--lammps-build DIR]
                      [--lammps-release 4Feb2025|newest] [--peers] [--help]

Installs what is missing (Debian, with apt), gets and builds LAMMPS once, builds the plugin and ends
with build/evpplugin.so and build/lmp. A second call takes seconds; an interrupted one goes on.

  --lammps-source DIR    use this LAMMPS source tree and build it (in the cache, not in the tree)
  --lammps-build DIR     with --lammps-source: use this finished CMake build of it
  --lammps-release R     4Feb2025 (default, the oldest supported) or newest: Debian's source of that release
  --peers                LAMMPS with the packages of the styles that doc/studies/bench.py compares with, too
  Without options: what the last set-up of this checkout used.

Environment: EVP_CACHE  folder for LAMMPS (default: $XDG_CACHE_HOME/evp or ~/.cache/evp)
             PYTHON     a Python with numpy, scipy, matplotlib, pytest, mpmath, yaml
END
}

source_dir=
build_dir=
release=
peers=
remembered=$EVP_BUILD/setup.options
if [ $# -eq 0 ] && [ -s "$remembered" ]; then
  mapfile -t options <"$remembered"
  say "as in the last set-up: ${options[*]} (tools/setup.sh --lammps-release 4Feb2025 for the default)"
  set -- "${options[@]}"
fi
while [ $# -gt 0 ]; do
  case $1 in
    --lammps-source|--lammps-build|--lammps-release) [ -n "${2:-}" ] || die "option $1 needs a value; see tools/setup.sh --help" ;;&
    --lammps-source) source_dir=$2; shift ;;
    --lammps-build) build_dir=$2; shift ;;
    --lammps-release) release=$2; shift ;;
    --peers) peers=yes ;;
    -h|--help) usage; exit 0 ;;
    *) die "unknown option '$1'; see tools/setup.sh --help" ;;
  esac
  shift
done
case ${release:=4Feb2025} in
  4Feb2025|newest) ;;
  *) die "--lammps-release must be 4Feb2025 or newest, got '$release'" ;;
esac
if [ -n "$build_dir" ] && [ -z "$source_dir" ]; then
  die "--lammps-build needs --lammps-source: the plugin is compiled with the headers of that LAMMPS"
fi
if [ -n "$source_dir" ]; then
  [ -d "$source_dir" ] || die "--lammps-source $source_dir: no such folder"
  source_dir=$(cd "$source_dir" && pwd)
  [ -f "$source_dir/lammps.h" ] && source_dir=$(dirname "$source_dir")
  [ -f "$source_dir/src/lammps.h" ] || die "--lammps-source $source_dir is not a LAMMPS source tree: src/lammps.h is missing"
  lammps_date=$(lammps_date_of "$source_dir")
  [ "$(date -d "$lammps_date" +%Y%m%d)" -ge 20250204 ] ||
    die "LAMMPS $lammps_date in $source_dir is too old: the oldest supported release is 4 Feb 2025"
fi
if [ -n "$build_dir" ]; then
  [ -f "$build_dir/CMakeCache.txt" ] || die "--lammps-build $build_dir is not a CMake build folder: CMakeCache.txt is missing"
  build_dir=$(cd "$build_dir" && pwd)
fi

moved=$(evp_moved_from "$EVP_BUILD")
[ -z "$moved" ] || die "$EVP_BUILD was made as $moved, and moved or copied since: it holds paths of there. Remove it, and call again: rm -r $EVP_BUILD"

trap 'die "interrupted; call it again and it goes on from there"' INT TERM
mkdir -p "$cache" "$EVP_BUILD" || die "cannot write to $cache or $EVP_BUILD; set EVP_CACHE to a folder of yours"
: >"$log"
exec 9>"$cache/lock-$release"
if ! flock -n 9; then
  say "another set-up of LAMMPS $release is at work in $cache; waiting for it (at most 30 min), or set EVP_CACHE to another folder"
  flock -w 1800 9 || die "the other set-up did not end within 30 min; look for a running tools/setup.sh"
fi

phase "1/5 packages: look for compiler, CMake, MPI, Python modules; install what is missing (up to 3 min)"
install_missing_packages

phase "2/5 LAMMPS source (130 MB, up to 2 min the first time)"
if [ -n "$source_dir" ]; then
  say "using your tree $source_dir"
  tree=$source_dir
  tree_key=own-$(printf '%s' "$tree" | sha256sum | cut -c1-12)
else
  get_lammps_source "$release"    # sets tree, tree_key
fi
lammps_date=$(lammps_date_of "$tree")

phase "3/5 LAMMPS $lammps_date build (about 3 min on two cores the first time)"
if [ -n "$build_dir" ]; then
  say "using your build $build_dir"
  lammps_build=$build_dir
else
  options=(-DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=on -DBUILD_MPI=on -DPKG_PLUGIN=on)
  # What input scripts and tests use; where this release has it, what draws pictures since 11 Feb 2026.
  packages=(GRANULAR MOLECULE BPM GRAPHICS)
  if [ -n "$peers" ]; then
    packages+=(EXTRA-PAIR OPT)
    [ "$(uname -m)" != x86_64 ] || packages+=(INTEL)
  fi
  for package in "${packages[@]}"; do
    [ ! -d "$tree/src/$package" ] || options+=("-DPKG_$package=on")
  done
  # An update of the compiler or of MPI makes another build, not a mixture.
  key=$({ printf '%s\n' "${options[@]}"; mpicxx --version | head -n 1; ompi_info --version 2>/dev/null; } | sha256sum | cut -c1-12)
  lammps_build=$cache/$tree_key/build-$key
  stamp=$lammps_build/evp-complete
  # A tree of the user's may change, so it always goes through ninja; ours does not.
  if [ -f "$stamp" ] && [ -x "$lammps_build/lmp" ] && [ -z "$source_dir" ]; then
    say "already built: $lammps_build"
  else
    rm -f "$stamp"
    if [ ! -f "$lammps_build/build.ninja" ]; then
      run_logged "configuring LAMMPS" cmake -S "$tree/cmake" -B "$lammps_build" -G Ninja "${options[@]}" \
        -DCMAKE_PROJECT_lammps_INCLUDE="$EVP_REPOSITORY/cmake/LammpsHeaders.cmake"
    fi
    run_logged "building LAMMPS in $lammps_build" ninja -C "$lammps_build" lmp
    require_release "$lammps_build/lmp" "$lammps_build" "$lammps_date"
    touch "$stamp"
  fi
fi

phase "4/5 plugin (about a minute)"
run_logged "configuring" evp_configure "$EVP_BUILD" -DCMAKE_BUILD_TYPE=Release -DLAMMPS_SOURCE_DIR="$tree" -DLAMMPS_BUILD_DIR="$lammps_build"
run_logged "compiling" cmake --build "$EVP_BUILD" -j "$EVP_CORES" --target evpplugin

phase "5/5 check: build/lmp is LAMMPS $lammps_date and loads the plugin"
require_release "$EVP_BUILD/lmp" "$lammps_build" "$lammps_date"
loaded=$(printf 'plugin list\n' | "$EVP_BUILD/lmp" -log none 2>&1) || die "build/lmp does not start:
$loaded"
[[ $loaded == *" style plugin "* ]] || die "build/lmp does not load build/evpplugin.so. LAMMPS says:
$loaded"
done_phase
if [ -n "$source_dir" ]; then
  printf '%s\n' --lammps-source "$source_dir" ${build_dir:+--lammps-build "$build_dir"} ${peers:+--peers} >"$remembered"
elif [ "$release" != 4Feb2025 ]; then
  printf '%s\n' --lammps-release "$release" >"$remembered"
else
  rm -f "$remembered"
fi
as_root=""
[ "$(id -u)" != 0 ] || as_root="--allow-run-as-root "
say "ready in ${SECONDS} s: $EVP_BUILD/lmp -in FILE, or mpirun ${as_root}-np 2 $EVP_BUILD/lmp -in FILE"
