# SPDX-License-Identifier: GPL-2.0-only
"""A part to try things on: a round tension bar after the proportions of ISO 6892, gauge length of five diameters (in mm, along z)."""

import numpy as np


def turned(profile, facets):
    """Triangles (T,3,3) of the body of revolution about z of a profile (P,2) of radius and z from bottom to top, closed by flat ends."""
    angle = 2.0 * np.pi * np.arange(facets) / facets
    rings = np.stack([np.stack([r * np.cos(angle), r * np.sin(angle), np.full(facets, z)], axis=1) for r, z in profile])
    triangles = []
    for lower, upper in zip(rings, rings[1:]):
        for a, b, c, d in zip(lower, np.roll(lower, -1, axis=0), np.roll(upper, -1, axis=0), upper):
            triangles += [(a, b, c), (a, c, d)]
    for ring, (_, z), turn in ((rings[0], profile[0], -1), (rings[-1], profile[-1], 1)):
        for a, b in zip(ring, np.roll(ring, -1, axis=0)):
            triangles.append(((0.0, 0.0, z), a, b)[::1] if turn > 0 else ((0.0, 0.0, z), b, a))
    return np.array(triangles, dtype=float)


def dog_bone(grip=6.0, gauge=4.0, grip_length=12.0, half_gauge=15.0, fillet=8.0, facets=32):
    """A bar with grips of radius grip, a gauge of radius gauge, and fillets between them [mm]."""
    drop = grip - gauge
    run = np.sqrt(fillet**2 - (fillet - drop) ** 2)  # along z, of an arc tangent to the gauge
    arc = [(gauge + fillet - np.sqrt(fillet**2 - s**2), s) for s in np.linspace(run, 0.0, 7)]
    middle = grip_length + run + half_gauge
    lower = [(grip, 0.0), (grip, 0.5 * grip_length)] + [(r, grip_length + run - s) for r, s in arc]
    return turned(lower + [(r, 2.0 * middle - z) for r, z in reversed(lower)], facets)
