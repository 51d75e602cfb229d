#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-only
# Run by conda-build, which sets SRC_DIR, PREFIX and CMAKE_ARGS. LAMMPS' source is in SRC_DIR/lammps.
set -euo pipefail
# shellcheck disable=SC2086
cmake -S "$SRC_DIR" -B "$SRC_DIR/build" -G Ninja ${CMAKE_ARGS:-} -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DBUILD_TESTING=off -DLAMMPS_SOURCE_DIR="$SRC_DIR/lammps" -DLAMMPS_SIZES=smallbig -DBUILD_MPI=on
cmake --build "$SRC_DIR/build"
cmake --install "$SRC_DIR/build"

# LAMMPS looks for plugins where LAMMPS_PLUGIN_PATH says.
for when in activate deactivate; do mkdir -p "$PREFIX/etc/conda/$when.d"; done
cat >"$PREFIX/etc/conda/activate.d/evp.sh" <<'END'
export EVP_CONDA_OLD_PLUGIN_PATH="${LAMMPS_PLUGIN_PATH:-}"
export LAMMPS_PLUGIN_PATH="$CONDA_PREFIX/lib/lammps/plugins${LAMMPS_PLUGIN_PATH:+:$LAMMPS_PLUGIN_PATH}"
END
cat >"$PREFIX/etc/conda/deactivate.d/evp.sh" <<'END'
if [ -n "${EVP_CONDA_OLD_PLUGIN_PATH:-}" ]; then
  export LAMMPS_PLUGIN_PATH="$EVP_CONDA_OLD_PLUGIN_PATH"
else
  unset LAMMPS_PLUGIN_PATH
fi
unset EVP_CONDA_OLD_PLUGIN_PATH
END
