#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# The project in a Debian that has nothing but its base system; see --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
die() { printf 'try_in_bare_root.sh: error: %s\n' "$*" >&2; exit 1; }

usage() {
  cat <<'END'
usage: packaging/try_in_bare_root.sh --mirror URL --root DIR [--suite bookworm] [COMMAND]

Makes a base system of Debian in DIR with debootstrap, unless one is there, puts a fresh clone of this checkout's
last commit into its /opt/evp, and runs COMMAND (default: tools/quickstart.sh) in that folder. DIR is kept, so that a
second call goes on with what the first has installed; delete it by hand. Needs root, debootstrap, unshare and 5 GB.

  --mirror URL   a Debian mirror, as in /etc/apt/sources.list; not needed when DIR is there
  --root DIR     folder of the new system
  --suite S      Debian release (default: bookworm)
END
}

mirror='' root='' suite=bookworm
while [ $# -gt 0 ]; do
  case $1 in
    -h|--help) usage; exit 0 ;;
    --mirror|--root|--suite)
      [ -n "${2:-}" ] || die "option $1 needs a value; see packaging/try_in_bare_root.sh --help"
      declare "${1#--}=$2"
      shift 2 ;;
    --*) die "unknown option '$1'; see packaging/try_in_bare_root.sh --help" ;;
    *) break ;;
  esac
done
[ -n "$root" ] || die "--root DIR is needed: the folder of the new system"
[ "$(id -u)" -eq 0 ] || die "chroot needs root: call it with sudo"
for command in debootstrap unshare git; do
  command -v "$command" >/dev/null || die "$command is missing; on Debian: apt-get install debootstrap util-linux git"
done
if [ ! -f "$root/etc/debian_version" ]; then
  [ -n "$mirror" ] || die "--mirror URL is needed: a Debian mirror, as in /etc/apt/sources.list"
  echo "== debootstrap $suite (a few minutes)"
  debootstrap --variant=minbase "$suite" "$root" "$mirror"
fi
root=$(cd "$root" && pwd)
[ "$root" != / ] || die "--root / is this system"

echo "== clone of $(git -C "$here" log -1 --format='%h %s')"
# Only the clone of the last call is deleted.
rm -rf "$root/opt/evp"
git clone -q "$here" "$root/opt/evp"
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
# An installed Debian has one; without it mpirun waits seconds for the name of this host at each start.
[ -f "$root/etc/hosts" ] || printf '127.0.0.1 localhost\n127.0.1.1 %s\n' "$(uname -n)" >"$root/etc/hosts"

# In a mount namespace of its own, so that nothing stays mounted.
export root
# shellcheck disable=SC2016
exec unshare --mount bash -euc '
  for folder in proc sys dev; do mount --rbind "/$folder" "$root/$folder"; done
  cd "$root"
  exec chroot "$root" /usr/bin/env -i HOME=/root TERM=dumb PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    bash -c "cd /opt/evp && exec \"\$@\"" bash "$@"' bash "${@:-tools/quickstart.sh}"
