# SPDX-License-Identifier: GPL-2.0-only
"""Numbers of a curve that turns back, as in.cyclic and in.quasistatic with cycles write it: residual strain, unloading
modulus, area of loops. The rows are in the order of the way; the strain goes one way between two turns.

`at` of the functions: rows of the turns, where the strain itself does not tell them: that of an extensometer jitters. None: turns(strain).
"""

import numpy as np

from .curves import MODULUS_END, ROUNDING, CurveError, elastic_end, or_nan

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


def stress_back_at(strain, stress, at=0.0):
    """Stress at a strain on the way back from the first turn [unit of stress]; CurveError where it ends before."""
    back, held = unloading(strain, stress)
    order = np.argsort(back, kind="stable")
    if not back[order[0]] - 1e-6 <= at <= back[order[-1]] + 1e-6:
        raise CurveError(f"the way back ends at strain {back[-1]:g}")
    return float(np.interp(at, back[order], held[order]))


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
