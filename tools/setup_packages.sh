# SPDX-License-Identifier: GPL-2.0-only
# Sourced by setup.sh: the packages we need, by what they provide, so that a machine that has
# everything from elsewhere is left alone.
# shellcheck shell=bash disable=SC2154

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
open3d python3-open3d open3d tools/body.py (parts as STL) will not work
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
