# SPDX-License-Identifier: GPL-2.0-only
"""Flow curves: true stress against plastic strain, as finite-element codes take them, and their nominal curves.

True strain = true stress/E + plastic strain. Plastic flow keeps the volume: nominal stress = true stress exp(-true strain) and nominal
strain = exp(true strain) - 1, with negative strains in compression. The elastic change of the cross-section, 2 nu stress/E of it, is left out.
"""

import itertools
import pathlib
from typing import NamedTuple

import numpy as np
import scipy.optimize

from .curves import YIELD_OFFSET

FAR = 2.0  # plastic strain to which a curve is continued


class FlowCurve(NamedTuple):
    """Two or more plastic strains from 0 on and true stresses [Pa], straight between them; beyond the last the last slope, which does not fall. end: the largest
    plastic strain that is known."""

    plastic: np.ndarray
    stress: np.ndarray
    end: float

    def at(self, plastic):
        """True stress [Pa]."""
        slope = max(0.0, (self.stress[-1] - self.stress[-2]) / (self.plastic[-1] - self.plastic[-2]))
        return np.interp(plastic, self.plastic, self.stress) + slope * np.maximum(0.0, np.asarray(plastic) - self.plastic[-1])

    def true_stress(self, strains, modulus):
        """[Pa] at true strains, as sizes; elastic below the yield stress."""
        return np.array([self._true(float(strain), modulus) for strain in np.atleast_1d(strains)])

    def bends(self, end, modulus):
        """True strains from 0 to `end` between which the stress is straight: yield, and the points of the curve."""
        strains = self.plastic + self.stress / modulus
        return np.array([0.0, *strains[strains < end], end])

    def nominal(self, strains, modulus):
        """Nominal stress [Pa], as a size, at nominal strains of either sign."""
        true = np.log1p(strains)
        return self.true_stress(np.abs(true), modulus) * np.exp(-true)

    def offset_yield(self, modulus, sign=1.0):
        """0.2 % offset yield stress [Pa], nominal: where the nominal curve meets E (strain - 0.002)."""
        def above(size):
            return self.nominal(sign * size, modulus)[0] - modulus * (size - YIELD_OFFSET)

        size = scipy.optimize.brentq(above, YIELD_OFFSET, 0.2, xtol=1e-14)
        return modulus * (size - YIELD_OFFSET)

    def nominal_strain(self, plastic, modulus, sign=1.0):
        """Where the plastic strain is this."""
        return float(np.expm1(sign * (plastic + self.at(plastic) / modulus)))

    def _true(self, size, modulus):
        if size * modulus <= self.stress[0]:
            return size * modulus
        plastic = scipy.optimize.brentq(lambda p: float(self.at(p)) - modulus * (size - p), 0.0, size, xtol=1e-15)
        return float(self.at(plastic))


def johnson_cook(a, b, n):
    """Johnson-Cook's A + B p^n [Pa] at its reference rate and temperature."""
    plastic = np.concatenate([[0.0], np.geomspace(1e-6, FAR, 400)])
    return FlowCurve(plastic, a + b * plastic**n, FAR)


def of_row(path, name):
    """The curve of a row of a potential file by its keywords flow and yield; ValueError where there is no such row."""
    rows = (line.split() for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines())
    words = next((row for row in rows if row[:1] == [name] and {"flow", "yield"} <= set(row)), None)
    if words is None:
        raise ValueError(f"{path} has no row {name} with flow and yield")
    table = itertools.takewhile(lambda word: word[0] in "0123456789.", words[words.index("flow") + 1:])
    plastic, factor = np.array([float(word) for word in table]).reshape(-1, 2).T
    return FlowCurve(plastic, factor * float(words[words.index("yield") + 1]), plastic[-1])


def through(modulus, first, points):
    """Through a nominal 0.2 % offset yield stress [Pa] and nominal (stress [Pa], strain), whose strains are negative in compression; below the
    first it is level. Stresses are sizes."""
    ordered = sorted(points, key=lambda point: abs(point[1]))
    sign = np.sign(ordered[0][1])
    true = [first * (1.0 + sign * (first / modulus + YIELD_OFFSET)), *(stress * (1.0 + strain) for stress, strain in ordered)]
    plastic = [YIELD_OFFSET, *(abs(np.log1p(strain)) - size / modulus for (_, strain), size in zip(ordered, true[1:]))]
    return FlowCurve(np.array([0.0, *plastic]), np.array([true[0], *true]), plastic[-1])
