# SPDX-License-Identifier: GPL-2.0-only
# Sourced by setup.sh: how it speaks and runs long commands; packages; LAMMPS' source.
# shellcheck shell=bash disable=SC2154

say() { printf '    %s\n' "$*"; }
die() { printf 'setup.sh: error: %s\n' "$*" >&2; exit 1; }

phase_start=
done_phase() { [ -z "$phase_start" ] || say "done in $((SECONDS - phase_start)) s"; }
phase() { done_phase; phase_start=$SECONDS; printf '== %s\n' "$*"; }

# All lines go to the log; the screen gets one every few seconds, so that a long build is seen to move.
thin() {
  local line last=$SECONDS
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$log"
    ((SECONDS - last >= 5)) || continue
    # ninja: "[12/440] Building CXX object a/b/pair.cpp.o" is shown as "[12/440] pair.cpp.o"
    [[ $line != \[*/*\]* ]] || line="${line%%] *}] ${line##*/}"
    printf '      %.100s\n' "$line"
    last=$SECONDS
  done
}

# run_logged TEXT COMMAND...: one line on the screen; on failure the end of the output and where all of it is.
run_logged() {
  local text=$1 from status=0
  shift
  say "$text"
  from=$(wc -l <"$log")
  "$@" 2>&1 | thin || status=$?
  if [ "$status" -ne 0 ]; then
    tail -n +"$((from + 1))" "$log" | tail -n 30 >&2
    die "$text failed (status $status); all of its output: $log"
  fi
}

# require_release LMP BUILD DATE: every release has the same library name, so the wrong one is easily picked up.
require_release() {
  local help
  help=$(LD_LIBRARY_PATH="$2${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" "$1" -h 2>&1) || die "$1 does not start:
$help"
  [[ $help == *"Simulator - $3"* ]] || die "$1 is not LAMMPS $3 but: $(grep -m 1 Simulator <<<"$help" || true)"
}

# The packages we need, by what they provide, so that a machine that has everything from elsewhere is left alone.

has_command() { command -v "$1" >/dev/null; }
has_header() { has_command g++ && printf '#include <%s>\n' "$1" | g++ -x c++ -E - >/dev/null 2>&1; }

missing_packages() {
  has_command cmake || echo cmake
  has_command ninja || echo ninja-build
  has_command make || echo make  # what cmake takes without -G: in the README, and in the commands of the doctor
  has_command g++ || echo g++
  has_command mpicxx || echo libopenmpi-dev
  has_command mpirun || echo openmpi-bin
  has_command xz || echo xz-utils
  has_header gtest/gtest.h || echo libgtest-dev
  has_header gmock/gmock.h || echo libgmock-dev
  has_header yaml.h || echo libyaml-dev
  local module
  evp_find_python || for module in $(evp_missing_modules /usr/bin/python3); do echo "python3-$module"; done  # all, where there is none
}

# Python modules of single tools and tests: who cannot have one does without it.
# module, Debian package, name for pip, what will not work without it
optional_modules() {
  cat <<'END'
open3d python3-open3d open3d tools/body.py and tools/tool.py (parts and tools as STL) will not work
ase python3-ase ase a test of dumps will be left out
xdist python3-pytest-xdist pytest-xdist tests can only run one after another
sphinx python3-sphinx sphinx the site of the documentation cannot be built, nor its tests run
myst_parser python3-myst-parser myst-parser the site of the documentation cannot be built, nor its tests run
sphinx_rtd_theme python3-sphinx-rtd-theme sphinx-rtd-theme the site of the documentation cannot be built, nor its tests run
flake8 python3-flake8 flake8 the test of the Python style cannot be run
END
}

# The lines of optional_modules whose module is missing.
missing_optional_modules() {
  local missing
  missing=$(EVP_PYTHON_MODULES=$(optional_modules | cut -d ' ' -f 1 | paste -s -d ' ') evp_missing_modules "$PYTHON")
  optional_modules | while read -r module rest; do
    [[ " $missing " != *" $module "* ]] || printf '%s %s\n' "$module" "$rest"
  done
}

# apt_get SUDO WORD...: as root, where this is somebody else by the command SUDO.
apt_get() {
  local sudo=()
  [ "$(id -u)" -eq 0 ] || read -r -a sudo <<<"$1"
  shift
  run_logged "apt-get $*" ${sudo[@]+"${sudo[@]}"} env DEBIAN_FRONTEND=noninteractive \
    apt-get -q -y --no-install-recommends -o Dpkg::Use-Pty=0 "$@"
}

install_optional_modules() {
  local module package pip lost missing packages=()
  evp_find_python || return 0
  mapfile -t missing < <(missing_optional_modules | cut -d ' ' -f 2)
  [ ${#missing[@]} -gt 0 ] || return 0
  if has_command apt-get && [ "$PYTHON" = /usr/bin/python3 ]; then
    has_candidates "${missing[@]}" || (apt_get "sudo -n" update) 2>>"$log" || true
    for package in "${missing[@]}"; do has_candidates "$package" && packages+=("$package"); done
    [ ${#packages[@]} -eq 0 ] || (apt_get "sudo -n" install "${packages[@]}") 2>>"$log" || true
  fi
  while read -r module package pip lost; do
    say "$lost: $PYTHON has no $module; pip install $pip"
  done < <(missing_optional_modules)
}

# Does apt know each of these packages?
has_candidates() {
  local package
  for package in "$@"; do
    [[ $(apt-cache policy "$package" 2>/dev/null) == *Candidate:\ [0-9]* ]] || return 1
  done
}

install_missing_packages() {
  local packages
  mapfile -t packages < <(missing_packages)
  if [ ${#packages[@]} -eq 0 ]; then
    say "nothing is missing"
  else
    has_command apt-get || die "missing: ${packages[*]} (names of Debian packages). This is not a Debian system: install them its way and call again"
    [ "$(id -u)" -eq 0 ] || has_command sudo || die "missing: ${packages[*]}. Ask an administrator for: apt-get install ${packages[*]}"
    say "missing: ${packages[*]}"
    apt_get sudo update
    apt_get sudo install "${packages[@]}"
    hash -r
    mapfile -t packages < <(missing_packages)
    [ ${#packages[@]} -eq 0 ] || die "still missing after the installation: ${packages[*]}"
  fi
  install_optional_modules
  evp_find_python || die "no Python with $EVP_PYTHON_MODULES found; give one: PYTHON=/path/to/python3 tools/setup.sh"
  say "Python: $PYTHON"
}

# LAMMPS' source as Debian ships it, through an apt configuration of our own, so that the system's is neither changed nor
# in need of deb-src entries or root.

lammps_date_of() { sed -n 's/^#define LAMMPS_VERSION "\(.*\)"/\1/p' "$1/src/version.h"; }

# A deb-src entry of suite $1, from the mirror of this machine's own Debian; apt reads its own configuration.
debian_source_entry() {
  local codename uri keys=/usr/share/keyrings/debian-archive-keyring.gpg
  # shellcheck disable=SC1091
  codename=$(. /etc/os-release 2>/dev/null && printf '%s' "${VERSION_CODENAME:-}") || true
  uri=$(apt-get update --print-uris 2>>"$log" | sed -n "s|^'\(.*\)/dists/${codename:-none}/main/binary-.*|\1|p" | head -n 1)
  [ -n "$uri" ] || return 1
  printf '%s\n' "Types: deb-src" "URIs: $uri" "Suites: $1" "Components: main"
  [ ! -f "$keys" ] || printf '%s\n' "Signed-By: $keys"
}

no_source() {
  die "$1
    No LAMMPS source can be had here. Give one: tools/setup.sh --lammps-source /path/to/lammps
    (a tree as unpacked from a LAMMPS release), or connect the machine to its Debian mirror and call again."
}

# fetch_suite SUITE VERSION_PREFIX: sets tarball; status 1 with a reason in $reason when it cannot be had.
fetch_suite() {
  local suite=$1 prefix=$2 part=$cache/download/$1.part apt status index sum name
  mkdir -p "$part/lists/partial" "$part/archives/partial"
  if ! debian_source_entry "$suite" >"$part/debian.sources"; then
    reason="no entry of Debian's main archive for this release found in /etc/apt"
    return 1
  fi
  # Check-Valid-Until: a snapshot of the archive is as good a source as today's; signatures are still checked.
  apt=(-q -o Dir::Etc::sourcelist="$part/debian.sources" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$part/lists"
    -o Dir::Cache="$part" -o APT::Sandbox::User= -o Acquire::Languages=none -o Acquire::Retries=2
    -o Acquire::http::Timeout=30 -o Acquire::Check-Valid-Until=false -o APT::Update::Error-Mode=any)
  say "reading Debian's index of $suite"
  apt-get "${apt[@]}" update 2>&1 | thin || { reason="the index of Debian $suite cannot be read ($(tail -n 1 "$log"))"; return 1; }
  index=$(apt-cache "${apt[@]}" --only-source showsrc lammps 2>>"$log") || { reason="Debian $suite has no source of lammps"; return 1; }
  # "sha256 size name" lines under Checksums-Sha256.
  read -r sum name < <(awk '/^[^ ]/ { inside = ($1 == "Checksums-Sha256:") }
    inside && $3 ~ /\.orig\.tar\./ && $3 !~ /\.asc$/ { print $1, $3; exit }' <<<"$index") || true
  if [ -z "${name:-}" ] || [[ $name != lammps_$prefix* ]]; then
    reason="Debian $suite has '${name:-nothing}' and not the expected lammps_$prefix"
    return 1
  fi
  say "downloading $name"
  status=0
  # The small .dsc may be gone from a mirror while the tarball is there: the checksum decides, not the status.
  (cd "$part" && apt-get "${apt[@]}" source --download-only lammps) 2>&1 | thin || status=$?
  if [ ! -f "$part/$name" ]; then
    reason="$name could not be downloaded (apt-get: status $status)"
    return 1
  fi
  if ! printf '%s  %s\n' "$sum" "$part/$name" | sha256sum --check --status; then
    rm -f "$part/$name"
    reason="$name has not the SHA256 of Debian's index"
    return 1
  fi
  say "SHA256 is that of Debian's signed index: $sum"
  tarball=$part/$name
}

# get_lammps_source RELEASE: sets tree and tree_key.
get_lammps_source() {
  local suite prefix work found
  case $1 in
    4Feb2025) suite=trixie prefix=20250204 ;;
    newest) suite=sid prefix= ;;
  esac
  tree_key=lammps-$1
  tree=$cache/$tree_key/source
  if [ -f "$tree/src/lammps.h" ]; then
    say "already there: $tree"
    return
  fi
  has_command apt-get || no_source "This is not a Debian system."
  fetch_suite "$suite" "$prefix" || no_source "LAMMPS $1: $reason."
  say "unpacking"
  # Unpacked beside and renamed, so that an interrupted call leaves no half tree.
  work=$cache/$tree_key/unpack
  rm -rf "$work"
  mkdir -p "$work"
  tar -C "$work" -xf "$tarball" || die "$tarball cannot be unpacked; is the disk full?"
  found=$(find "$work" -maxdepth 3 -path '*/src/lammps.h' | head -n 1)
  [ -n "$found" ] || die "$tarball holds no src/lammps.h"
  mv -T "$(dirname "$(dirname "$found")")" "$tree"
  rm -rf "$work" "$cache/download/$suite.part"
}
