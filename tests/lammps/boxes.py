# SPDX-License-Identifier: GPL-2.0-only
"""Boxes and decompositions over MPI ranks, for tests whose result must not depend on them.

A case holds what lattice_body() and head() are given, more lines of the deck, and the tilt of the box."""


def open_box(lines="", **options):
    return dict(body={}, lines=lines, options=options)


def periodic_box(periodic, tilt=None, **options):
    cells = (5, 4, 4)
    boundary = " ".join("p" if axis in periodic else "f" for axis in "xyz")
    return dict(body=dict(cells=cells, periodic=periodic, tilt=tilt or (0.0, 0.0, 0.0)), lines="",
                options=dict(boundary=boundary, **options), tilt=tilt)


BOXES = {
    "slabs along z": open_box(before="processors 1 1 *"),
    "slabs along x, thinner than dlim": open_box(before="processors * 1 1"),
    "balance": open_box("balance 1.0 shift xyz 10 1.01\n"),
    "fix balance": open_box("fix even all balance 10 1.0 shift x 10 1.01\n"),
    "fix balance rcb": open_box("comm_style tiled\nfix even all balance 10 1.0 rcb\n"),
    "sorted often": open_box(sort="sort 3 0.03"),
    "never sorted": open_box(sort="sort 0 0"),
    "shrink-wrapped": open_box(boundary="s m s"),
    "all pairs tried": open_box("neighbor 0.0008 nsq\n"),
    "bins by type": open_box("neighbor 0.0008 multi\ncomm_modify mode multi\n"),
    "large skin": open_box("neighbor 0.003 bin\nneigh_modify every 5 delay 0 check yes one 4000\n"),
    "periodic x": periodic_box("x"),
    "periodic y, newton off": periodic_box("y", newton="off"),
    "periodic z": periodic_box("z"),
    "periodic": periodic_box("xyz", newton="off"),
    "periodic, tiled": periodic_box("xyz", before="comm_style tiled"),
    "triclinic": periodic_box("xyz", tilt=(0.012, -0.008, 0.015)),
    "triclinic, newton off": periodic_box("xyz", tilt=(0.02, 0.005, -0.01), newton="off"),
}
