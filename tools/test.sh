#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# Set-up, then every test. Arguments go to setup.sh. A skipped test hides a hole, so it is a failure.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=tools/env.sh
source "$here/env.sh"
if [[ " $* " == *" --help "* || " $* " == *" -h "* ]]; then
  printf '%s\n' "usage: tools/test.sh [OPTION...]" "" "Set-up, then every test: unit tests, LAMMPS' pair tester, tests with LAMMPS and of the tools (about 10 minutes on" \
    "two cores). A skipped test is a failure. The options are those of tools/setup.sh:" ""
  "$here/setup.sh" --help
  exit 0
fi
"$here/setup.sh" "$@"
evp_find_python

cd "$EVP_REPOSITORY"
echo "== building the tests (about half a minute)"
cmake --build "$EVP_BUILD" -j "$EVP_CORES" >>"$EVP_BUILD/setup.log" 2>&1 || {
  tail -n 30 "$EVP_BUILD/setup.log" >&2
  echo "test.sh: error: the tests do not compile, see above and $EVP_BUILD/setup.log" >&2
  exit 1
}
echo "== unit tests"
ctest --test-dir "$EVP_BUILD" --output-on-failure --no-tests=error -R '^unit_'
if [[ $(ctest --test-dir "$EVP_BUILD" -N -R lammps_tester) == *lammps_tester* ]]; then
  echo "== LAMMPS' own pair tester"
  ctest --test-dir "$EVP_BUILD" --output-on-failure -R lammps_tester
else
  grep "pair tester is left out" "$EVP_BUILD/setup.log" || true
fi
echo "== tests with LAMMPS and of the tools"
report=$EVP_BUILD/pytest.log
# One more than cores, at most 4, as many tests run one rank, or wait for a program to start. A file stays on one worker, for its fixtures.
side_by_side=()
if "$PYTHON" -c "import xdist" 2>/dev/null; then
  side_by_side=(-n "$((EVP_CORES < 4 ? EVP_CORES + 1 : 4))" --dist loadfile)
else
  echo "the tests run one after the other: $PYTHON has no xdist (Debian: python3-pytest-xdist)"
fi
"$PYTHON" -m pytest ${side_by_side[@]+"${side_by_side[@]}"} -rs -p no:cacheprovider tests/tools tests/lammps 2>&1 | tee "$report"
if tail -n 1 "$report" | grep -Eq '[0-9]+ (skipped|xfailed|deselected)'; then
  echo "test.sh: error: tests were left out, see the list above" >&2
  exit 1
fi
