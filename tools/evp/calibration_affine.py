# SPDX-License-Identifier: GPL-2.0-only
"""Closed forms of calibration: the tension curve of a body whose bonds all share one strain, and the row that gives two stresses.

Bonds of every direction, free sideways (model of fix evp/volume included): a bond at the angle t to the axis is stretched by
sqrt((1+a)^2 cos^2 t + (1+b)^2 sin^2 t) and has flowed (`plasticity isotropic`); b minimises the work

    W/E0 = 6/(m1 n1) <(Psi + D)/e1> + x/2 theta^2,   theta = 3 <stretch - 1>,   x = kv N/(V E0),   E0 = m1 n1 e1 Nb/(6 V)

<> is the mean over directions, Nb/V bonds and N/V particles per volume. Nominal stress/E0 = dW/da. Real bodies differ from it by
some per cent, and by more far beyond yield, where bonds leave: it is where calibration starts and what it refuses by.
"""

from typing import NamedTuple

import numpy as np
import scipy.optimize

from . import flow, law
from .curves import YIELD_OFFSET

EXPONENTS = (8.0, 4.0)  # of both regimes, as in Table 1
ALPHA = 1.5
LEAST_NU, LARGEST_NU = 0.25, 0.42  # of central forces alone; where lateral stiffness leaves the closed form (doc/fix_evp_volume.rst)
XI_RANGE = (2e-5, 0.05)  # of xi_s: below, round-off of positions shows; above, the first regime itself is bent
LEAST_GUESS = 1e-3
_COS, _WEIGHTS = (lambda nodes: (0.5 * (nodes[0] + 1.0), 0.5 * nodes[1]))(np.polynomial.legendre.leggauss(100))  # on (0, 1)


class Shape(NamedTuple):
    """What the curve over E0 depends on."""

    softening: float  # e2/e1
    xi_s: float
    volume: float  # x above


def row_of(shape, e1=1.0):
    """law.Row of a shape, no damping."""
    m, n = EXPONENTS
    return law.Row(e1, m, n, shape.softening * e1, m, n, shape.xi_s, 0.0, ALPHA)


BULK, SHEAR = 1.0 / 1.5, 0.4  # K/E0 without the volume energy, which adds x; G/E0


def volume_ratio(nu):
    """x that gives Poisson's ratio nu."""
    return 2.0 * SHEAR * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)) - BULK


def poisson(volume):
    """Poisson's ratio with the volume energy, the inverse of volume_ratio()."""
    bulk = BULK + volume
    return (3.0 * bulk - 2.0 * SHEAR) / (2.0 * (3.0 * bulk + SHEAR))


def stiffening(volume):
    """E/E0 with the volume energy."""
    bulk = BULK + volume
    return 9.0 * bulk * SHEAR / (3.0 * bulk + SHEAR)


def stress(strains, shape):
    """Nominal stress/E0 at nominal strains (S,), free sideways."""
    row, (m, n) = row_of(shape), EXPONENTS
    found, b = [], 0.0
    c2, s2 = _COS**2, 1.0 - _COS**2

    def pull(a, b):
        """(axial, lateral) dW of a, b."""
        stretch = np.sqrt((1.0 + a) ** 2 * c2 + (1.0 + b) ** 2 * s2)
        tension = -flow.elastic_force(stretch, 1.0, row, flow.return_map(stretch, 1.0, row, 0.0, 0.0)[0])
        theta = 3.0 * np.sum(_WEIGHTS * (stretch - 1.0))
        along = _WEIGHTS * (6.0 / (m * n) * tension + 3.0 * shape.volume * theta) / stretch
        return np.sum(along * c2) * (1.0 + a), np.sum(along * s2) * (1.0 + b)

    for a in strains:
        if a == 0.0:
            found.append(0.0)
            continue
        b = scipy.optimize.brentq(lambda lateral: pull(a, lateral)[1], -0.8 * a, 0.1 * a, xtol=1e-14, rtol=1e-12)
        found.append(pull(a, b)[0])
    return np.array(found)


def offset_stress(shape):
    """0.2 % offset yield stress/E0, of a curve whose straight part has the slope E."""
    slope = stiffening(shape.volume)
    at = scipy.optimize.brentq(lambda a: stress([a], shape)[0] - slope * (a - YIELD_OFFSET), YIELD_OFFSET * (1.0 + 1e-9), 0.5, xtol=1e-12)
    return slope * (at - YIELD_OFFSET)


def xi_for_yield(yield_strain, softening, volume):
    """xi_s whose offset yield stress is yield_strain E; nan where none in XI_RANGE has.

    The curve meets the offset line at a strain that is known, so that its stress there is.
    """
    at, wanted = yield_strain + YIELD_OFFSET, stiffening(volume) * yield_strain

    def misfit(log_xi):
        return stress([at], Shape(softening, np.exp(log_xi), volume))[0] - wanted

    low, high = np.log(XI_RANGE)
    if not misfit(low) < 0.0 < misfit(high):
        return np.nan
    return float(np.exp(scipy.optimize.brentq(misfit, low, high, xtol=1e-9)))


def hardening_of(yield_strain, softening, volume, strain):
    """stress at `strain`/yield stress of the curve with that yield stress/E; nan where there is none."""
    xi_s = xi_for_yield(yield_strain, softening, volume)
    if np.isnan(xi_s):
        return np.nan
    return float(stress([strain], Shape(softening, xi_s, volume))[0] / (stiffening(volume) * yield_strain))


STIFFEST = 0.98  # e2/e1: the second regime must stay softer than the first


def yield_range(volume):
    """(smallest, largest) 0.2 % offset yield stress/E of the xi_s allowed, second regime without force."""
    found = []
    for xi_s in XI_RANGE:
        shape, slope = Shape(1e-6, xi_s, volume), stiffening(volume)
        at = scipy.optimize.brentq(lambda a: stress([a], shape)[0] - slope * (a - YIELD_OFFSET), YIELD_OFFSET * 1.0001, YIELD_OFFSET + 3.0 * xi_s)
        found.append(at - YIELD_OFFSET)
    return tuple(found)


def most_hardening(yield_strain, volume, strain):
    """Largest stress at `strain`/yield stress: that of the stiffest second regime with which xi_s is in range."""
    softening = STIFFEST
    while softening > 1e-3:
        found = hardening_of(yield_strain, softening, volume, strain)
        if not np.isnan(found):
            return found
        softening *= 0.9
    raise ValueError("no xi_s gives this yield stress")


def first_guess(yield_strain, hardening, volume, strain):
    """The Shape with that yield stress/E and stress at `strain`/yield stress.

    Real bodies harden less at a small e2 than this form, where bonds cannot rearrange: LEAST_GUESS of e2/e1 where it cannot
    go as low.
    """
    def misfit(log_softening):
        found = hardening_of(yield_strain, np.exp(log_softening), volume, strain)
        return np.inf if np.isnan(found) else found - hardening

    low, high = np.log(LEAST_GUESS), np.log(STIFFEST)
    softening = LEAST_GUESS
    if misfit(low) < 0.0:
        while np.isinf(misfit(high)):
            high -= 0.1
        if misfit(high) < 0.0:
            raise ValueError("no e2 gives this hardening")
        softening = float(np.exp(scipy.optimize.brentq(misfit, low, high, xtol=1e-6)))
    xi_s = xi_for_yield(yield_strain, softening, volume)
    if np.isnan(xi_s):
        raise ValueError("no xi_s gives this yield stress")
    return Shape(softening, xi_s, volume)
