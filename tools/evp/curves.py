# SPDX-License-Identifier: GPL-2.0-only
"""Numbers read off a stress-strain curve: E, 0.2 % yield stress, stress at a strain, tangent.

A curve is what in.traction writes: strain, stress from the grips' reaction, stress from the virial
of the cross-sections [Pa]; or what the decks of LOADS write of other loads. Straight-line fits over the windows below average
vibration out.
"""

from typing import NamedTuple

import numpy as np

HEADER = ("strain", "stress_grip", "stress_virial")
ROUNDING = 1e-9  # of strain: rows at the ends of a window belong to it
MODULUS_END = 0.003  # E: slope over strain 0 to this at most, below the first bond in the second regime
SEARCH_END = 0.004  # the end of the elastic part is looked for up to here
ELASTIC_SHARE = 0.9  # in the elastic part: slope of the second half over that of the first, at least
JUMP_SHARE = 0.5  # of the stress where E's range ends: more at strain 0 is no damping at usual rates
KEPT = 0.75  # of an elastic part that ends before that: E is fitted to this share of it
YIELD_OFFSET = 0.002  # plastic strain by convention
STRESS_WINDOW = 0.0006  # +- of strain about which a stress is fitted
TANGENT_WINDOW = 0.0004  # +- of strain about which a tangent is fitted
DEPARTURE = 0.9  # of E: where the curve has left its straight part
# A run to 2 % ends at strain 0.02, so that its last stress is fitted a little before.
STRAINS_REPORTED = {"stress_1pc": 0.01, "stress_2pc": 0.0195}


class Curve(NamedTuple):
    """strain [1] and stresses [Pa], (N,) each, in the order of loading."""

    strain: np.ndarray
    grip: np.ndarray
    virial: np.ndarray


class Load(NamedTuple):
    """Columns of what the deck writes: strain, stress from the grips, stress from the virial; and what they are."""

    deck: str
    mark: str  # a column that the files of no other load have
    columns: tuple
    modulus: str
    strain: str
    stress: str


TENSION = Load("in.traction", "stress_virial", HEADER, "E", "nominal strain", "nominal stress")
LOADS = (
    TENSION,
    Load("in.torsion", "torque_grip", ("shear_strain", "shear_stress_grip", "shear_stress_virial"), "G", "shear strain of the surface",
         "shear stress of the surface, 2 T/(pi R^3)"),
    Load("in.bending", "deflection", ("strain", "stress", "stress"), "E", "strain of the outer fibre", "stress of the outer fibre, of elastic beams"),
    Load("in.shear", "shear_stress", ("strain", "shear_stress", "shear_stress"), "G", "shear strain", "shear stress"),
)


class CurveError(ValueError):
    """A file holds no usable curve, or a curve is too short for the number asked."""


def names_in(lines):
    """Names of the columns of a CSV file."""
    return [name.strip() for name in lines[0].split(",")] if lines else []


def load_of(path):
    """The Load whose columns a CSV file has, TENSION where it has those of none. OSError if it cannot be read."""
    with open(path, encoding="utf-8") as source:
        names = names_in([source.readline()])
    return next((load for load in LOADS if load.mark in names), TENSION)


def _remedy(missing, names, wanted):
    """What to do about a file without the columns wanted."""
    if missing == "strain_gauge":
        return "run in.traction or in.quasistatic, which write it"
    if "torque_grip" in names:
        return "it is of an older in.torsion: run the deck again"
    if "time" in names and "force" in names:
        return f"a curve over time has no modulus: take curves.py columns --x time --y NAME, NAME one of {', '.join(names[1:])}"
    return f"its first line must be {','.join(wanted)}"


def read_curve(path, column=None, strain="strain"):
    """Curve from a CSV file with the columns of one of LOADS, such as strain,stress_grip,stress_virial (more may follow).

    column: 'virial' or 'grip' where only that stress is needed; the other one is then nan.
    strain: the column of the strain, strain_gauge for that of an extensometer.
    CurveError names the file and what is missing; OSError if it cannot be read.
    """
    load = load_of(path)
    places_of = dict(zip(HEADER, load.columns if strain == "strain" else (strain, *load.columns[1:])))
    needed = [name for name in HEADER if column is None or name in ("strain", "stress_" + column)]
    wanted = [places_of[name] for name in needed]
    with open(path, encoding="utf-8") as source:
        lines = [line.strip() for line in source if line.strip()]
    names = names_in(lines)
    missing = [name for name in wanted if name not in names]
    if missing:
        raise CurveError(f"{path} has no column {missing[0]}; {_remedy(missing[0], names, wanted)}")
    places = [names.index(name) for name in wanted]
    try:
        words = [line.split(",") for line in lines[1:]]
        table = np.array([[line[k] for k in places] for line in words], dtype=float)
    except (ValueError, IndexError) as error:
        raise CurveError(f"{path} holds a damaged line: {error}") from error
    if len(table) < 2:
        raise CurveError(f"{path} holds {len(table)} rows: no curve")
    if not np.all(np.isfinite(table)):
        raise CurveError(f"{path} holds a number that is not finite: the run was unstable")
    found = dict(zip(needed, table.T))
    return Curve(*(found.get(name, np.full(len(table), np.nan)) for name in HEADER))


def _line_fit(strain, stress, low, high):
    """Slope and value at the middle of the least-squares line over low <= strain <= high."""
    middle = 0.5 * (low + high)
    inside = (strain >= low - ROUNDING) & (strain <= high + ROUNDING)
    end = np.max(strain, initial=0.0)
    if np.sum(inside) < 3 or end < 0.5 * (middle + high):
        raise CurveError(
            f"the curve has too few rows between strain {low:g} and {high:g} for a straight line: "
            f"{np.sum(inside)}; it ends at strain {end:g}"
        )
    slope, value = np.polyfit(strain[inside] - middle, stress[inside], 1)
    return float(slope), float(value)


def _is_straight(strain, stress):
    """Is the slope over the second half of the rows at least ELASTIC_SHARE of that over the first?"""
    middle = len(strain) // 2
    halves = (slice(0, len(strain) - middle), slice(middle, None))  # an odd row belongs to both
    first, second = (np.polyfit(strain[half], stress[half], 1)[0] for half in halves)
    return second >= ELASTIC_SHARE * first


def elastic_end(strain, stress):
    """Strain to which E is fitted: MODULUS_END, or less where the elastic part is shorter.

    The elastic part is the longest range from strain 0, to SEARCH_END at most, that is straight:
    vibration bends short ranges and leaves long ones straight. Where it ends before SEARCH_END it holds
    a piece of the bend, so that E is fitted to KEPT of it. CurveError where three rows are bent already.
    """
    inside = (strain > 0.0) & (strain <= SEARCH_END + ROUNDING)
    strain, stress = strain[inside], stress[inside]
    for count in range(len(strain), 2, -1):
        if _is_straight(strain[:count], stress[:count]):
            if count == len(strain):
                return MODULUS_END
            return float(min(MODULUS_END, max(KEPT * strain[count - 1], strain[2])))
    if len(strain) < 3:
        return MODULUS_END
    raise CurveError(
        f"the elastic part has fewer than three rows: the slope falls by more than "
        f"{100 * (1 - ELASTIC_SHARE):.0f} % before strain {strain[2]:.3g}; write rows closer together "
        "(-var row of the decks), or give the range (--fit)"
    )


def modulus(strain, stress):
    """E: slope of stress over strain 0 to elastic_end() [unit of stress].

    The row at strain 0 is left out: with damping the stress jumps as the motion starts.
    """
    moved = strain > 0.0
    return _line_fit(strain[moved], stress[moved], 0.0, elastic_end(strain, stress))[0]


def stress_at(strain, stress, at):
    """Stress at the strain `at`, from a straight line over +-STRESS_WINDOW [unit of stress]."""
    return _line_fit(strain, stress, at - STRESS_WINDOW, at + STRESS_WINDOW)[1]


def tangent(strain, stress, at):
    """Slope at the strain `at`, from a straight line over +-TANGENT_WINDOW [unit of stress]."""
    return _line_fit(strain, stress, at - TANGENT_WINDOW, at + TANGENT_WINDOW)[0]


def yield_stress(strain, stress, elastic_modulus):
    """Stress where the curve first meets E (strain - 0.2 %); nan if it does not.

    Interpolated between the rows on both sides of the offset line.
    """
    above = stress - elastic_modulus * (strain - YIELD_OFFSET)
    after = np.nonzero((strain[1:] > YIELD_OFFSET) & (above[1:] <= 0.0) & (above[:-1] > 0.0))[0]
    if len(after) == 0:
        return float("nan")
    k = int(after[0])
    part = above[k] / (above[k] - above[k + 1])
    return float(stress[k] + part * (stress[k + 1] - stress[k]))


def departure_strain(strain, stress, elastic_modulus, start=0.5 * MODULUS_END, share=DEPARTURE):
    """Strain where the tangent first falls below share * E; nan if it does not.

    Looked for from start on, the middle of E's window, where the starting shock has died away, in
    steps of a quarter of the tangent's window, and interpolated between them. CurveError where the
    rows are too far apart for a tangent.
    """
    step = 0.25 * TANGENT_WINDOW
    before = None
    for at in np.arange(start, strain.max() - TANGENT_WINDOW, step):
        excess = tangent(strain, stress, at) - share * elastic_modulus
        if excess < 0.0:
            return float(at if before is None else at - step * excess / (excess - before))
        before = excess
    return float("nan")


def check_fit(fit):
    """CurveError where a range of E, (low, high) or None, is none."""
    if fit is not None and not 0.0 <= fit[0] < fit[1] < np.inf:
        raise CurveError(f"the range of E must be 0 <= low < high, got {fit[0]:g} {fit[1]:g}")


def numbers(curve, column="virial", fit=None):
    """What is reported of a curve, in a dict (nan where the curve is too short):

      E_GPa, E_from and E_to (the range of strain that it is the slope of), jump_MPa (that line at
      strain 0) and jump_share (over the line at E_to), yield_MPa, stress_1pc_MPa, stress_2pc_MPa (fitted about 0.0195, so that the window ends before 2 %),
      departure_strain (tangent below 90 % of E).

    column: 'virial' or 'grip'. fit: (low, high) in place of the elastic part that is found.
    CurveError if the curve is too short for E.
    """
    strain, stress = curve.strain, getattr(curve, column)
    check_fit(fit)
    low, high = fit or (0.0, elastic_end(strain, stress))
    moved = strain > 0.0
    elastic_modulus, value = _line_fit(strain[moved], stress[moved], low, high)
    jump = value - 0.5 * (low + high) * elastic_modulus
    found = {
        "E_GPa": 1e-9 * elastic_modulus,
        "E_from": low,
        "E_to": high,
        "jump_MPa": 1e-6 * jump,
        "jump_share": jump / (jump + high * elastic_modulus),
        "yield_MPa": 1e-6 * yield_stress(strain, stress, elastic_modulus),
    }
    for name, at in STRAINS_REPORTED.items():
        found[name + "_MPa"] = 1e-6 * or_nan(stress_at, strain, stress, at)
    middle = 0.5 * (low + high)
    found["departure_strain"] = or_nan(departure_strain, strain, stress, elastic_modulus, middle)
    return found


def or_nan(number, *arguments):
    """number(*arguments), or nan where the curve is too short or too coarse for it."""
    try:
        return number(*arguments)
    except CurveError:
        return float("nan")
