# SPDX-License-Identifier: GPL-2.0-only
"""Numbers read off a stress-strain curve: E, 0.2 % yield stress, stress at a strain, tangent; of one that turns back residual strain,
unloading modulus, area of loops; departures from a target.

A curve is what in.traction writes: strain, stress from the grips' reaction, stress from the virial
of the cross-sections [Pa]; or what the decks of LOADS write of other loads. Straight-line fits over the windows below average
vibration out. The rows are in the order of the way; the strain goes one way between two turns.

`at` of the functions of curves that turn back: rows of the turns, where the strain itself does not tell them: that of an extensometer
jitters. None: turns(strain).
"""

import contextlib
import csv
import pathlib
from typing import NamedTuple

import numpy as np
from scipy.integrate import trapezoid

from .report import note

NAN = float("nan")
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
LEFT = 0.9  # of E: tangent where the curve has left its straight part
# A run to 2 % ends at strain 0.02, so that its last stress is fitted a little before.
STRAINS_REPORTED = {"stress_1pc": 0.01, "stress_2pc": 0.0195}
NUMBERS = ("E_GPa", "E_from", "E_to", "jump_MPa", "jump_share", "yield_MPa", "stress_1pc_MPa", "stress_2pc_MPa", "departure_strain")
CYCLE_NUMBERS = ("turn_strain", "turn_MPa", "residual_strain", "unloading_GPa")
STRAINS = (0.002, 0.01)  # at which the stress is given unless told otherwise
SHARP, STRAIGHTER = 0.01, 4.0  # a way bends sharply: misfit of a line over both sides, over the stress, and over that of a line over one side
UNLOADED = 0.05  # of the stress at the turn, at most: a way back that ends with it has ended unloaded
UNLOADING_RANGE = 0.004  # of strain after the turn: the unloading modulus is the slope over it, or over the elastic part where this is shorter


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
         "shear stress of the surface, as of an elastic bar or tube"),
    Load("in.bending", "deflection", ("strain", "stress", "stress"), "E", "strain of the outer fibre, as of a beam without shear",
         "stress of the outer fibre, of elastic beams"),
    Load("in.shear", "shear_stress", ("strain", "shear_stress", "shear_stress"), "G", "shear strain", "shear stress"),
    Load("in.uniaxial", "volume_change", ("strain", "stress", "stress"), "E", "true strain", "true stress"),
    Load("in.upset", "width_plates", ("strain", "stress", "stress"), "E", "height lost, over the height", "nominal stress"),
    Load("in.pull", "stress", ("strain", "stress", "stress"), "E", "nominal strain", "nominal stress"),
)


class CurveError(ValueError):
    """A file holds no usable curve, or a curve is too short for the number asked."""


def read_columns(path, wanted, remedy=None, optional=()):
    """Dict of float arrays for the wanted columns of a CSV file with a header line, and for the optional ones that it has.

    remedy: of (missing name, names there), what to do about it. CurveError names the file and what is wrong; OSError if it cannot be read.
    """
    lines, unfinished = lines_of(path)
    lines = [[word.strip() for word in words] for words in csv.reader(lines) if words]
    names = lines[0] if lines else []
    missing = next((name for name in wanted if name not in names), None)
    if missing:
        what = remedy(missing, names) if remedy else f"wanted are {', '.join(wanted)}"
        raise CurveError(f"{path} has no column {missing}; {what}")
    if unfinished and len(lines) > 1:
        lines.pop()
        note(f"{path}: its last line has no line end and is left out: the file was cut off, or is being written. If that line is whole, end it with a line end")
    try:
        there = [*wanted, *(name for name in optional if name in names)]
        check_widths(path, [line for line in lines[1:] if len(line) > len(names)], len(names), ",")
        return {name: np.array([float(line[names.index(name)]) for line in lines[1:]]) for name in there}
    except CurveError:
        raise
    except (ValueError, IndexError) as error:
        raise CurveError(f"{path} holds a damaged line: {error}") from error


def lines_of(path):
    """(lines of a text file in any usual encoding, whether the last one has no line end)."""
    content = pathlib.Path(path).read_bytes()
    codes = ("utf-16",) if content[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "cp1252")
    text = None
    for code in codes:
        with contextlib.suppress(UnicodeDecodeError):
            text = content.decode(code) if text is None else text
    if text is None or "\0" in text:
        raise CurveError(f"{path} is no text file: save the curve as a CSV")
    return text.splitlines(), bool(text) and text[-1] not in "\r\n"


def check_widths(path, rows, width, separator):
    """CurveError where a row has not as many values as there are columns."""
    wrong = next((row for row in rows if len(row) != width), None)
    if wrong is not None:
        remedy = "; where the comma is the decimal sign, put ';' or tabs between the columns, or write decimal points" if separator == "," and len(wrong) > width else ""
        raise CurveError(f"{path} holds a damaged line: '{(separator or ' ').join(wrong)}' has {len(wrong)} values for {width} columns{remedy}")


def load_of(path):
    """The Load whose columns a CSV file has, TENSION where it has those of none. OSError if it cannot be read."""
    with open(path, encoding="utf-8-sig") as source:
        names = [name.strip() for name in source.readline().split(",")]
    return next((load for load in LOADS if load.mark in names), TENSION)


def read_curve(path, strain="strain"):
    """Curve from a CSV file with the columns of one of LOADS, such as strain,stress_grip,stress_virial (more may follow).

    strain: the column of the strain, strain_gauge for that of an extensometer. A file without stress_grip gives nan for it. Errors as of read_columns.
    """
    own, grip, virial = load_of(path).columns
    strain = own if strain == "strain" else strain

    def remedy(missing, names):
        if missing == "strain_gauge":
            return "run in.traction or in.quasistatic, which write it"
        if "time" in names and "force" in names:
            return f"a curve over time has no modulus: take curves.py columns --x time --y NAME, NAME one of {', '.join(names[1:])}"
        return f"its first line must be {strain},{virial}"

    found = read_columns(path, (strain, virial), remedy, (grip,))
    if len(found[strain]) < 2:
        raise CurveError(f"{path} holds {len(found[strain])} rows: no curve")
    if not np.all(np.isfinite([found[strain], found[virial]])):
        raise CurveError(f"{path} holds a number that is not finite: the run was unstable")
    return Curve(found[strain], found.get(grip, np.full_like(found[strain], NAN)), found[virial])


def _line_fit(strain, stress, low, high):
    """Slope and value at the middle of the least-squares line over low <= strain <= high."""
    middle = 0.5 * (low + high)
    inside = (strain >= low - ROUNDING) & (strain <= high + ROUNDING)
    end = np.max(strain, initial=0.0)
    if np.sum(inside) < 3 or end < 0.5 * (middle + high):
        raise CurveError(f"the curve has too few rows between strain {low:g} and {high:g} for a straight line: {np.sum(inside)}; it ends at strain {end:g}: "
                         "pull farther or in smaller increments, or give the range (--fit)")
    slope, value = np.polyfit(strain[inside] - middle, stress[inside], 1)
    return float(slope), float(value)


def elastic_end(strain, stress):
    """Strain to which E is fitted: MODULUS_END, or less where the elastic part is shorter.

    The elastic part is the longest range from strain 0, to SEARCH_END at most, that is straight by ELASTIC_SHARE: vibration bends short
    ranges and leaves long ones straight. Where it ends before SEARCH_END it holds a piece of the bend, so that E is fitted to KEPT of it.
    CurveError where three rows are bent already.
    """
    inside = (strain > 0.0) & (strain <= SEARCH_END + ROUNDING)
    strain, stress = strain[inside], stress[inside]
    for count in range(len(strain), 2, -1):
        halves = slice(0, count - count // 2), slice(count // 2, count)  # an odd row belongs to both
        first, second = (np.polyfit(strain[half], stress[half], 1)[0] for half in halves)
        if second >= ELASTIC_SHARE * first:
            if count == len(strain):
                return MODULUS_END
            return float(min(MODULUS_END, max(KEPT * strain[count - 1], strain[2])))
    if len(strain) < 3:
        return MODULUS_END
    raise CurveError(f"the elastic part has fewer than three rows: the slope falls by more than {100 * (1 - ELASTIC_SHARE):.0f} % before strain {strain[2]:.3g}; "
                     "write rows closer together (-var row or -var increment of the decks), or give the range (--fit)")


def modulus(strain, stress):
    """E: slope of stress over strain 0 to elastic_end() [unit of stress].

    The row at strain 0 is left out: with damping the stress jumps as the motion starts.
    """
    moved = strain > 0.0
    return _line_fit(strain[moved], stress[moved], 0.0, elastic_end(strain, stress))[0]


def stress_at(strain, stress, at):
    """Stress at the strain `at`, from a straight line over +-STRESS_WINDOW [unit of stress]."""
    return _line_fit(strain, stress, at - STRESS_WINDOW, at + STRESS_WINDOW)[1]


def yield_stress(strain, stress, elastic_modulus):
    """Stress where the curve first meets E (strain - 0.2 %), interpolated between the rows on both sides; nan if it does not."""
    above = stress - elastic_modulus * (strain - YIELD_OFFSET)
    after = np.nonzero((strain[1:] > YIELD_OFFSET) & (above[1:] <= 0.0) & (above[:-1] > 0.0))[0]
    if len(after) == 0:
        return NAN
    k = int(after[0])
    part = above[k] / (above[k] - above[k + 1])
    return float(stress[k] + part * (stress[k + 1] - stress[k]))


def departure_strain(strain, stress, elastic_modulus, start):
    """Strain where the tangent first falls below LEFT * E; nan if it does not.

    Looked for from start on, the middle of E's window, where the starting shock has died away, in steps of a quarter of the tangent's window, and
    interpolated between them. CurveError where the rows are too far apart for a tangent.
    """
    step = 0.25 * TANGENT_WINDOW
    before = None
    for at in np.arange(start, strain.max() - TANGENT_WINDOW, step):
        excess = _line_fit(strain, stress, at - TANGENT_WINDOW, at + TANGENT_WINDOW)[0] - LEFT * elastic_modulus
        if excess < 0.0:
            return float(at if before is None else at - step * excess / (excess - before))
        before = excess
    return NAN


def numbers(curve, fit=None):
    """What is reported of a curve, in a dict (nan where the curve is too short):

      E_GPa, E_from and E_to (the range of strain that it is the slope of), jump_MPa (that line at
      strain 0) and jump_share (over the line at E_to), yield_MPa, stress_1pc_MPa, stress_2pc_MPa (fitted about 0.0195, so that the window ends before 2 %),
      departure_strain (tangent below 90 % of E).

    fit: (low, high) in place of the elastic part that is found. CurveError if the curve is too short for E.
    """
    strain, stress = curve.strain, curve.virial
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
        found[name + "_MPa"] = 1e-6 * stress_on(strain, stress, at)
    return {**found, "departure_strain": or_nan(departure_strain, strain, stress, elastic_modulus, 0.5 * (low + high))}


def or_nan(number, *arguments):
    """number(*arguments), or nan where the curve is too short or too coarse for it."""
    try:
        return number(*arguments)
    except CurveError:
        return NAN


def named(name, number, *arguments, remedy=""):
    """number(*arguments); a CurveError names the curve."""
    try:
        return number(*arguments)
    except CurveError as error:
        raise CurveError(f"{name}: {error}{remedy}") from error


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
        return NAN
    slope, end = np.polyfit(back[near] - back[-1], held[near], 1)
    return float(back[-1] - end / slope) if slope > 0.0 else NAN


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


def loop_areas(strain, stress, at=None):
    """Areas of the loops from each first turn back to it, the third and so on [unit of stress], what was dissipated per volume; without one:
    that of the first loading and the way back.

    A loop is closed where the material is steady: what a first loop has not closed is in its area.
    """
    found = turns(strain) if at is None else at
    if len(found) < 3:
        end = found[1] + 1 if len(found) > 1 else len(strain)
        return [trapezoid(stress[:end], strain[:end])]
    return [trapezoid(stress[a : b + 1], strain[a : b + 1]) for a, b in zip(found[:-2:2], found[2::2])]


def cycle_numbers(curve, at=None):
    """What is reported of a way there and back, in a dict: turn_strain, turn_MPa, residual_strain (nan where it is not unloaded),
    elastic_strain, the stress at the turn over the unloading modulus, and rest_strain, what came back besides; unloading_GPa (these
    three nan where the way back has too few rows), area_MJ_per_m3 of the last loop (one sweep: of the sweep)."""
    strain, stress = curve.strain, curve.virial
    back, held = unloading(strain, stress, at)
    modulus, residual = or_nan(unloading_modulus, strain, stress, at), residual_strain(strain, stress, at)
    elastic = float(held[0]) / modulus
    return {
        "turn_strain": float(back[0]),
        "turn_MPa": 1e-6 * float(held[0]),
        "residual_strain": residual,
        "elastic_strain": elastic,
        "rest_strain": float(back[0]) - residual - elastic,
        "unloading_GPa": 1e-9 * modulus,
        "area_MJ_per_m3": 1e-6 * loop_areas(strain, stress, at)[-1],
    }


def first_way(strain, stress, at=None):
    """(strain, stress, sign) up to the first turn, both positive where the way is; sign -1: it was compression. at: as above."""
    found = turns(strain) if at is None else at
    end = found[0] + 1 if len(found) else len(strain)
    sign = -1.0 if strain[end - 1] < strain[0] else 1.0
    return sign * strain[:end], sign * stress[:end], sign


def stress_on(strain, stress, at):
    """Stress at a strain of a way [unit of stress]: fitted over +-STRESS_WINDOW, interpolated where that has too few rows; nan outside."""
    if not _within(strain, at):
        return NAN
    try:
        if at >= STRESS_WINDOW:  # the rows at strain 0 have no damping yet
            return stress_at(strain, stress, at)
    except CurveError:
        pass
    order = np.argsort(strain, kind="stable")  # an extensometer jitters
    return float(np.interp(at, strain[order], stress[order]))


def table_numbers(curve, fit=None, strains=STRAINS, turned=None):
    """What is reported of a curve, in a dict; nan where it has no such number; why_no_E: text, empty where there is E.

      all of numbers()                of the first way
      stress_at_S_MPa                 for each strain S of the first way
      CYCLE_NUMBERS, area_K_MJ_per_m3 for the loops K = 1, 2 ...  where the curve turns back

    Strains of compression are given and reported as sizes; stresses of it are negative. turned: rows, as `at` above.
    """
    turned = turns(curve.strain) if turned is None else turned
    strain, stress, sign = first_way(curve.strain, curve.virial, turned)
    try:
        found = {**numbers(Curve(strain, stress, stress), fit), "why_no_E": ""}
    except CurveError as error:
        found = {**dict.fromkeys(NUMBERS, NAN), "why_no_E": str(error)}
    found.update({f"stress_at_{at:g}_MPa": 1e-6 * stress_on(strain, stress, at) for at in strains})
    found.update({name: sign * value for name, value in found.items() if name.endswith("_MPa")})
    if not len(turned):
        return {**found, **dict.fromkeys(CYCLE_NUMBERS, NAN)}
    areas = loop_areas(curve.strain, curve.virial, turned)
    back = cycle_numbers(curve, turned)
    found.update({name: back[name] for name in CYCLE_NUMBERS})
    return {**found, **{f"area_{k}_MJ_per_m3": 1e-6 * area for k, area in enumerate(areas, start=1)}}


DEPARTURE = {  # titles in print
    "departure_largest_MPa": "largest [MPa]",  # with its sign
    "departure_at_strain": "at strain",
    "departure_mean_MPa": "mean of sizes [MPa]",
    "departure_mean_percent": "mean [% of largest stress]",
    "departure_rows": "rows",
}


def _apart(strain, stress, target, at):
    """A way minus a target (strains that grow, stresses) at a strain of its rows; nan where the way does not go there.

    A straight line over a bend cuts it off. Where the target has rows enough for such a line, too, it is fitted to the difference; else the stress of
    the way is that of its straight side.
    """
    middle, row = stress_on(strain, stress, at), float(np.interp(at, *target))
    inside = (strain >= target[0][0] - ROUNDING) & (strain <= target[0][-1] + ROUNDING)
    if np.isfinite(middle) and min(np.sum(np.abs(values - at) <= STRESS_WINDOW + ROUNDING) for values in (target[0], strain[inside])) >= 3:
        return stress_on(strain[inside], stress[inside] - np.interp(strain[inside], *target), at) if _within(strain[inside], at) else middle - row
    return _straight_side(strain, stress, at, middle) - row


def _within(strain, at):
    """Whether a strain is one of those of a way."""
    return strain.min() - ROUNDING <= at <= strain.max() + ROUNDING


def _straight_side(strain, stress, at, middle):
    """The stress at a strain of a way, `middle` by a straight line over both sides; of the straighter side where the way bends sharply."""
    fits = []
    for low, high in ((-1.0, 0.0), (0.0, 1.0), (-1.0, 1.0)):
        near = (strain >= at + low * STRESS_WINDOW - ROUNDING) & (strain <= at + high * STRESS_WINDOW + ROUNDING)
        if np.sum(near) < 3 or at < STRESS_WINDOW:
            return middle
        line = np.polyfit(strain[near] - at, stress[near], 1)
        squares = np.sum((np.polyval(line, strain[near] - at) - stress[near]) ** 2)
        fits.append((float(np.sqrt(squares / (np.sum(near) - 2))), float(line[1])))
    side = min(fits[:2])
    return side[1] if fits[2][0] > max(SHARP * abs(middle), STRAIGHTER * side[0]) else middle


def departure(curve, target, turned=None):
    """Numbers of DEPARTURE in a dict: the first way of the curve minus the target (strain, stress), at the rows of the target that it reaches.

    CurveError where it reaches none.
    """
    strain, stress, sign = first_way(curve.strain, curve.virial, turned)
    given = tuple(values[np.argsort(sign * target[0])] * sign for values in target)
    apart = np.array([sign * _apart(strain, stress, given, sign * at) for at in target[0]])
    reached = np.isfinite(apart)
    if not reached.any():
        raise CurveError(f"the curve goes from strain {sign * strain[0]:g} to {sign * strain[-1]:g} and reaches no row of the target")
    places, stresses = (values[reached] for values in target)
    apart = apart[reached]
    worst, size = int(np.argmax(np.abs(apart))), float(np.abs(stresses).max())
    mean = float(np.abs(apart).mean())
    share = 100.0 * mean / size if size > 0.0 else NAN
    return dict(zip(DEPARTURE, (1e-6 * float(apart[worst]), float(places[worst]), 1e-6 * mean, share, int(reached.sum()))))
