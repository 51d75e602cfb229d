#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""The first picture of the README, from runs of the decks.

    doc/studies/first_look.py

A row of potentials/metals.evp is pulled, pressed and sheared, on bodies that it was not fitted to; a tension bar of a CAD program is pulled and released; a
copper ball flies onto a copper plate. Writes first_look.png and first_look.png.csv (the curves) to --out; runs that --work has are not repeated. About ten minutes on one core.
"""

import pathlib
import sys

from study import Runs, check_drawing, command_line, errors_in_one_line, store_picture, watched, write_csv
import matplotlib
from metals import METALS, targets_of
import numpy as np

from evp import calibration, curves, dump, figures, run, scenes, spheres

PART = run.DECKS / "dog_bone.stl"
NAME = "steel_304"
MATERIAL = f"{run.CHECKOUT / 'potentials' / 'metals.evp'}:{NAME}"
ENDS = {"tension": 0.2, "compression": -0.5}  # true strains of a body without grips and surface
SHEARED, SMOOTH = 4.0, 20  # shear strain; rows over which its stress is averaged
STRAIN = 0.016  # of the grips, where the bar turns
SPEED = 150.0  # of the ball [m/s]
BALL_OVER_PLATE = 0.1047  # volumes, so that the spheres of both are of one size
COLOR, PIXELS, DPI = "plastic_strain", 620, 130
BAR_VIEW, BALL_VIEW = (75.0, -75.0), (70.0, -60.0)
CUT = [[scenes.condition("y<0")]]  # what is inside


def commands(bar=2500, plate=5000, periodic=1000):
    """[(name, words)] of the runs, for so many spheres; the ball has as many per volume as the plate."""
    block = {"shape": "block", "length": 0.008, "width": 0.025, "height": 0.025}
    ball = {"shape": "region", "region": "ball.region", "length": 0.01}
    fill = [sys.executable, str(run.CHECKOUT / "tools" / "body.py"), str(PART), "--axis", "z", "--unit", "mm", "--n", str(bar), "--out", "bar.data"]
    decks = [
        ("part", "in.quasistatic", {"specimen": "bar.data", "material": MATERIAL, "strain": STRAIN, "cycles": 1, "lower": "release", "out": "part"}),
        ("periodic", "in.specimen", {"n": periodic, "seed": 2, "shape": "periodic", "length": 0.03, "out": "periodic.data"}),
        *((way, "in.uniaxial", {"specimen": "periodic.data", "material": MATERIAL, "strain": end, "out": way}) for way, end in ENDS.items()),
        ("shear", "in.shear", {"specimen": "periodic.data", "material": MATERIAL, "strain": SHEARED, "row": 0.005, "rate": 200, "dtfraction": 0.7, "out": "shear"}),
        ("plate", "in.specimen", {**block, "n": plate, "out": "plate.data"}),
        ("ball", "in.specimen", {**ball, "n": round(BALL_OVER_PLATE * plate), "out": "ball.data"}),
        ("impact", "in.impact", {"plate": "plate.data", "ball": "ball.data", "speed": SPEED, "also": run.DECKS / "frames.lmp", "frames": 50, "out": "impact"}),
    ]
    return [("bar", fill), *((name, run.deck_command(run.DECKS / deck, choices)) for name, deck, choices in decks)]


def true_curves(work):
    """{label: (true strain, true stress [MPa])} of the metal and of the runs. In shear strain/sqrt(3) and sqrt(3) stress, in means over 0.1 of strain."""
    found = {}
    for way in ENDS:
        read = curves.read_columns(work / f"{way}.csv", ("strain", "stress"))
        found[way] = np.abs(read["strain"]), np.abs(read["stress"])
    sheared = curves.read_curve(work / "shear.csv")
    strain, stress = (np.convolve(values, np.full(SMOOTH, 1.0 / SMOOTH), "valid") for values in (sheared.strain, sheared.virial))
    found["shear"] = strain / calibration.MISES, stress * calibration.MISES
    targets = targets_of(METALS[NAME])
    strain = np.linspace(0.0, SHEARED / calibration.MISES, 400)
    found = {"flow curve of the metal": (strain, targets.curve.true_stress(strain, targets.modulus)), **found}
    return {label: (a, 1e-6 * b) for label, (a, b) in found.items()}


def drawn(path, view):
    """(whole body in one color, first snapshot, last snapshot, scale, length of a pixel [m]): pictures of a dump; the latter two are cut open and colored."""
    series = dump.index([path])
    whole = scenes.spheres_of(series[0], COLOR)
    first, last = (scenes.spheres_of(snapshot, COLOR, CUT) for snapshot in (series[0], series[-1]))
    ends = [spheres.extents(one.x, one.radius, *view) for one in (whole, last)]
    cameras = spheres.cameras([ends], [view], PIXELS)
    factor = dump.described(COLOR).factor
    scale = scenes.ColorScale(0.0, factor * np.percentile(last.values, 99.5), (0.0, factor * last.values.max()))
    plain = spheres.draw(whole.x, whole.radius, 0.0 * whole.radius, scenes.plain_colors(), cameras)[0]
    return (plain, *(spheres.draw(one.x, one.radius, scale.share(factor * one.values), scale.colors(), cameras)[0] for one in (first, last)), scale, cameras[0].per_pixel)


def panels(figure, places, pictures, titles, scale, per_pixel, bar_on_the_right=False):
    """Pictures of spheres in a part of the figure, with the color bar of the last, and a bar of the length of the first."""
    axes = [figure.add_subplot(place) for place in places]
    for axis, picture, title in zip(axes, pictures, titles):
        axis.imshow(picture, interpolation="antialiased")
        axis.set_axis_off()
        axis.set_title(title)
    tall, broad = pictures[0].shape[:2]
    length = scenes.round_length(0.25 * broad * per_pixel)
    ends = np.array([0.0, length / per_pixel]) + (broad - length / per_pixel if bar_on_the_right else 0.0)
    axes[0].plot(ends, [tall, tall], color="black", linewidth=2.5, solid_capstyle="butt", clip_on=False, scalex=False, scaley=False)
    axes[0].text(ends.mean(), 0.98 * tall, scenes.length_text(length, "si"), ha="center", va="bottom")
    colors = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(scale.low, scale.high), scale.map)
    figure.colorbar(colors, ax=axes, orientation="horizontal", shrink=0.6, aspect=25, pad=0.04, extend=scale.extend, label=dump.described(COLOR).label())


def compose(work, target):
    """first_look.png and its .csv in the folder target, from the files of the runs in work."""
    rows = []
    part, _, flowed, *bar = drawn(work / "part_state.dump", BAR_VIEW)
    _, before, after, *ball = drawn(work / "impact_frames.dump", BALL_VIEW)
    with figures.plt.rc_context(figures.LOOK):
        figure = figures.plt.figure(figsize=(13.6, 4.3), dpi=DPI, layout="constrained")
        left, middle, right = figure.subfigures(1, 3, width_ratios=(1.05, 1.1, 1.2))
        axis = left.add_subplot()
        for k, (label, (strain, stress)) in enumerate(true_curves(work).items()):
            look = figures.line_style(k) if k else {"color": "black", "linewidth": 1.2}
            axis.plot(strain, stress, label=label, **look)
            rows += [(label, f"{100 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)]
        axis.set(xlim=(0.0, None), ylim=(0.0, None), xlabel="true strain", ylabel="true stress [MPa]", title="304 steel, one row of metals.evp")
        axis.legend(loc="lower right", handlelength=3.0)
        panels(middle, (211, 212), (part, flowed), ("The part: a CAD file filled with spheres", "Pulled and released, cut open: where it has flowed"), *bar)
        panels(right, (121, 122), (before, after), ("Ball and plate, cut open", f"after impact at {SPEED:g} m/s"), *ball, bar_on_the_right=True)
        figure.savefig(work / "first_look.png", dpi=DPI)
        figures.plt.close(figure)
    store_picture(work / "first_look.png", target)
    write_csv(target / "first_look.png.csv", ("curve", "true_strain_percent", "true_stress_MPa"), rows)
    return target / "first_look.png"


def main(argv=None):
    parser = command_line(__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=run.CHECKOUT / "results" / "first_look", metavar="DIR", help="where the runs are")
    parser.add_argument("--out", type=pathlib.Path, default=run.CHECKOUT / "doc" / "figures", metavar="DIR", help="where the picture goes")
    args = parser.parse_args(argv)
    with errors_in_one_line("first_look.py"):
        check_drawing()
        runs = Runs(args.work)
        (runs.folder / "ball.region").write_text("region body sphere 0.005 0 0 0.005\n", encoding="utf-8")
        for name, command in watched("first_look:", commands(), lambda job: job[0]):
            runs.keep(name, command)
        print(compose(runs.folder, args.out))


if __name__ == "__main__":
    main()
