# SPDX-License-Identifier: GPL-2.0-only
"""Reads curves that users bring: as testing machines and spreadsheets write them, with units, noise and repeated strains, or as tables of flow curves."""

import csv
import itertools
import math
import re

import numpy as np

from .curves import YIELD_OFFSET, CurveError, check_widths, lines_of, yield_stress
from .flow import FlowCurve, through
from .report import note

# Units in the header of a measured curve and what makes them strain [1] and stress [Pa]; '': no unit is given.
UNITS = {
    "strain": {"": 1.0, "-": 1.0, "1": 1.0, "m/m": 1.0, "mm/mm": 1.0, "in/in": 1.0, "um/um": 1.0, "%": 0.01, "percent": 0.01, "mm/m": 1e-3, "um/m": 1e-6,
               "microstrain": 1e-6},
    "stress": {"": 1.0, "Pa": 1.0, "N/m2": 1.0, "kPa": 1e3, "MPa": 1e6, "Mpa": 1e6, "MPA": 1e6, "N/mm2": 1e6, "GPa": 1e9, "kN/mm2": 1e9, "psi": 6894.757293168,
               "ksi": 6894757.293168},
}
PREFERRED = ("strain", "stress", "stress_virial", "stress_grip")  # of several columns of one quantity
NOMINAL, TRUE, PLASTIC = "nominal", "true", "plastic"  # what a file holds: nominal or true values of a loading; true stress at plastic strains
PLAIN = {"nominal", "engineering", "eng", "true", "total", "tensile", "compressive", "axial", "grip", "virial", "gauge",
         "equivalent"}  # words of a name that are no unit
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
CURVE_POINTS = 8  # of a flow curve that was measured
NEAR_YIELD = 0.7  # of the 0.2 % yield stress: at least so much has the last row of a measured curve before it
AT_REST = 0.15  # of the yield stress: so far from the line of E is the first row, at most
SLOPE = 0.45  # of E: its slope up to half the yield stress
SERRATION, SERRATIONS = 0.005, 5  # of the largest stress: a fall; so many of them are serrations


def read_points(path, kind=NOMINAL):
    """(strain, stress [Pa]) of a file of a measured curve: two columns without a header, in Pa; or those of strain and stress by their names, with
    their units, such as strain [%], Stress / MPa, strain_percent, of any number of columns.

    Columns apart by ';', tabs, commas or blanks; decimal commas with all of these but commas. kind: which values are asked for.
    CurveError names the file and what is wrong; OSError where it cannot be read.
    """
    lines, unfinished = lines_of(path)
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
    columns = [_column(path, names, quantity, kind) for quantity in UNITS]
    if unfinished and rows and (len(rows[-1]) < len(names) or "" in rows[-1] or "stress_virial" in names):  # of a run, which ends each line
        rows.pop()
        note(f"{path}: its last line has no line end and is left out: it was cut off")
    elif unfinished and rows:
        ends = [f"{names[place]} {rows[-1][place]}" for place, _ in columns]
        note(f"{path}: its last line has no line end and is taken as it stands, {', '.join(ends)}: check that no digit is missing")
    check_widths(path, rows, len(names), separator)
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


def _column(path, names, quantity, kind):
    """(place, factor to SI) of the column of the strain or stress."""
    split = [_split(name) for name in names]
    own = {PLASTIC} if kind == PLASTIC and quantity == "strain" else set()
    found = [k for k, (words, _) in enumerate(split) if {quantity, *own} <= set(words) and not any(word in QUALIFIED for word in set(words) - own)]
    unit_of = "[%]" if quantity == "strain" else "[MPa]"
    if not found:
        wanted = f"plastic strain, such as plastic_strain {unit_of}" if own else f"{quantity}, such as {quantity} {unit_of}, {'true' if kind == PLASTIC else 'nominal or true and in total'}"
        raise CurveError(f"{path}: the first line must name a column of {wanted}, got {', '.join(names)}")
    if len(found) > 1:
        preferred = next((names.index(name) for name in PREFERRED if name.startswith(quantity) and name in names), None)
        if preferred is None:
            raise CurveError(f"{path} has several columns of {quantity}: {', '.join(names[k] for k in found)}; leave one")
        found = [preferred]
    (words, unit), units = split[found[0]], UNITS[quantity]
    if not unit and ("%" in names[found[0]] or set(words) - PLAIN - {quantity, *own}):
        raise CurveError(f"{path}: column '{names[found[0]]}': its unit cannot be told: call it {quantity}, in {'1' if quantity == 'strain' else 'Pa'}, or put the unit "
                         f"behind, such as {quantity} {unit_of}")
    if unit not in units:
        raise CurveError(f"{path}: column '{names[found[0]]}': the unit '{unit}' is none of {', '.join(filter(None, units))}")
    if kind != NOMINAL and {"nominal", "engineering", "eng"} & set(words) or kind == NOMINAL and "true" in words:
        raise CurveError(f"{path}: column '{names[found[0]]}': {'nominal' if kind == NOMINAL else 'true'} values are asked for; "
                         "calibrate.py takes nominal values, with --true true ones, with --plastic true stresses; a target has nominal ones")
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


def read_table(path):
    """A file of plastic strain and true stress, whose header names both and the unit, as of read_points(). CurveError where it is no such table."""
    plastic, stress = read_points(path, PLASTIC)
    if plastic[0] != 0.0:
        raise CurveError(f"{path} begins at a plastic strain of {plastic[0]:g}: give the yield stress at 0 in its first row; if these are total "
                         "strains, take stress/E away")
    if len(plastic) < 2 or np.any(np.diff(plastic) <= 0.0):
        raise CurveError(f"{path}: plastic strains must grow from row to row, and there must be two rows or more")
    if np.any(stress <= 0.0):
        raise CurveError(f"{path}: stresses must be positive; compression is given likewise")
    return FlowCurve(plastic, stress, float(plastic[-1]))


def read_measured(path, modulus, is_true):
    """The FlowCurve through 0.2 % yield stress and points of a measured curve as of read_points(), nominal unless is_true, from rest on; strains
    are negative in compression. The points are from twice the strain of the yield stress to the largest nominal stress."""
    strain, stress = read_points(path, TRUE if is_true else NOMINAL)
    if is_true:
        strain, stress = np.expm1(strain), stress * np.exp(-strain)
    sign = math.copysign(1.0, strain[-1])
    sizes, scatter = np.abs(stress), noise_of(stress)
    end = (np.nonzero(sizes >= sizes.max() - 4.0 * scatter)[0][-1] if scatter > 0.0 else np.argmax(sizes)) + 1
    if end < 3:
        raise ValueError(f"--curve: {path}: fewer than three points up to the largest stress: give one loading, from rest on")
    strain, stress = levelled(path, *one_loading(path, sign * strain[:end], math.copysign(1.0, stress[end - 1]) * stress[:end]))
    first = yield_stress(strain, stress, modulus)
    if strain[-1] > 1.5:
        raise ValueError(f"--curve: {path} ends at a strain of {strain[-1]:g}: strains are shares, not per cent")
    if math.isfinite(first):
        if abs(stress[0] - modulus * strain[0]) > AT_REST * first and strain[0] < first / modulus + YIELD_OFFSET:
            raise ValueError(f"--curve: {path} does not begin at rest: {1e-6 * stress[0]:.4g} MPa at strain {strain[0]:.4g} in its first row, where E gives "
                             f"{1e-6 * modulus * strain[0]:.4g} MPa: shift the strains so that the straight part goes through zero")
        known = stress[strain <= first / modulus + YIELD_OFFSET]
        if known[-1] < NEAR_YIELD * first:
            raise ValueError(f"--curve: {path} has no row near the yield stress: the last one before it has {1e-6 * known[-1]:.4g} MPa, the straight line behind it meets "
                             f"the 0.2 % offset at {1e-6 * first:.4g} MPa: give rows there, or --yield and --stress")
        half = int(np.argmax(stress >= 0.5 * first))
        slope = (stress[half] - stress[0]) / (strain[half] - strain[0])
        if slope < SLOPE * modulus:
            raise ValueError(f"--curve: {path} begins with a slope of {1e-9 * slope:.4g} GPa, and E is {1e-9 * modulus:.4g} GPa, so that its yield stress would come out low: "
                             "take the compliance of the machine out of the strains, or give --yield and --stress")
    begin, end = 2.0 * (first / modulus + YIELD_OFFSET), strain[-1]
    if not (math.isfinite(first) and begin < end):
        raise ValueError(f"--curve: {path} does not reach twice the strain of its 0.2 % yield stress with E = {modulus:g} Pa; is the strain a share, not per cent?")
    places = np.geomspace(begin, end, CURVE_POINTS)
    curve = through(modulus, first, [(float(np.interp(place, strain, stress)), sign * place) for place in places])
    note(f"{path}: 0.2 % yield stress {1e-6 * first:.4g} MPa, flow curve to a plastic strain of {curve.end:.3g}")
    return curve
