# SPDX-License-Identifier: GPL-2.0-only
"""What a strain rate adds to the stress: "Shares of a rate" in doc/Howto_evp_paper.rst, which says what the shares are and what theory expects.

stress_grip is half of the pull at both ends, so that masses which swing to one end as a whole are
not seen. A symmetric pull hardly makes any.
"""

from typing import NamedTuple

import numpy as np

from . import curves, law
from .specimen import bond_lengths

STRAINS = (0.002, 0.005, *curves.STRAINS_REPORTED.values())  # the first in the elastic part
REFERENCE_COUNT, REFERENCE_VOLUME = 500, np.pi * 0.02**2 * 0.05  # spheres and volume [m3] of the paper's specimen, for which a row of its tables is meant
OWN = "own"  # the value of limit, a word
TWIN_JUMP = 0.25  # of the damped run's jump at strain 0: a twin with as much has dampers too


class Shares(NamedTuple):
    """Parts of the stress at one strain [Pa]; floats. stress: damped run, cross-sections."""

    strain: float
    stress: float
    viscous: float
    inertial: float
    resolution: float


def imbalance(curve, at):
    """Root mean square of grip - virial [Pa] over the window of the stress at the strain `at`."""
    inside = np.abs(curve.strain - at) <= curves.STRESS_WINDOW + 1e-9
    found = float(np.sqrt(np.mean((curve.grip - curve.virial)[inside] ** 2)))
    if not np.isfinite(found):
        raise curves.CurveError("its file has no column stress_grip, or a number in it is not finite")
    return found


def starting_jump(curve):
    """(stress that the curve has at strain 0, scatter about it) [Pa], both through the sections.

    From a parabola over the elastic part, the row at rest left out. Dampers act from the first
    step: with them it is about E tau rate, without them zero.
    """
    end = curves.elastic_end(curve.strain, curve.virial)
    inside = (curve.strain > 0.0) & (curve.strain <= end + 1e-9)
    strain, stress = curve.strain[inside], curve.virial[inside]
    if len(strain) < 6:
        raise curves.CurveError(f"{len(strain)} rows up to strain {end:g}, where the elastic part ends: too few, write rows closer together (-var row of the decks)")
    fit = np.polyfit(strain, stress, 2)
    return float(fit[-1]), float(np.sqrt(np.mean((np.polyval(fit, strain) - stress) ** 2)))


def check_twin(damped, twin):
    """CurveError where the twin starts with a jump of stress as a damped run does."""
    (with_gamma, _), (without, scatter) = (curves.named(name, starting_jump, curve) for name, curve in (("damped run", damped), ("twin", twin)))
    if without > 3.0 * scatter and without > TWIN_JUMP * with_gamma:
        raise curves.CurveError(f"the twin starts with a stress of {1e-6 * without:.3g} MPa at strain 0, the damped run with "
                                f"{1e-6 * with_gamma:.3g} MPa: the twin must be the run with gamma = 0")


def reached(curve):
    """Those of STRAINS about which the curve has rows enough for a stress."""
    return [at for at in STRAINS if np.isfinite(curves.or_nan(curves.stress_at, curve.strain, curve.virial, at))]


def shares_at(damped, twin, at):
    """Shares at the strain `at` from two Curves of one rate.

    CurveError names the run that has no rows there, or a damped run without tension.
    """
    total, other = (curves.named(name, curves.stress_at, curve.strain, curve.virial, at, remedy="; ask for strains that both reach")
                    for name, curve in (("damped run", damped), ("twin", twin)))
    if total <= 0.0:
        raise curves.CurveError(f"damped run: no tension at strain {at:g} to take shares of")
    apart = [curves.named(name, imbalance, curve, at) for name, curve in (("damped run", damped), ("twin", twin))]
    return Shares(at, total, total - other, *apart)


def scaled_row(row, count, volume=REFERENCE_VOLUME):
    """The row that in.traction sets for `count` spheres in a volume [m3]: e goes as the volume of a sphere, gamma as its cube root."""
    coarser = REFERENCE_COUNT / count * volume / REFERENCE_VOLUME
    return row._replace(e1=row.e1 * coarser, e2=row.e2 * coarser, gamma=row.gamma * coarser ** (1.0 / 3.0))


def given_row(text):
    """(law.Row, {keyword: value}) of a row as the decks take it, nine numbers with keywords behind them, or FILE:ROW; several numbers are a list, words
    stay as they are. ValueError, or OSError of the file."""
    words = text.split()
    if len(words) == 1 and ":" in text:
        path, _, name = text.rpartition(":")
        with open(path, encoding="utf-8") as source:
            rows = [line.partition("#")[0].split() for line in source if line.partition("#")[0].strip()]
        found = [words for first, *words in rows if first == name]
        if len(found) != 1:
            raise ValueError(f"{path} has the row '{name}' twice" if found else f"{path} has no row '{name}'; its rows: {', '.join(row[0] for row in rows)}")
        words = found[0]
    row, words, more = law.Row.parse(" ".join(words[:9])), words[9:], {}
    keys = [k for k, word in enumerate(words) if word[0].isalpha() and word != OWN]
    for k, end in zip(keys, [*keys[1:], len(words)]):
        if words[k] in more:
            raise ValueError(f"keyword {words[k]} of a row is given twice: leave one out")
        values = [value if value[0].isalpha() else float(value) for value in words[k + 1 : end]]
        more[words[k]] = values if len(values) > 1 else values[0]
    return row, more


def run_row(text, specimen, volume):
    """(law.Row as a run of a Specimen in a body of this volume [m3] sets it, but for a factor of energies and damping together; density of the
    solid [kg/m3])."""
    row, more = given_row(text)
    density = more.get("density") or specimen.mass.sum() / volume
    if "spacing" not in more:
        return scaled_row(row, len(specimen.ids), volume), density
    finer = more["spacing"] / np.mean(bond_lengths(specimen, row.alpha))
    return row._replace(gamma=row.gamma * finer**2), density  # e goes as its cube, gamma as it


def relaxation_time(lengths, row):
    """tau = gamma <l^2>/(m1 n1 e1) [time] of bonds with these lengths (B,), l = deq; row: law.Row.

    For bonds that share the strain. Others count by their part of the elastic energy instead, 2 % less on tests/data/reference_500.
    """
    return float(row.gamma * np.mean(np.square(lengths)) / (row.m1 * row.n1 * row.e1))


def expected(specimen, row, density, rate, modulus, length=0.05):
    """(tau [s], E tau rate, rho c L rate [Pa]), the closed forms for a Specimen (SI) in a body of this length [m], at a rate [1/s].

    row, density: as the run set them (run_row); modulus: E [Pa], of the twin. ValueError for a rate, gamma or specimen of which nothing can be said.
    """
    if not 0.0 < rate < np.inf:
        raise ValueError(f"--rate must be positive, got {rate:g}")
    if row.gamma == 0.0 or row.e1 == 0.0:
        raise ValueError("coeff must be the row of the damped run, with gamma > 0 and e1 > 0")
    lengths = bond_lengths(specimen, row.alpha)
    if len(lengths) == 0:
        raise ValueError(f"the specimen has no pairs within alpha = {row.alpha:g}")
    tau = relaxation_time(lengths, row)
    return tau, modulus * tau * rate, float(np.sqrt(modulus * density)) * length * rate
