# SPDX-License-Identifier: GPL-2.0-only
"""Reading the data files of a specimen (LAMMPS atom_style sphere), and measuring the packing.

python -m evp.specimen FILE ... prints the measures of each file.
"""

import argparse
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

TOUCHING = 1.001  # pairs within this times R_i + R_j count as touching: packings are jammed to 5e-4


class Specimen(NamedTuple):
    """Spheres sorted by ID: ids, types (N,) int; radius, mass (N,); x (N,3); box (3,2) bounds."""

    ids: np.ndarray
    types: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    x: np.ndarray
    box: np.ndarray


def read_data(path):
    """Specimen from a LAMMPS data file with columns id type diameter density x y z.

    Units are the file's. ValueError if the Atoms section is missing, is of another style, or does
    not hold as many lines as the header says.
    """
    with open(path, encoding="utf-8") as source:
        lines = source.read().splitlines()
    box, count, start, style = np.zeros((3, 2)), None, None, ""
    for number, line in enumerate(lines):
        body, _, comment = line.partition("#")
        words = body.split()
        if words[1:] == ["atoms"]:
            count = int(words[0])
        elif len(words) == 4 and words[2] in ("xlo", "ylo", "zlo"):
            box["xyz".index(words[2][0])] = [float(w) for w in words[:2]]
        elif words == ["Atoms"]:
            start, style = number + 2, comment.strip()
            break
    if start is None or count is None or style not in ("", "sphere"):
        raise ValueError(f"{path} has no 'Atoms # sphere' section")
    table = np.array([line.split()[:7] for line in lines[start : start + count]], dtype=float)
    if table.shape != (count, 7):
        raise ValueError(f"{path}: the Atoms section does not hold the {count} atoms of the header")
    table = table[np.argsort(table[:, 0])]
    radius = 0.5 * table[:, 2]
    mass = table[:, 3] * 4.0 / 3.0 * np.pi * radius**3
    ids, types = table[:, 0].astype(int), table[:, 1].astype(int)
    return Specimen(ids, types, radius, mass, table[:, 4:7], box)


def middle_strains(specimen, x, length=0.05):
    """Axial and mean lateral strain of the middle of a specimen that has gone to positions x (N,3), by ID.

    Displacements of the spheres that started between 0.3 and 0.7 of the length over their starting positions, by straight lines.
    """
    inside = (specimen.x[:, 0] > 0.3 * length) & (specimen.x[:, 0] < 0.7 * length)
    strains = [np.polyfit(specimen.x[inside, axis], (x - specimen.x)[inside, axis], 1)[0] for axis in range(3)]
    return strains[0], 0.5 * (strains[1] + strains[2])


class Measures(NamedTuple):
    """A packing in a cylinder along x from x = 0; distances of pairs are in units of R_i + R_j."""

    count: int
    mean_radius: float
    radius_range: tuple  # smallest and largest radius / mean radius
    solid_fraction: float  # volume of all spheres / volume of the cylinder
    touching: float  # partners per sphere within TOUCHING
    in_zone: float  # partners per sphere within the zone
    max_in_zone: int
    bonds: int  # pairs in the zone
    closest: float  # smallest pair distance
    beyond_wall: float  # how far a sphere sticks out of the cylinder at most / mean radius; negative: none does
    fabric: np.ndarray  # (3, 3) mean of u u over the bonds: 1/3 on the diagonal when isotropic

    @property
    def anisotropy(self):
        """Largest departure of the fabric's eigenvalues from 1/3, in units of 1/3."""
        return float(np.max(np.abs(3.0 * np.linalg.eigvalsh(self.fabric) - 1.0)))


def pairs_within(specimen, reach):
    """Pairs (P,2) of 0-based indices with d <= reach (R_i + R_j), and their d/(R_i + R_j)."""
    pairs = cKDTree(specimen.x).query_pairs(2.0 * reach * specimen.radius.max(), output_type="ndarray")
    i, j = pairs.T
    distance = np.linalg.norm(specimen.x[i] - specimen.x[j], axis=1)
    ratio = distance / (specimen.radius[i] + specimen.radius[j])
    near = ratio <= reach
    return pairs[near], ratio[near]


def measure(specimen, zone=1.5, length=0.05, radius=0.02):
    """Measures of the packing in the cylinder of this length and radius [m]."""
    pairs, ratio = pairs_within(specimen, max(zone, TOUCHING))
    count, mean = len(specimen.ids), float(specimen.radius.mean())
    bonds = pairs[ratio <= zone]
    partners = np.bincount(bonds.ravel(), minlength=count)
    along = specimen.x[bonds[:, 0]] - specimen.x[bonds[:, 1]]
    unit = along / np.linalg.norm(along, axis=1)[:, None]
    x, r = specimen.x, specimen.radius
    gaps = (np.hypot(x[:, 1], x[:, 2]) + r - radius, r - x[:, 0], x[:, 0] + r - length)
    return Measures(
        count=count,
        mean_radius=mean,
        radius_range=(float(r.min() / mean), float(r.max() / mean)),
        solid_fraction=float(np.sum(4.0 / 3.0 * np.pi * r**3) / (np.pi * radius**2 * length)),
        touching=2.0 * np.count_nonzero(ratio <= TOUCHING) / count,
        in_zone=2.0 * len(bonds) / count,
        max_in_zone=int(partners.max()),
        bonds=len(bonds),
        closest=float(ratio.min()) if len(ratio) else np.inf,
        beyond_wall=float(max(gap.max() for gap in gaps)) / mean,
        fabric=unit.T @ unit / max(len(bonds), 1),
    )


def report(m, zone):
    """The measures as lines of text."""
    axes = "xyz"
    return "\n".join(
        (
            f"spheres                {m.count}",
            f"mean radius            {m.mean_radius:.6g} m, from {m.radius_range[0]:.4f} to {m.radius_range[1]:.4f} of it",
            f"solid fraction         {m.solid_fraction:.4f}",
            f"touching (d <= {TOUCHING})  {m.touching:.3f} per sphere",
            f"in the zone (d <= {zone:g})  {m.in_zone:.3f} per sphere, at most {m.max_in_zone}; {m.bonds} bonds",
            f"closest pair           {m.closest:.5f} (R_i + R_j)",
            f"beyond the wall        {m.beyond_wall:.5f} mean radii at most",
            "fabric of the zone     "
            + " ".join(f"{axes[a]}{axes[b]} {m.fabric[a, b]:.4f}" for a in range(3) for b in range(a, 3))
            + f"; eigenvalues within {100 * m.anisotropy:.1f} % of 1/3",
        )
    )


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m evp.specimen", description="Measure packings in a cylinder along x.")
    parser.add_argument("files", nargs="+", metavar="FILE", help="LAMMPS data file of atom_style sphere, SI")
    parser.add_argument("--zone", type=float, default=1.5, help="pairs within ZONE (R_i + R_j) are bonds (1.5)")
    parser.add_argument("--length", type=float, default=0.05, help="of the cylinder, from x = 0 [m] (0.05)")
    parser.add_argument("--radius", type=float, default=0.02, help="of the cylinder, about the x axis [m] (0.02)")
    options = parser.parse_args(arguments)
    for path in options.files:
        try:
            specimen = read_data(path)
        except (OSError, ValueError) as error:
            parser.error(str(error))
        print(path)
        print(report(measure(specimen, options.zone, options.length, options.radius), options.zone))


if __name__ == "__main__":
    main()
