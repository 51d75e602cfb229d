# SPDX-License-Identifier: GPL-2.0-only
# Sourced by setup.sh: LAMMPS' source as Debian ships it, through an apt configuration of our own, so
# that the system's is neither changed nor in need of deb-src entries or root.
# shellcheck shell=bash disable=SC2154

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
