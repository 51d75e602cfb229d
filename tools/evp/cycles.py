# SPDX-License-Identifier: GPL-2.0-only
"""Numbers of a curve that turns back, as in.cyclic and in.quasistatic with cycles write it: residual strain, unloading
modulus, area of loops; and one line of numbers for each of many curves, with their departures from a target.
The rows are in the order of the way; the strain goes one way between two turns.

`at` of the functions: rows of the turns, where the strain itself does not tell them: that of an extensometer jitters. None: turns(strain).
"""

from typing import NamedTuple

import numpy as np

from .curves import MODULUS_END, ROUNDING, STRESS_WINDOW, Curve, CurveError, check_fit, elastic_end, or_nan, stress_at
from .curves import numbers as curve_numbers

NAN = float("nan")
STRAINS = (0.002, 0.01)  # at which the stress is given unless told otherwise
# Columns of a target and what makes them strain [1] and stress [Pa].
TARGET_STRAIN = {"strain": 1.0, "strain_percent": 0.01}
TARGET_STRESS = {"stress": 1.0, "stress_Pa": 1.0, "stress_MPa": 1e6, "stress_virial": 1.0, "stress_grip": 1.0}
UNLOADED = 0.05  # of the stress at the turn, at most: a way back that ends with it has ended unloaded
UNLOADING_RANGE = 0.004  # of strain after the turn: the unloading modulus is the slope over it, or over the elastic part where this is shorter


def turns(strain):
    """Rows at which the strain turns back (indices), and the last row where it ends a loop of loop_areas: back at the strain that the loop
    began with to within the distance of two rows, or beyond."""
    moved = np.nonzero(np.abs(np.diff(strain)) > ROUNDING)[0]
    ways = np.sign(np.diff(strain)[moved])
    found = moved[1:][ways[1:] != ways[:-1]]
    if len(found) > 1 and len(found) % 2 == 0 and ways[-1] * (strain[found[-2]] - strain[-1]) <= np.abs(strain[moved[-1] + 1] - strain[moved[-1]]) + ROUNDING:
        found = np.append(found, len(strain) - 1)
    return found


def unloading(strain, stress, at=None):
    """(strain, stress) of the way back from the first turn, which is its first row. CurveError where there is none."""
    found = turns(strain) if at is None else at
    if len(found) == 0:
        raise CurveError(f"the curve does not turn back; it ends at strain {strain[-1]:g}")
    end = found[1] + 1 if len(found) > 1 else len(strain)
    return strain[found[0] : end], stress[found[0] : end]


def residual_strain(strain, stress, at=None):
    """Strain at which the stress is zero on the way back from the first turn.

    Between the rows on both sides of zero, or beyond the last row by no more than the distance of the last two, or, where the way back has
    ended unloaded but for vibrations, by the slope of its end; nan where the body is not unloaded.
    """
    back, held = unloading(strain, stress, at)
    after = np.nonzero(held[:-1] * held[1:] <= 0.0)[0]
    k = int(after[0]) if len(after) else len(back) - 2
    part = held[k] / (held[k] - held[k + 1]) if held[k] != held[k + 1] else -1.0
    return float(back[k] + part * (back[k + 1] - back[k])) if 0.0 <= part <= 2.0 else _zero_beyond(back, held)


def _zero_beyond(back, held):
    """Strain at which the line through the end of a way back is zero; nan where that way has not ended unloaded, or no such line goes there."""
    near = np.abs(back - back[-1]) <= min(UNLOADING_RANGE, 0.5 * np.abs(back[-1] - back[0])) + ROUNDING
    if not abs(held[-1]) < UNLOADED * abs(held[0]) or np.sum(near) < 3:
        return float("nan")
    slope, end = np.polyfit(back[near] - back[-1], held[near], 1)
    return float(back[-1] - end / slope) if slope > 0.0 else float("nan")


def unloading_modulus(strain, stress, at=None):
    """Slope over the first UNLOADING_RANGE of strain after the first turn, over the elastic part where the body flows back before, or over
    the whole way back where it ends unloaded before [unit of stress]. CurveError where it has too few rows."""
    back, held = unloading(strain, stress, at)
    elastic = elastic_end(np.abs(back - back[0]), np.abs(held - held[0]))
    reach = UNLOADING_RANGE if elastic >= MODULUS_END else elastic
    if abs(held[-1]) < UNLOADED * abs(held[0]):
        reach = min(reach, np.abs(back[-1] - back[0]))
    near = np.abs(back - back[0]) <= reach + ROUNDING
    if np.sum(near) < 3 or np.abs(back[-1] - back[0]) < reach - ROUNDING:
        raise CurveError(f"the way back has too few rows for a slope over {reach:g}: it ends at strain {back[-1]:g}")
    return float(np.polyfit(back[near] - back[0], held[near], 1)[0])


def work(strain, stress):
    """Integral of the stress over the strain along the way, by trapezoids [unit of stress]: what is left of it in a loop was
    dissipated, per volume."""
    return float(np.sum(0.5 * (stress[1:] + stress[:-1]) * np.diff(strain)))


def loop_areas(strain, stress, at=None):
    """Areas of the loops from each first turn back to it, the third and so on [unit of stress]; without one: that of the first loading and
    the way back.

    A loop is closed where the material is steady: what a first loop has not closed is in its area.
    """
    found = turns(strain) if at is None else at
    if len(found) == 0:
        raise CurveError(f"the curve does not turn back; it ends at strain {strain[-1]:g}")
    if len(found) < 3:
        end = found[1] + 1 if len(found) > 1 else len(strain)
        return [work(strain[:end], stress[:end])]
    return [work(strain[a : b + 1], stress[a : b + 1]) for a, b in zip(found[:-2:2], found[2::2])]


def numbers(curve, column="virial", at=None):
    """What is reported of a way there and back, in a dict: turn_strain, turn_MPa, residual_strain (nan where it is not unloaded),
    unloading_GPa (nan where the way back has too few rows), area_MJ_per_m3 of the last loop (one sweep: of the sweep)."""
    strain, stress = curve.strain, getattr(curve, column)
    back, held = unloading(strain, stress, at)
    return {
        "turn_strain": float(back[0]),
        "turn_MPa": 1e-6 * float(held[0]),
        "residual_strain": residual_strain(strain, stress, at),
        "unloading_GPa": 1e-9 * or_nan(unloading_modulus, strain, stress, at),
        "area_MJ_per_m3": 1e-6 * loop_areas(strain, stress, at)[-1],
    }


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
        raise CurveError(f"{path} is empty: a target has rows strain,stress")
    places, factors = (0, 1), (1.0, 1.0)
    try:
        float(lines[0][0])
    except ValueError:
        names = lines.pop(0)
        found = [next((name for name in known if name in names), None) for known in (TARGET_STRAIN, TARGET_STRESS)]
        if None in found:
            raise CurveError(f"{path}: the first line must name a column of {' '.join(TARGET_STRAIN)} and one of "
                             f"{' '.join(TARGET_STRESS)}, got {' '.join(names)}") from None
        places, factors = tuple(names.index(name) for name in found), (TARGET_STRAIN[found[0]], TARGET_STRESS[found[1]])
    try:
        table = np.array([[float(words[k]) for k in places] for words in lines]).reshape(-1, 2) * factors
    except (ValueError, IndexError) as error:
        raise CurveError(f"{path} holds a damaged line: {error}") from error
    if len(table) < 1 or not np.all(np.isfinite(table)):
        raise CurveError(f"{path} holds no row, or a number that is not finite")
    steps = np.diff(table[:, 0])
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise CurveError(f"{path}: the strains of a target must go one way, each once")
    return Target(*table.T)


def first_way(strain, stress, at=None):
    """(strain, stress, sign) up to the first turn, both positive where the way is; sign -1: it was compression. at: as above."""
    found = turns(strain) if at is None else at
    end = found[0] + 1 if len(found) else len(strain)
    sign = -1.0 if strain[end - 1] < strain[0] else 1.0
    return sign * strain[:end], sign * stress[:end], sign


def stress_on(strain, stress, at):
    """Stress at a strain of a way [unit of stress]: fitted over +-STRESS_WINDOW, interpolated where that has too few rows; nan outside."""
    if not strain.min() - ROUNDING <= at <= strain.max() + ROUNDING:
        return NAN
    try:
        if at >= STRESS_WINDOW:  # the rows at strain 0 have no damping yet
            return stress_at(strain, stress, at)
    except CurveError:
        pass
    order = np.argsort(strain, kind="stable")  # an extensometer jitters
    return float(np.interp(at, strain[order], stress[order]))


def table_numbers(curve, column="virial", fit=None, strains=STRAINS, turned=None):
    """What is reported of a curve, in a dict; nan where it has no such number; why_no_E: text, empty where there is E.

      E_GPa, E_from, E_to, yield_MPa  of the first way, from curves.numbers
      stress_at_S_MPa                 for each strain S of the first way
      turn_strain, turn_MPa, residual_strain, unloading_GPa, area_K_MJ_per_m3 for the loops K = 1, 2 ...  where the curve turns back

    Strains of compression are given and reported as sizes; stresses of it are negative. turned: rows, as `at` above. CurveError where `fit` is no range.
    """
    check_fit(fit)
    whole_strain, whole_stress = curve.strain, getattr(curve, column)
    strain, stress, sign = first_way(whole_strain, whole_stress, turned)
    names = ("E_GPa", "E_from", "E_to", "jump_MPa", "jump_share", "yield_MPa")
    try:
        elastic = {**curve_numbers(Curve(strain, stress, stress), "virial", fit), "why_no_E": ""}
    except CurveError as error:
        elastic = {**dict.fromkeys(names, NAN), "why_no_E": str(error)}
    found = {name: elastic[name] for name in (*names, "why_no_E")}
    found["yield_MPa"] *= sign
    for at in strains:
        found[f"stress_at_{at:g}_MPa"] = 1e-6 * sign * stress_on(strain, stress, at)
    found.update(turn_strain=NAN, turn_MPa=NAN, residual_strain=NAN, unloading_GPa=NAN)
    turned = turns(whole_strain) if turned is None else turned
    if len(turned):
        found["turn_strain"], found["turn_MPa"] = float(sign * strain[-1]), 1e-6 * float(sign * stress[-1])
        found["residual_strain"] = residual_strain(whole_strain, whole_stress, turned)
        found["unloading_GPa"] = 1e-9 * or_nan(unloading_modulus, whole_strain, whole_stress, turned)
        for k, area in enumerate(loop_areas(whole_strain, whole_stress, turned), start=1):
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
        raise CurveError(f"the curve goes from strain {sign * strain[0]:g} to {sign * strain[-1]:g} and reaches no row of the target")
    apart = own[reached] - target.stress[reached]
    worst, size = int(np.argmax(np.abs(apart))), float(np.abs(target.stress[reached]).max())
    mean = float(np.abs(apart).mean())
    return Departure(float(apart[worst]), float(target.strain[reached][worst]), mean, mean / size if size > 0.0 else NAN, int(reached.sum()))
