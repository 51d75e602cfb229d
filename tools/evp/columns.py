# SPDX-License-Identifier: GPL-2.0-only
"""What the columns of the decks' dumps are called in pictures, and in which unit (SI)."""

import re
from typing import NamedTuple


class Column(NamedTuple):
    """text: as it stands in a picture; value of the column times factor is in unit."""

    text: str
    unit: str = ""
    factor: float = 1.0

    def label(self):
        return f"{self.text} [{self.unit}]" if self.unit else self.text


KNOWN = {
    "bonds": Column("bonds of each sphere"),
    "share_second": Column("bonds in the second regime", "% of each sphere's", 100.0),
    "share_lost": Column("bonds lost", "% of each sphere's", 100.0),
    "new_pairs": Column("new pairs of each sphere"),
    "plastic_work": Column("plastic work of each sphere", "J"),
    "plastic_strain": Column("plastic strain magnitude", "%", 100.0),
    "plastic_strain_sum": Column("accumulated plastic strain, lower bound", "%", 100.0),
    "volume_strain": Column("volume strain", "%", 100.0),
    "von_mises": Column("von Mises stress", "MPa", 1e-6),
    "triaxiality": Column("triaxiality"),
    "temperature": Column("temperature", "K"),
    "strain": Column("strain", "%", 100.0),
    "angle": Column("angle", "rad"),
    "radius": Column("radius", "mm", 1e3),
    "diameter": Column("diameter", "mm", 1e3),
    **{name: Column(name, "mm", 1e3) for name in ("x", "y", "z", "xu", "yu", "zu")},
    **{name: Column(name, "m/s") for name in ("vx", "vy", "vz")},
    **{name: Column(name, "N") for name in ("fx", "fy", "fz")},
}
LOADS = ("strain", "angle")  # of a whole body, in a dump the same for all its atoms
# Values that compute evp/state/atom has after the four of STATE where they are asked for; von_mises comes with fraction.
ON_REQUEST = {name: name for name in ("plastic_work", "plastic_strain", "plastic_strain_sum", "volume_strain", "triaxiality")}
ON_REQUEST["von_mises"] = "von_mises fraction PHI"
# Dumps without colname: the first values of compute evp/state/atom, under the IDs that the decks give it.
STATE = ("bonds", "share_second", "share_lost", "new_pairs")
_STATE_OF = re.compile(r"c_(?:pairs|state)\[([1-4])\]")


def word(name):
    """The word for a column of a dump: its name, or what c_pairs[k] of the decks stands for."""
    found = _STATE_OF.fullmatch(name)
    return STATE[int(found.group(1)) - 1] if found else name


def how_to_write(name):
    """What an input script needs for a value of compute evp/state/atom in a dump, as a sentence; empty for any other name."""
    if name not in (*STATE, *ON_REQUEST):
        return ""
    value, place = ON_REQUEST.get(name, ""), STATE.index(name) + 1 if name in STATE else len(STATE) + 1
    compute = f"compute state all evp/state/atom {value}".rstrip()
    return (f"; to write it: '{compute}', c_state[{place}] among the columns of the dump command, and "
            f"'dump_modify ID colname c_state[{place}] {name}'")


def load_text(name, value):
    """A load as a title: strain 2 %."""
    column = KNOWN[name]
    return f"{column.text} {round(column.factor * value, 5) + 0.0:.3g} {column.unit}"


def described(name, units="si"):
    """Column of a word. In units other than SI all but shares and counts are as they stand, without a unit."""
    column = KNOWN.get(name, Column(name))
    return column if units == "si" or column.unit.startswith("%") else Column(column.text)
