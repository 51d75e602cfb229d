# SPDX-License-Identifier: GPL-2.0-only
"""Johnson-Cook's rate-independent curve at room temperature, true stress (A + B ep^n), as nominal stress against nominal strain.

True strain = true stress/E + ep. Plastic flow keeps the volume: nominal stress = true stress exp(-true strain) and nominal strain
= exp(true strain) - 1, with negative signs in compression. The elastic change of the cross-section, 2 nu stress/E of it, is left out.
"""

from typing import NamedTuple

import study  # noqa: F401  first
import numpy as np
import scipy.optimize

from evp.curves import YIELD_OFFSET


class JohnsonCook(NamedTuple):
    """E, A, B [Pa], exponent n."""

    modulus: float
    a: float
    b: float
    n: float

    def true_stress(self, plastic):
        """[Pa] at plastic strains."""
        return self.a + self.b * np.power(plastic, self.n)

    def nominal(self, strains):
        """Nominal stress [Pa], as a size, at nominal strains of one sign, or 0; elastic where A is not reached."""
        return np.array([self._at(float(strain)) for strain in np.atleast_1d(strains)])

    def _at(self, strain):
        true = np.log1p(strain)
        size = abs(true)
        if size * self.modulus <= self.a:
            stress = size * self.modulus
        else:
            plastic = scipy.optimize.brentq(lambda ep: self.true_stress(ep) - self.modulus * (size - ep), 0.0, size, xtol=1e-16)
            stress = float(self.true_stress(plastic))
        return stress * np.exp(-true)

    def offset_yield(self, sign=1.0):
        """0.2 % offset yield stress [Pa], nominal: where the nominal curve meets E (strain - 0.002)."""
        at = scipy.optimize.brentq(lambda size: self._at(sign * size) - self.modulus * (size - YIELD_OFFSET), YIELD_OFFSET, 0.2, xtol=1e-14)
        return self.modulus * (at - YIELD_OFFSET)


def from_handbook(modulus, offset_yield, ultimate):
    """A = 0, B and n of a power law with this 0.2 % yield stress and ultimate tensile stress, nominal [Pa], at the strain where necking begins.

    At the largest nominal stress d(true stress)/d(strain) = true stress (Considere), so that ep = n there and
    ultimate = B n^n exp(-n), elastic strain left out; yield = B 0.002^n.
    """
    ratio = np.log(ultimate / offset_yield)
    n = scipy.optimize.brentq(lambda n: n * np.log(n / YIELD_OFFSET) - n - ratio, 2.0 * YIELD_OFFSET, 1.0)
    return JohnsonCook(modulus, 0.0, offset_yield / YIELD_OFFSET**n, float(n))
