# SPDX-License-Identifier: GPL-2.0-only
# Sourced by setup.sh: how it speaks, how it runs long commands.
# shellcheck shell=bash disable=SC2154

say() { printf '    %s\n' "$*"; }
die() { printf 'setup.sh: error: %s\n' "$*" >&2; exit 1; }

phase_start=0
phase() { phase_start=$SECONDS; printf '== %s\n' "$*"; }
done_phase() { say "done in $((SECONDS - phase_start)) s"; }

# All lines go to the log; the screen gets one every few seconds, so that a long build is seen to move.
thin() {
  local line last=$SECONDS
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$log"
    if ((SECONDS - last >= 5)); then
      # ninja: "[12/440] Building CXX object a/b/pair.cpp.o" is shown as "[12/440] pair.cpp.o"
      [[ $line != \[*/*\]* ]] || line="${line%%] *}] ${line##*/}"
      printf '      %.100s\n' "$line"
      last=$SECONDS
    fi
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
