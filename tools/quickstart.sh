#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# Set-up, then a metal on its flow curve, and the paper's traction test for Tables 1 and 2: results/quickstart/*.csv and *.png.
# Arguments go to the run itself (tools/quickstart.sh --help); for another LAMMPS call tools/setup.sh first.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=tools/env.sh
source "$here/env.sh"
[[ " $* " == *" --help "* || " $* " == *" -h "* ]] || "$here/setup.sh"
evp_find_python
cd "$EVP_REPOSITORY"
echo "== quick start: a metal on its flow curve, then the paper's traction test"
exec "$PYTHON" tools/quickstart.py "$@"
