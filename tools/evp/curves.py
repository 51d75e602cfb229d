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
import itertools
import pathlib
import re
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
# Units in the header of a measured curve and what makes them strain [1] and stress [Pa]; '': no unit is given.
UNITS = {
    "strain": {"": 1.0, "-": 1.0, "1": 1.0, "m/m": 1.0, "mm/mm": 1.0, "in/in": 1.0, "um/um": 1.0, "%": 0.01, "percent": 0.01, "mm/m": 1e-3, "um/m": 1e-6,
               "microstrain": 1e-6},
    "stress": {"": 1.0, "Pa": 1.0, "N/m2": 1.0, "kPa": 1e3, "MPa": 1e6, "Mpa": 1e6, "MPA": 1e6, "N/mm2": 1e6, "GPa": 1e9, "kN/mm2": 1e9, "psi": 6894.757293168,
               "ksi": 6894757.293168},
}
PREFERRED = ("strain", "stress", "stress_virial", "stress_grip")  # of several columns of one quantity
PLAIN = {"nominal", "engineering", "eng", "true", "total", "tensile", "compressive", "axial", "grip", "virial", "gauge"}  # words of a name that are no unit
QUALIFIED = ("plastic", "elastic", "shear", "lateral", "transverse", "rate")  # a column of another quantity
NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")
COMMA_NUMBER = re.compile(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")  # or three decimals
RAW_ROWS = 20  # fewer tell no noise: each row counts as it stands
GOES_BACK = 12.0  # of the noise of the strains: farther back is no noise
GROUP_NOISE = 4.0  # of the noise of the strains: distance of two means, at least
GROUP_RANGE = 5e-4  # of strain that a mean goes over to make the noise of the stress smaller, at most: a quarter of YIELD_OFFSET
QUIET = 0.002  # of the largest stress: noise of the means
NOISY = 0.001  # likewise of the rows: more is smoothed
SHARP, STRAIGHTER = 0.01, 4.0  # a way bends sharply: misfit of a line over both sides, over the stress, and over that of a line over one side
SERRATION, SERRATIONS = 0.005, 5  # of the largest stress: a fall; so many of them are serrations
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
    Load("in.upset", "width_plates", ("strain", "stress", "stress"), "E", "height lost, over the height", "nominal stress"),
    Load("in.pull", "stress", ("strain", "stress", "stress"), "E", "nominal strain", "nominal stress"),
)


class CurveError(ValueError):
    """A file holds no usable curve, or a curve is too short for the number asked."""


def read_columns(path, wanted, remedy=None, optional=()):
    """Dict of float arrays for the wanted columns of a CSV file with a header line, and for the optional ones that it has.

    remedy: of (missing name, names there), what to do about it. CurveError names the file and what is wrong; OSError if it cannot be read.
    """
    lines, unfinished = _lines(path)
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
        _check_widths(path, [line for line in lines[1:] if len(line) > len(names)], len(names), ",")
        return {name: np.array([float(line[names.index(name)]) for line in lines[1:]]) for name in there}
    except CurveError:
        raise
    except (ValueError, IndexError) as error:
        raise CurveError(f"{path} holds a damaged line: {error}") from error


def _lines(path):
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


def _check_widths(path, rows, width, separator):
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


def read_points(path, is_true=False):
    """(strain, stress [Pa]) of a file of a measured curve: two columns without a header, in Pa; or those of strain and stress by their names, with
    their units, such as strain [%], Stress / MPa, strain_percent, of any number of columns.

    Columns apart by ';', tabs, commas or blanks; decimal commas with all of these but commas. is_true: whether true values are asked for.
    CurveError names the file and what is wrong; OSError where it cannot be read.
    """
    lines, unfinished = _lines(path)
    comments = [line.strip().lstrip("#") for line in itertools.takewhile(lambda line: not line.strip() or line.lstrip().startswith("#"), lines)]
    lines = [line.strip("\r\n ") for line in lines if line.strip(" \t;,") and not line.lstrip().startswith("#")]
    if not lines:
        raise CurveError(f"{path} is empty: a target has rows strain,stress")
    head = list(itertools.takewhile(lambda line: not NUMBER.fullmatch(_first(line)) and _first(line).lower() not in ("nan", "inf"), lines))
    rows = lines[len(head) :]
    separator = _separator(rows)
    rows = [_fields(line, separator) for line in rows]
    if not head:  # a comment may be the header
        head = [line for line in comments if all(re.search(rf"\b{quantity}", line, re.I) for quantity in UNITS)][-1:]
    names = _names(path, head, len(rows[0]) if rows else 2)
    rows = [row[: len(names)] + [word for word in row[len(names) :] if word] for row in rows]  # a line may end with separators
    columns = [_column(path, names, quantity, is_true) for quantity in UNITS]
    if unfinished and rows and (len(rows[-1]) < len(names) or "" in rows[-1] or "stress_virial" in names):  # of a run, which ends each line
        rows.pop()
        note(f"{path}: its last line has no line end and is left out: it was cut off")
    elif unfinished and rows:
        ends = [f"{names[place]} {rows[-1][place]}" for place, _ in columns]
        note(f"{path}: its last line has no line end and is taken as it stands, {', '.join(ends)}: check that no digit is missing")
    _check_widths(path, rows, len(names), separator)
    words = [[row[place] for place, _ in columns] for row in rows]
    text = [word for row in words for word in row]
    if any("," in word for word in text):
        if any("." in word for word in text):
            raise CurveError(f"{path} has numbers with commas and numbers with points: take out those that group thousands, and write all decimals alike")
        if all(THOUSANDS.fullmatch(word) for word in text if "," in word):
            raise CurveError(f"{path}: '{next(word for word in text if ',' in word)}' may have a decimal comma or one that groups thousands: write decimal points")
        words = [[word.replace(",", ".") for word in row] for row in words]
    try:
        table = np.array(words, dtype=float).reshape(-1, 2) * [scale for _, scale in columns]
    except ValueError as error:
        raise CurveError(f"{path} holds a damaged line: {error}") from error
    if len(table) < 1 or not np.all(np.isfinite(table)):
        raise CurveError(f"{path} holds no row, or a number that is not finite")
    return table.T


def _first(line):
    """The first word of a line, without what stands between columns."""
    return re.split(r"[;\t\s]|,(?!\d)", line.replace('"', "").strip())[0].split(",")[0]


def _separator(rows):
    """What is between the columns of these lines: ';', a tab, a comma, or None for blanks."""
    for mark in (";", "\t"):
        if rows and all(mark in line for line in rows):
            return mark
    if not any("," in line for line in rows):
        return None
    return None if all(len(line.split()) > 1 and all(map(COMMA_NUMBER.fullmatch, line.split())) for line in rows) else ","


def _fields(line, separator):
    """Words of a line; those of another separator where it has blanks in place of commas."""
    if separator is None or (separator == "," and "," not in line):
        return line.split()
    return [word.strip() for word in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _names(path, head, width):
    """Names of the columns, with their units; head: the lines above the numbers, of which the last names the columns, or their units."""
    if not head:
        if width != 2:
            raise CurveError(f"{path} has {width} columns and no line that names them: write one above, such as strain,stress_MPa,time; "
                             "where the comma is the decimal sign, put ';' or tabs between the columns")
        return ["strain", "stress"]

    def fields(line):
        mark = next((mark for mark in (";", "\t", ",") if mark in line), None)
        if mark:
            return _fields(line.rstrip(mark), mark)
        return [word.strip() for word in re.findall(r"[^\s\[(/]+(?:\s*(?:\[[^]]*\]|\([^)]*\)|/\s*\S+))?|\[[^]]*\]|\([^)]*\)", line)]

    names = fields(head[-1])
    known = {unit for units in UNITS.values() for unit in units}
    if len(head) > 1 and not any("str" in name.lower() for name in names) and any(_plain(name.strip("[]()")) in known - {""} for name in names):
        names = [f"{name} [{unit.strip('[]()')}]" for name, unit in itertools.zip_longest(fields(head[-2]), names, fillvalue="")]
    return names


def _plain(unit):
    """A unit as UNITS has it."""
    for sign, word in {" ": "", "\u00b2": "2", "^": "", "**": "", "\u00b5": "u", "\u03bc": "u"}.items():
        unit = unit.replace(sign, word)
    return unit


def _split(name):
    """(words of a name, unit) of the title of a column."""
    found = re.fullmatch(r"(.*?)\s*(?:\[([^]]*)\]|\(([^)]*)\)|(?:/|,|\bin\b)\s*(\S+)|[_\s](percent|microstrain|%|[kMG]?Pa|psi|ksi))", name.strip())
    words, unit = (found[1], next(unit for unit in found.groups()[1:] if unit is not None)) if found else (name, "")
    return re.findall(r"[^\W_]+", words.lower()), _plain(unit)


def _column(path, names, quantity, is_true):
    """(place, factor to SI) of the column of the strain or stress."""
    split = [_split(name) for name in names]
    found = [k for k, (words, _) in enumerate(split) if quantity in words and not any(word in QUALIFIED for word in words)]
    if not found:
        raise CurveError(f"{path}: the first line must name a column of {quantity}, such as {quantity}{' [%]' if quantity == 'strain' else ' [MPa]'}, "
                         f"nominal or true and in total, got {', '.join(names)}")
    if len(found) > 1:
        preferred = next((names.index(name) for name in PREFERRED if name.startswith(quantity) and name in names), None)
        if preferred is None:
            raise CurveError(f"{path} has several columns of {quantity}: {', '.join(names[k] for k in found)}; leave one")
        found = [preferred]
    (words, unit), units = split[found[0]], UNITS[quantity]
    if not unit and ("%" in names[found[0]] or set(words) - PLAIN - {quantity}):
        raise CurveError(f"{path}: column '{names[found[0]]}': its unit cannot be told: call it {quantity}, in {'1' if quantity == 'strain' else 'Pa'}, or put the unit "
                         f"behind, such as {quantity} {'[%]' if quantity == 'strain' else '[MPa]'}")
    if unit not in units:
        raise CurveError(f"{path}: column '{names[found[0]]}': the unit '{unit}' is none of {', '.join(filter(None, units))}")
    if is_true and {"nominal", "engineering", "eng"} & set(words) or not is_true and "true" in words:
        raise CurveError(f"{path}: column '{names[found[0]]}': {'true' if is_true else 'nominal'} values are asked for; "
                         "calibrate.py takes nominal values, with --true true ones; a target has nominal ones")
    return found[0], units[unit]


def noise_of(values):
    """Standard deviation of what jumps from row to row; 0 where the values are smooth, or too few."""
    bends = np.abs(np.diff(values, 2))
    usual = float(np.median(bends)) if len(values) >= RAW_ROWS else 0.0
    if usual <= 1e-6 * np.ptp(values):  # round-off
        return 0.0
    bends = np.clip(np.diff(values, 2), -5.0 * usual, 5.0 * usual)  # a sharp bend is no noise
    return usual / (0.6745 * np.sqrt(6.0)) if np.sum(bends[1:] * bends[:-1]) < -0.3 * np.sum(bends**2) else 0.0


def one_loading(path, strain, stress):
    """(strain, stress, whether they are averages) of one loading, in which the strain grows: as given where it does from row to row and the stress is
    smooth, else averages of consecutive rows, whose strains grow; then it is said.

    CurveError where the strain goes back by more than its noise or resolution.
    """
    steps, noise, scatter, size = np.diff(strain), noise_of(strain), noise_of(stress), np.max(np.abs(stress))
    if np.all(steps > 0.0) and scatter <= NOISY * size:
        return strain, stress, False
    gaps = np.diff(np.unique(strain))
    resolution = float(gaps.min()) if len(gaps) and len(gaps) < 0.7 * len(steps) else 0.0  # rows share strains
    before = np.maximum.accumulate(strain)
    back = np.nonzero(before - strain > (max(GOES_BACK * noise, 1.5 * resolution) if len(strain) >= RAW_ROWS else 0.0))[0]
    if len(back):
        k = int(back[0])
        top = int(np.argmax(strain[: k + 1]))
        raise CurveError(f"{path}: strains that do not grow: row {k + 1} of the numbers goes back to strain {strain[k]:g} from {strain[top]:g} in row {top + 1}, "
                         f"{'beyond the noise of ' + format(noise, '.2g') if noise else 'and the strains have no such noise'}: give one loading, from rest on; "
                         "take out the rows that unload and load again, or those where the extensometer slipped")
    least, wanted = max(GROUP_NOISE * noise, 2.0 * resolution), (scatter / (QUIET * size)) ** 2 if size > 0.0 else 1.0
    sums, starts, last = np.concatenate([[0.0], np.cumsum(strain)]), [0], -np.inf
    for k in range(1, len(strain) + 1):
        begin = starts[-1]
        middle = (sums[k] - sums[begin]) / (k - begin)
        if middle > last + least and (k - begin >= wanted or before[k - 1] - before[begin] >= GROUP_RANGE):
            starts.append(k)
            last = middle
    starts.pop()  # rows behind the last average belong to it
    if len(starts) < 3:
        raise CurveError(f"{path}: fewer than three strains that can be told apart, in {len(strain)} rows with a noise of {noise:.2g} and a resolution of "
                         f"{resolution:.2g}: give a curve that goes farther")
    note(f"{path}: {'strains repeat or fall' if np.any(steps <= 0.0) else 'the stress has noise'}: its {len(strain)} rows are averaged to {len(starts)} points; "
         f"noise (standard deviation) of the strain {noise:.2g}, of the stress {1e-6 * scatter:.2g} MPa")
    counts = np.diff([*starts, len(strain)])
    return (*(np.add.reduceat(values, starts) / counts for values in (strain, stress)), True)


def levelled(path, strain, stress, averaged):
    """(strain, stress) of one loading to its largest stress, without noise and serrations: stresses do not fall, by least squares. As given where
    it is not averaged and has no serrations."""
    falls = _falls(stress, max(SERRATION * np.max(np.abs(stress)), 6.0 * noise_of(stress)))
    if not averaged and falls < SERRATIONS:
        return strain, stress
    levels, counts = _rising(stress)
    stress = np.repeat(levels, counts)
    if falls >= SERRATIONS:
        note(f"{path}: the stress falls {falls} times: serrations are averaged")
        end = int(np.cumsum(counts)[np.nonzero(counts > 1)[0][-1]])  # what follows is the rise of one that has not ended
        strain, stress = strain[:end], stress[:end]
    return strain, stress


def _falls(values, size):
    """How many times the values fall from a height by more than a size, and rise by more than it again or end."""
    count, extreme, down = 0, values[0], False
    for value in values:
        if (extreme - value if not down else value - extreme) > size:
            down, extreme = not down, value
            count += down
        extreme = min(extreme, value) if down else max(extreme, value)
    return count


def _rising(values):
    """(levels, number of values of each) of the nearest values that do not fall, by least squares."""
    blocks = []
    for value in values:
        blocks.append((value, 1))
        while len(blocks) > 1 and blocks[-1][0] < blocks[-2][0]:
            (after, count), (before, more) = blocks.pop(), blocks.pop()
            blocks.append(((after * count + before * more) / (count + more), count + more))
    return tuple(np.array(column) for column in zip(*blocks))


def read_target(path):
    """(strain, stress [Pa]) of a file of read_points(), whose strain goes one way but for its noise."""
    strain, stress = read_points(path)
    steps = np.diff(strain)
    if np.all(steps > 0.0) or np.all(steps < 0.0):
        return strain, stress
    sign = -1.0 if strain[-1] < strain[0] else 1.0
    strain, stress, _ = one_loading(path, sign * strain, stress)
    return sign * strain, stress


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
