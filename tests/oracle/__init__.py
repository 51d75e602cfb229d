# SPDX-License-Identifier: GPL-2.0-only
"""What the plugin is compared with: energies and stiffness of the law of tools/evp, sums over all pairs, stiffness matrices, volume energy,
explicit runs of small bodies with plasticity.

Written apart from src/: it shares no expression with it.
"""
