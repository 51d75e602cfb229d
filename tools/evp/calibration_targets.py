# SPDX-License-Identifier: GPL-2.0-only
"""Targets of a calibration: what the user asks for, and what is refused before anything runs."""

import math
import os
import pathlib
import re
from typing import NamedTuple, Optional, Tuple

from . import calibration_affine as affine

LARGEST_STRAIN = 0.15  # the force of the second regime of eq. 8 has its peak at a bond strain of 0.158
DECADE = 10.0
SOFTEST = 1e6  # [Pa] Young's modulus below which the unit is in doubt
LINEAR = 0.01  # over-stresses are linear in the rate within this
NAME = re.compile(r"[A-Za-z0-9_.+-]+")


class Refused(ValueError):
    """A target that the law cannot give, or a file that cannot be used: the text holds the reason and the nearest that can be had."""


class Targets(NamedTuple):
    """SI. strain is signed: negative means that all targets are those of a compression; stresses are positive."""

    modulus: float
    yield_stress: float
    stress2: float
    strain: float
    density: float
    nu: Optional[float] = None
    rates: Tuple[Tuple[float, float], ...] = ()  # (over-stress, rate)

    @property
    def yield_strain(self):
        """Yield stress/E."""
        return self.yield_stress / self.modulus

    @property
    def volume(self):
        """kv N/(V E0) of the closed form; 0 where nu is not asked for."""
        return 0.0 if self.nu is None else affine.volume_ratio(self.nu)


def parse_at(word, what, signs="+"):
    """(value, place) of 'VALUE@PLACE'; signs '+-' lets the place be negative. Refused where it is no such word."""
    parts = word.split("@")
    try:
        value, place = (float(part) for part in parts)
    except ValueError:
        raise Refused(f"{what} must be two numbers VALUE@PLACE, got '{word}'") from None
    positive(value, what)
    positive(abs(place) if signs == "+-" else place, what)
    return value, place


def positive(value, what):
    """Refused unless the value is a finite number above 0."""
    if not (math.isfinite(value) and value > 0.0):
        raise Refused(f"{what} must be a finite number above 0, got {value:g}")


def check(targets):
    """Refused where the law cannot give the targets, whatever the row."""
    for value, what in ((targets.modulus, "--E"), (targets.yield_stress, "--yield"), (targets.stress2, "--stress2"), (targets.density, "--density")):
        positive(value, what)
    if targets.modulus < SOFTEST:
        raise Refused(f"--E: {targets.modulus:g} Pa is softer than any metal: give all moduli and stresses in Pa, such as 70e9 for 70 GPa")
    check_nu(targets.nu)
    strain, at_yield = abs(targets.strain), targets.yield_strain + affine.YIELD_OFFSET
    if not strain > at_yield:
        raise Refused(f"--stress2: its strain {targets.strain:g} is not beyond the yield strain, yield/E + 0.002 = {at_yield:.4g}: "
                      f"give the stress at a strain from {1.5 * at_yield:.2g} on")
    if strain > LARGEST_STRAIN:
        raise Refused(f"--stress2: the strain {targets.strain:g} is beyond {LARGEST_STRAIN:g}, where the bonds along the axis pass the largest "
                      f"force of their second regime: give the stress at a strain up to {LARGEST_STRAIN:g}")
    if targets.stress2 <= targets.yield_stress:
        raise Refused(f"--stress2: {targets.stress2:.6g} Pa is not above the yield stress {targets.yield_stress:.6g} Pa. The law hardens beyond its "
                      f"0.2 % yield stress: the nearest is a stress a few per cent above {targets.yield_stress:.6g} Pa (nominal stresses of a "
                      "compression grow with the cross-section: give a negative strain if those are meant)")
    check_yield(targets)
    check_hardening(targets)
    check_rates(targets.rates)


def check_nu(nu):
    """Refused outside what central forces with the volume energy give."""
    if nu is None:
        return
    if not math.isfinite(nu) or nu < affine.LEAST_NU:
        raise Refused(f"--nu: {nu:g} cannot be had: central forces give 1/4 and the volume energy only raises it; the nearest is {affine.LEAST_NU:g}"
                      " (leave --nu out for what the network has by itself)")
    if nu > affine.LARGEST_NU:
        raise Refused(f"--nu: {nu:g} cannot be had: from {affine.LARGEST_NU:g} on the volume energy is so stiff that the body departs from the closed "
                      f"form and the timestep falls; the nearest is {affine.LARGEST_NU:g}")


def check_yield(targets):
    """Refused where xi_s would be out of range."""
    low, high = affine.yield_range(targets.volume)
    if not low < targets.yield_strain < high:
        nearest = (low if targets.yield_strain <= low else high) * targets.modulus
        raise Refused(f"--yield: {targets.yield_stress:.6g} Pa is {targets.yield_strain:.3g} of E, which needs an xi_s outside {affine.XI_RANGE[0]:g} to "
                      f"{affine.XI_RANGE[1]:g}; the nearest is {nearest:.4g} Pa")


def check_hardening(targets):
    """Refused where even a second regime as stiff as the first is too soft."""
    most = affine.most_hardening(targets.yield_strain, targets.volume, abs(targets.strain))
    if targets.stress2 > most * targets.yield_stress:
        raise Refused(f"--stress2: {targets.stress2:.6g} Pa is {targets.stress2 / targets.yield_stress:.3g} of the yield stress. Too steep: the second "
                      f"regime must be softer than the first, and its force saturates; the nearest is {most * targets.yield_stress:.4g} Pa "
                      f"({most:.3g} of the yield stress)")


def check_rates(rates):
    """Refused where the over-stresses are not linear in the rate over more than a decade."""
    for over, rate in rates:
        positive(over, "--rate")
        positive(rate, "--rate")
    if len(rates) < 2:
        return
    ordered = sorted(rates, key=lambda pair: pair[1])
    (over0, rate0), (over1, rate1) = ordered[0], ordered[-1]
    slopes = [over / rate for over, rate in ordered]
    if rate1 > DECADE * rate0 * (1.0 + 1e-9) and max(slopes) > (1.0 + LINEAR) * min(slopes):
        raise Refused(f"--rate: the over-stresses {over0:g} Pa at {rate0:g}/s and {over1:g} Pa at {rate1:g}/s are not linear in the rate over more than "
                      f"a decade. Damping is linear: it follows a logarithmic law over about one decade only; the nearest with {over1:g} Pa at "
                      f"{rate1:g}/s has {over1 * rate0 / rate1:.4g} Pa at {rate0:g}/s. Give one of them")


def check_name(name):
    """Refused where the name cannot be a row's."""
    if not NAME.fullmatch(name):
        raise Refused(f"--name: '{name}' cannot be the name of a row: letters, digits and _ . + - only")


def check_file(path, name):
    """Refused where the row cannot be appended to the potential file. Writes nothing."""
    path = pathlib.Path(path)
    folder = path.parent
    if path.is_dir():
        raise Refused(f"--out: {path} is a folder: give the name of a file in it")
    if not folder.is_dir():
        raise Refused(f"--out: there is no folder {folder}")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise Refused(f"--out: {path} cannot be written")
    if not path.exists():
        return
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or not re.match(r"#.*\bUNITS:\s*si(\s|$)", lines[0]):
        raise Refused(f"--out: {path} is no potential file in SI units: its first line must be a comment with 'UNITS: si'")
    for line in lines:
        words = line.partition("#")[0].split()
        if words and words[0] == name:
            raise Refused(f"--name: {path} holds a row '{name}' already: give another name, or take that row out")
