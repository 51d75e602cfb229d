#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# Does an installed plugin work with an installed LAMMPS? See --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
die() { printf 'check_install.sh: error: %s\n' "$*" >&2; exit 1; }

usage() {
  cat <<'END'
usage: packaging/check_install.sh [LMP ...] [--help]

Runs the command LMP (default: lmp; several words for other launchers, as in mpirun -np 2 lmp) three times: the styles
are in `plugin list` and in `info styles`, and 200 steps of in.check_install give the numbers written below. The plugin
must be in a folder of LAMMPS_PLUGIN_PATH. Exit status 1 and one error when something does not hold.
END
}

case ${1:-} in
  -h|--help) usage; exit 0 ;;
  -*) die "unknown option '$1'; see packaging/check_install.sh --help" ;;
esac
lmp=("${@:-lmp}")
command -v "${lmp[0]}" >/dev/null || die "there is no command ${lmp[0]}; usage: packaging/check_install.sh /path/to/lmp"

# kind and name of each style
styles="pair evp/lj
fix evp/bonds
fix nve/evp
fix dt/evp
fix evp/energy
fix evp/heat
fix evp/volume
compute evp/dt
compute evp/state/atom
command evp_choices
command evp_quietly
command read_evp_row
command write_evp_bonds"
# pairs recorded, energy stored and kinetic energy [J], mean plastic strain, after 200 steps; tests/oracle/metal.py gives
# the same digits
expected="450 9.938252491 2.04188987002 0.0040630286466"

# run INPUT: what LAMMPS prints; a plugin that does not open is a line there, not an exit status
run() {
  local said
  said=$("${lmp[@]}" -log none -in "$1" 2>&1) || die "${lmp[*]} -in $1 failed. It says:
$said"
  printf '%s\n' "$said"
}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
printf 'plugin list\n' >"$folder/in.plugins"
printf 'info styles\n' >"$folder/in.styles"
said=$(run "$folder/in.plugins")
while read -r kind name; do
  grep -Eq "^ *[0-9]+: $kind style plugin $name\$" <<<"$said" ||
    die "LAMMPS has not loaded $kind $name: is the folder of evpplugin.so in LAMMPS_PLUGIN_PATH ('${LAMMPS_PLUGIN_PATH:-}')? LAMMPS says:
$said"
done <<<"$styles"
said=$(run "$folder/in.styles")
while read -r kind name; do
  grep -Eq "(^|[[:space:]])$name([[:space:]]|\$)" <<<"$said" || die "$kind $name is not in 'info styles'"
done <<<"$styles"
said=$(run "$here/in.check_install")
found=$(sed -n 's/^check_install pairs \(.*\) stored \(.*\) kinetic \(.*\) p \(.*\)/\1 \2 \3 \4/p' <<<"$said")
awk -v found="$found" -v expected="$expected" 'BEGIN {
  if (split(found, f) != split(expected, e)) exit 1
  for (i in e) if (f[i] !~ /^-?[0-9]/ || (f[i] - e[i])^2 > (1e-6 * e[i])^2) exit 1 }' ||
  die "200 steps of in.check_install gave '$found', not '$expected' to 1e-6"
printf 'check_install.sh: %s styles loaded, 200 steps as expected: %s\n' "$(wc -l <<<"$styles")" "$found"
