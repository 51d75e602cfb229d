# SPDX-License-Identifier: GPL-2.0-only
"""One line of numbers for each of many curves, also of such that turn back, and how far they are from a target."""

from typing import NamedTuple

import numpy as np

from . import curves, cycles

NAN = float("nan")
STRAINS = (0.002, 0.01)  # at which the stress is given unless told otherwise
# Columns of a target and what makes them strain [1] and stress [Pa].
TARGET_STRAIN = {"strain": 1.0, "strain_percent": 0.01}
TARGET_STRESS = {"stress": 1.0, "stress_Pa": 1.0, "stress_MPa": 1e6, "stress_virial": 1.0, "stress_grip": 1.0}


class Target(NamedTuple):
    """strain [1] and stress [Pa], (N,) each; the strain goes one way."""

    strain: np.ndarray
    stress: np.ndarray


def read_target(path):
    """Target from a file of strain,stress rows: in Pa, or as a first line names the columns (TARGET_STRAIN, TARGET_STRESS).

    CurveError names the file and what is wrong; OSError where it cannot be read.
    """
    with open(path, encoding="utf-8") as source:
        lines = [line.replace(",", " ").split() for line in source if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise curves.CurveError(f"{path} is empty: a target has rows strain,stress")
    places, factors = (0, 1), (1.0, 1.0)
    try:
        float(lines[0][0])
    except ValueError:
        names = lines.pop(0)
        found = [next((name for name in known if name in names), None) for known in (TARGET_STRAIN, TARGET_STRESS)]
        if None in found:
            raise curves.CurveError(f"{path}: the first line must name a column of {' '.join(TARGET_STRAIN)} and one of "
                                    f"{' '.join(TARGET_STRESS)}, got {' '.join(names)}") from None
        places, factors = tuple(names.index(name) for name in found), (TARGET_STRAIN[found[0]], TARGET_STRESS[found[1]])
    try:
        table = np.array([[float(words[k]) for k in places] for words in lines]).reshape(-1, 2) * factors
    except (ValueError, IndexError) as error:
        raise curves.CurveError(f"{path} holds a damaged line: {error}") from error
    if len(table) < 1 or not np.all(np.isfinite(table)):
        raise curves.CurveError(f"{path} holds no row, or a number that is not finite")
    steps = np.diff(table[:, 0])
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise curves.CurveError(f"{path}: the strains of a target must go one way, each once")
    return Target(*table.T)


def first_way(strain, stress, at=None):
    """(strain, stress, sign) up to the first turn, both positive where the way is; sign -1: it was compression. at: of cycles.py."""
    found = cycles.turns(strain) if at is None else at
    end = found[0] + 1 if len(found) else len(strain)
    sign = -1.0 if strain[end - 1] < strain[0] else 1.0
    return sign * strain[:end], sign * stress[:end], sign


def stress_on(strain, stress, at):
    """Stress at a strain of a way [unit of stress]: fitted over +-STRESS_WINDOW, interpolated where that has too few rows; nan outside."""
    if not strain.min() - curves.ROUNDING <= at <= strain.max() + curves.ROUNDING:
        return NAN
    try:
        if at >= curves.STRESS_WINDOW:  # the rows at strain 0 have no damping yet
            return curves.stress_at(strain, stress, at)
    except curves.CurveError:
        pass
    order = np.argsort(strain, kind="stable")  # an extensometer jitters
    return float(np.interp(at, strain[order], stress[order]))


def numbers(curve, column="virial", fit=None, strains=STRAINS, turns=None):
    """What is reported of a curve, in a dict; nan where it has no such number; why_no_E: text, empty where there is E.

      E_GPa, E_from, E_to, yield_MPa  of the first way, from curves.numbers
      stress_at_S_MPa                 for each strain S of the first way
      turn_strain, turn_MPa, residual_strain, unloading_GPa, area_K_MJ_per_m3 for the loops K = 1, 2 ...  where the curve turns back

    Strains of compression are given and reported as sizes; stresses of it are negative. turns: rows, as `at` of cycles.py. CurveError where `fit` is no range.
    """
    curves.check_fit(fit)
    whole_strain, whole_stress = curve.strain, getattr(curve, column)
    strain, stress, sign = first_way(whole_strain, whole_stress, turns)
    names = ("E_GPa", "E_from", "E_to", "jump_MPa", "jump_share", "yield_MPa")
    try:
        elastic = {**curves.numbers(curves.Curve(strain, stress, stress), "virial", fit), "why_no_E": ""}
    except curves.CurveError as error:
        elastic = {**dict.fromkeys(names, NAN), "why_no_E": str(error)}
    found = {name: elastic[name] for name in (*names, "why_no_E")}
    found["yield_MPa"] *= sign
    for at in strains:
        found[f"stress_at_{at:g}_MPa"] = 1e-6 * sign * stress_on(strain, stress, at)
    found.update(turn_strain=NAN, turn_MPa=NAN, residual_strain=NAN, unloading_GPa=NAN)
    turns = cycles.turns(whole_strain) if turns is None else turns
    if len(turns):
        found["turn_strain"], found["turn_MPa"] = float(sign * strain[-1]), 1e-6 * float(sign * stress[-1])
        found["residual_strain"] = cycles.residual_strain(whole_strain, whole_stress, turns)
        found["unloading_GPa"] = 1e-9 * curves.or_nan(cycles.unloading_modulus, whole_strain, whole_stress, turns)
        for k, area in enumerate(cycles.loop_areas(whole_strain, whole_stress, turns), start=1):
            found[f"area_{k}_MJ_per_m3"] = 1e-6 * area
    return found


class Departure(NamedTuple):
    """Curve minus target at the rows of the target that the curve reaches [Pa]; strains are the target's."""

    largest: float  # with its sign
    at: float
    mean: float  # of the sizes
    relative: float  # mean over the largest stress of these rows
    rows: int


def departure(curve, target, column="virial", turns=None):
    """Departure of the first way of a curve. CurveError where it reaches no row of the target."""
    strain, stress, sign = first_way(curve.strain, getattr(curve, column), turns)
    own = np.array([sign * stress_on(strain, stress, sign * at) for at in target.strain])
    reached = np.isfinite(own)
    if not reached.any():
        raise curves.CurveError(f"the curve goes from strain {sign * strain[0]:g} to {sign * strain[-1]:g} and reaches no row of the target")
    apart = own[reached] - target.stress[reached]
    worst, size = int(np.argmax(np.abs(apart))), float(np.abs(target.stress[reached]).max())
    mean = float(np.abs(apart).mean())
    return Departure(float(apart[worst]), float(target.strain[reached][worst]), mean, mean / size if size > 0.0 else NAN, int(reached.sum()))
