#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-only
"""Writes law_reference.csv and stored_reference.csv: the paper's law in 60-digit arithmetic.

Each line takes doubles (printed so that they read back exactly) and gives force, energy and
stiffness of eqs. 1, 2 and 8 for exactly these doubles. The energy is checked here against a
quadrature of the force, so that the closed form of its second regime is not taken on trust.
The second table has the energy above that at deq, up to xi_s and beyond it, down to the smallest
strains that doubles can have.
`nan` stands for a stiffness at a threshold and `0` for a regime that rounding may decide.

    python3 tests/data/make_law_reference.py        (needs mpmath; about 10 s)
"""

import math
import pathlib

from mpmath import mp, mpf

mp.dps = 60
ULPS_UNDECIDED = 8  # this near a threshold, rounding of d/deq decides on which side it falls
CONTACT_DISTANCE = 0.0102  # R_i + R_j [m], the mean of the paper's specimen; deq differs from it

# e1 m1 n1 e2 m2 n2 xi_s alpha
ROWS = [
    (80, 8, 4, 3, 8, 4, 0.005, 1.5),
    (80, 6, 3, 3, 6, 3, 0.005, 1.5),
    (80, 4, 2, 3, 4, 2, 0.005, 1.5),
    (80, 2, 1, 3, 2, 1, 0.005, 1.5),
    (80, 12, 6, 3, 12, 6, 0.005, 1.5),
    (80, 7.5, 3.2, 3, 7.5, 3.2, 0.005, 1.5),
    (80, 8, 4, 3, 6, 3, 0.02, 2.0),
    (1e-3, 12, 6, 50, 2, 1, 0.05, 1.5),
    (5e4, 7.5, 3.2, 2e3, 8, 4, 0.3, 1.5),
    (80, 2, 1, 3, 12, 6, 0.005, 1.1),
    (0, 8, 4, 3, 8, 4, 0.005, 1.5),
    (80, 8, 4, 0, 8, 4, 0.005, 1.5),
    (80, 5, 1, 3, 9, 2, 0.01, 1.5),
]
# of the table of stored energies: thresholds at tiny strains, exponents that are close
TINY_ROWS = [
    (80, 8, 4, 3, 8, 4, 1e-9, 1.5),
    (80, 12, 6, 200, 2, 1, 1e-6, 1.5),
    (80, 4.0005, 4, 3, 0.0012, 0.001, 0.005, 1.5),
]
STORED_FIELDS = "e1,m1,n1,e2,m2,n2,xi_s,d,deq,first,second"
FIELDS = "e1,m1,n1,e2,m2,n2,xi_s,d,deq,dcut,regime,force,energy,stiffness"


def eq1(d, deq, e, m, n):
    """Force of one potential."""
    return m * n * e / ((m - n) * deq) * ((deq / d) ** (m + 1) - (deq / d) ** (n + 1))


def eq2(d, deq, e, m, n):
    """One potential."""
    return e * (n / (m - n) * (d / deq) ** (-m) - m / (m - n) * (d / deq) ** (-n))


def slope(d, deq, e, m, n):
    """-dF/dd of one potential, paper 2.4."""
    return e * m * n / ((m - n) * d**2) * ((m + 1) * (deq / d) ** m - (n + 1) * (deq / d) ** n)


def law(d, deq, row):
    """Regime, force, energy without its cut, and stiffness of eq. 8."""
    one, two, xi_s = row[0:3], row[3:6], row[6]
    if abs(d - deq) <= xi_s * deq:
        return 1, eq1(d, deq, *one), eq2(d, deq, *one), slope(d, deq, *one)
    ds = (1 + xi_s if d >= deq else 1 - xi_s) * deq
    shifted, carried = d - ds + deq, eq1(ds, deq, *one)
    gained = eq2(shifted, deq, *two) - eq2(deq, deq, *two) - carried * (d - ds)
    force, energy = eq1(shifted, deq, *two) + carried, eq2(ds, deq, *one) + gained
    return 2, force, energy, slope(shifted, deq, *two)


def stored(d, deq, row):
    """Energy at d above that at deq: what the first regime holds, at most up to ds, and the rest."""
    xi_s = row[6]
    nearest = min(max(d, (1 - xi_s) * deq), (1 + xi_s) * deq)
    first = eq2(nearest, deq, *row[0:3]) - eq2(deq, deq, *row[0:3])
    return first, law(d, deq, row)[2] - eq2(deq, deq, *row[0:3]) - first


def neighbors(value, steps):
    """The doubles that lie the given numbers of ulps from value."""
    for step in steps:
        moved = value
        for _ in range(abs(step)):
            moved = math.nextafter(moved, math.inf if step > 0 else -math.inf)
        yield moved


def distances(deq, xi_s, dcut):
    """Doubles where the law is looked at."""
    ratios = [1e-3, 0.05, 0.3, 0.5, 0.7, 0.9, 0.97, 1.03, 1.1, 1.3, 1.45]
    for side in (-1, 1):
        ratios += [1 + side * t for t in (1e-12, 1e-9, 1e-6, 1e-4, 0.5 * xi_s, 0.99 * xi_s)]
        ratios += [1 + side * t * xi_s for t in (1.01, 1.5, 3)]
        yield from neighbors((1 + side * xi_s) * deq, (-2, -1, 0, 1, 2))
    yield from (r * deq for r in ratios)
    yield from neighbors(deq, (-1, 0, 1))
    yield from neighbors(dcut, (-1, 0))


def undecided(d, deq, xi_s):
    """Whether d is so near a threshold that the regime is a matter of rounding."""
    return abs(abs(d - deq) - xi_s * deq) <= ULPS_UNDECIDED * mpf(2) ** -53 * d


def check_energy(deq, row, ends):
    """Energy difference against a quadrature of the force, cut at the thresholds."""
    points = sorted({*ends, deq * (1 - row[6]), deq, deq * (1 + row[6])})
    points = [p for p in points if ends[0] <= p <= ends[1]]
    work = sum(
        mp.quad(lambda d: law(d, deq, row)[1], mp.linspace(a, b, 5))
        for a, b in zip(points, points[1:])
    )
    stored = law(ends[0], deq, row)[2] - law(ends[1], deq, row)[2]
    assert abs(work - stored) < mpf(10) ** -25 * (1 + abs(stored)), (row, work, stored)


def write(name, lines):
    """The table beside this file."""
    path = pathlib.Path(__file__).with_name(name)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{path.name}: {len(lines) - 1} lines")


def law_lines():
    """Force, energy and stiffness."""
    yield FIELDS
    for numbers in ROWS:
        row, alpha = [mpf(v) for v in numbers[:7]], numbers[7]
        dcut = alpha * CONTACT_DISTANCE
        for deq in (0.00973, 0.0117):
            if deq >= dcut:
                continue
            check_energy(mpf(deq), row, (mpf(deq) * mpf("0.8"), mpf(dcut)))
            for d in sorted(set(distances(deq, numbers[6], dcut))):
                regime, f, e, k = law(mpf(d), mpf(deq), row)
                e -= law(mpf(dcut), mpf(deq), row)[2]
                open_case = undecided(mpf(d), mpf(deq), row[6])
                inputs = [repr(float(v)) for v in (*numbers[:7], d, deq, dcut)]
                values = [mp.nstr(v, 25) for v in (f, e)]
                last = "nan" if open_case else mp.nstr(k, 25)
                yield ",".join([*inputs, "0" if open_case else str(regime), *values, last])


def stored_lines():
    """Energies above rest, at strains from the last bit of d to 45 %."""
    yield STORED_FIELDS
    for numbers in ROWS + TINY_ROWS:
        row, xi_s = [mpf(v) for v in numbers[:7]], numbers[6]
        sizes = [3e-15, 1e-13, 1e-10, 3.3e-10, 1e-8, 1e-6, 1e-4, 0.003, 0.05, 0.2499, 0.2501, 0.45]
        sizes += [t * xi_s for t in (0.5, 1 - 1e-9, 1 + 1e-9, 1 + 1e-5, 1.5)]
        for deq in (0.00973, 3.0):
            places = {(1 + side * t) * deq for t in sizes for side in (-1, 1)}
            for d in sorted({*places, *neighbors(deq, (-1, 0, 1))}):
                inputs = [repr(float(v)) for v in (*numbers[:7], d, deq)]
                values = stored(mpf(d), mpf(deq), row)
                yield ",".join([*inputs, *(mp.nstr(v, 25) for v in values)])


def main():
    """Write both tables beside this file."""
    write("law_reference.csv", list(law_lines()))
    write("stored_reference.csv", list(stored_lines()))


if __name__ == "__main__":
    main()
