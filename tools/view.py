#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Pictures and films of the spheres in LAMMPS dumps, and files for ParaView.

  view.py body.data                                                    the body of a data file, before any run
  view.py end_state.dump                                               the last snapshot, spheres of one color
  view.py end_state.dump --color share_second --view iso front         colored by a column, two views
  view.py end_state.dump --color plastic_strain --cut "y<0"            what is inside
  view.py run.dump --strip 5 --color volume_strain --out strip.png     snapshots beside each other
  view.py run.dump --film run.gif --color share_lost --range 0 50
  view.py run.dump --vtk run                                           run.pvd and a .vtu for each snapshot

DUMP is a text file of `dump custom` or `write_dump all custom` with x y z (or xu yu zu) and radius; OVITO reads the same
files. Columns have the names of dump_modify colname. Several dumps are one series, in the order given; without --strip and --film the
last snapshot of each is drawn. Titles are the load, where a column strain or angle is the same for all atoms or PREFIX.csv is beside
PREFIX_state.dump, else time or step. All snapshots and views of a picture have the same scale and the same colors. Units are those of the
dump (dump_modify units yes), else SI; no display is needed. Spheres are drawn by LAMMPS (build/lmp, or $EVP_LMP).
"""

import pathlib

from evp import curves, dump, scenes, spheres  # before numpy
import numpy as np
from evp.figures import short_names
from evp.report import all_or_nothing, command_line, errors_in_one_line, positive, whole
from evp.run import INTERVAL, watched
from PIL import Image

RELEASED = 0.02  # of the largest stress: less on the way back is no load
FLAT = 0.8  # thinnest side of a body over the next one, below which the camera looks onto it
STRIP = 4  # snapshots of a strip, unless told otherwise
WATCHED = 3  # more snapshots than this show progress
BROAD = 1.6  # width over height of a view, beyond which the snapshots of a strip are below each other


def view_angles(text):
    """(theta, phi) of a name or of 'THETA,PHI'; ValueError names the choices."""
    if text in spheres.VIEWS:
        return spheres.VIEWS[text]
    try:
        theta, phi = (float(word) for word in text.split(","))
        if 0.0 <= theta <= 180.0 and abs(phi) < 1e4:
            return theta, phi
    except ValueError:
        pass
    raise ValueError(f"--view {text}: give {' '.join(spheres.VIEWS)}, or THETA,PHI in degrees, THETA from 0 to 180")


def slanted(x, radius):
    """The view where none is asked for: iso, or onto the thinnest side of a flat body, where its through-holes are."""
    extents = np.ptp(np.concatenate([x - radius[:, None], x + radius[:, None]]), axis=0)
    thin, others = int(np.argmin(extents)), np.sort(extents)[1]
    return "iso" if extents[thin] > FLAT * others else ("65,-25", "iso", "30,-60")[thin]


def end_of_run(path):
    """Load at the end of a deck, of PREFIX_state.dump by the PREFIX.csv beside it, as text; '' where there is none."""
    if not path.name.endswith("_state.dump"):
        return ""
    try:
        curve = curves.read_curve(path.with_name(path.name.removesuffix("_state.dump") + ".csv"))
    except (OSError, ValueError):
        return ""
    released = len(curves.turns(curve.strain)) > 0 and abs(curve.virial[-1]) < RELEASED * abs(curve.virial).max()
    return dump.load_text("strain", curve.strain[-1]) + (", released" if released else "")


def when_of(snapshot):
    """Where a snapshot is on its way, as text: the load where the dump has it or its deck wrote it, else time, else step."""
    for name in dump.LOADS:
        load = snapshot.common(name)
        if load is not None:
            return dump.load_text(name, load)
    if snapshot.step is None:
        return f"{snapshot.count} spheres"
    load = end_of_run(snapshot.path)
    if load:
        return load
    if snapshot.time is None:
        return f"step {snapshot.step}"
    return scenes.time_text(snapshot.time) if snapshot.units == "si" else f"{snapshot.time:.4g} time units"


def names_of(snapshots, series):
    """A title for each snapshot, with its file where the series has several."""
    paths = list(dict.fromkeys(snapshot.path for snapshot in series))
    files = dict(zip(paths, short_names(paths)))
    return [f"{files[s.path]}, {when_of(s)}" if len(paths) > 1 else when_of(s) for s in snapshots]


def with_progress(snapshots):
    """The snapshots, with progress where they are many."""
    return watched("view", snapshots, str, interval=INTERVAL) if len(snapshots) > WATCHED else snapshots


class Scene:
    """What is the same in all pictures of a command: views, scale, colors."""

    def __init__(self, args, snapshots, units):
        """Reads all snapshots once."""
        self.cuts = [[scenes.condition(text) for text in group] for group in args.cut or ()]
        self.color, self.units = args.color, units
        if not args.view:
            first = self.spheres(snapshots[0])
            args.view = [slanted(first.x, first.radius)]
        views = [view_angles(text) for text in args.view]
        ends, drawn, inner, numbers = [[] for _ in views], [], [], []
        for snapshot in snapshots:
            found = self.spheres(snapshot)
            for k, angles in enumerate(views):
                ends[k].append(spheres.extents(found.x, found.radius, *angles))
            if self.color:
                drawn += [found.values.min(), found.values.max()]
                inner += scenes.bulk(found.values)
                numbers.append(np.unique(found.values)[: len(scenes.PARTS) + 1])
        self.cameras = spheres.cameras(ends, views, args.pixels)
        self.scale, self.colors, self.factor = None, scenes.plain_colors(), 1.0
        few = scenes.few_numbers(numbers) if self.color and self.color not in dump.KNOWN and not args.range else None
        if few is not None:
            self.scale = scenes.Legend(few, args.label or self.color)
        elif self.color:
            column = dump.described(self.color, units)
            self.factor = column.factor
            drawn, inner = ((column.factor * min(values), column.factor * max(values)) for values in (drawn, inner))
            low, high = args.range or scenes.limits(*inner)
            note = "" if args.range else scenes.note_of_outer(drawn, (low, high), column.unit)
            label = "\n".join(filter(None, (args.label or column.label(), note)))
            self.scale = scenes.ColorScale(low, high, drawn, label)
        if self.scale:
            self.colors = self.scale.colors()

    def spheres(self, snapshot):
        return scenes.spheres_of(snapshot, self.color, self.cuts)

    def pictures(self, snapshot):
        """One for each view."""
        found = self.spheres(snapshot)
        shares = self.scale.share(self.factor * found.values) if self.scale else 0.0 * found.radius
        return spheres.draw(found.x, found.radius, shares, self.colors, self.cameras)

    def figure(self, rows, titles, heads, note=""):
        return scenes.compose(rows, titles, heads, self.cameras[0].per_pixel, self.units, self.scale, note)


def draw_picture(args, scene, snapshots, series):
    """One PNG: a snapshot in its views, or snapshots beside or below each other."""
    names = args.captions or names_of(snapshots, series)
    if len(names) != len(snapshots):
        raise ValueError(f"--captions: {len(names)} for {len(snapshots)} snapshots: give one for each")
    drawn = [scene.pictures(snapshot) for snapshot in with_progress(snapshots)]
    views = args.view if len(args.view) > 1 else [""]
    first = scene.cameras[0]
    if len(snapshots) == 1:
        figure = scene.figure(drawn, views, [""], names[0])
    elif len(args.view) > 1 or first.width > BROAD * first.height:
        figure = scene.figure(drawn, views, names)
    else:
        figure = scene.figure([[pictures[0] for pictures in drawn]], names, [""])
    with all_or_nothing(args.out.parent) as folder:
        figure.savefig(folder / args.out.name, dpi=scenes.DPI)
    print(args.out)


def draw_film(args, scene, snapshots):
    """A film: a picture of all views for each snapshot."""
    views = args.view if len(args.view) > 1 else [""]
    hundredths = round(100 / args.rate)  # of a second, in which a GIF keeps its times
    if not 2 <= hundredths <= 65535:
        raise ValueError(f"--rate {args.rate:g}: a GIF shows 0.002 to 50 pictures per second")
    frames = [Image.fromarray(scenes.to_pixels(scene.figure([scene.pictures(snapshot)], views, [""], name))).quantize()
              for snapshot, name in zip(with_progress(snapshots), names_of(snapshots, snapshots))]
    with all_or_nothing(args.film.parent) as folder:
        frames[0].save(folder / args.film.name, save_all=True, append_images=frames[1:], duration=10 * hundredths, loop=0)
    print(f"{args.film}: {len(frames)} pictures, {100 / hundredths:.3g} per second")


def write_vtk(args, snapshots):
    """A .vtu of all columns for each snapshot and a .pvd of the series."""
    stem = args.vtk.name if args.vtk.suffix not in (".vtu", ".pvd") else args.vtk.stem
    digits, files = len(str(len(snapshots) - 1)), []
    with all_or_nothing(args.vtk.parent) as folder:
        for k, snapshot in enumerate(with_progress(snapshots)):
            table = scenes.read_table(snapshot)
            name = f"{stem}_{k:0{digits}d}.vtu"
            scenes.write_points(folder / name, scenes.places(table, snapshot), table)
            files.append((float(snapshot.step or 0) if snapshot.time is None else snapshot.time, name))
        scenes.write_series(folder / f"{stem}.pvd", files)
    print(f"{args.vtk.parent / (stem + '.pvd')}: {len(files)} snapshots")


def parser():
    """The command line."""
    top = command_line(__doc__)
    top.add_argument("dumps", nargs="+", type=pathlib.Path, metavar="DUMP")
    top.add_argument("--color", metavar="COLUMN", help="column that colors the spheres (default: one color); a few whole numbers, such as those of "
                     "parts, get a color each unless there is a --range")
    top.add_argument("--range", nargs=2, type=float, metavar=("LOW", "HIGH"), help="of the color bar, in its unit (default: all values drawn; without the "
                     "outermost half percent of a snapshot where these alone would take up half of the bar, which then names the highest)")
    top.add_argument("--label", metavar="TEXT", help="beside the colors, in place of the column's")
    top.add_argument("--view", nargs="+", metavar="VIEW",
                     help=f"{', '.join(spheres.VIEWS)}, or THETA,PHI in degrees: direction to the camera as in dump image. iso is from the right, "
                     "in front and above; front is from -y with x to the right and z up, top from +z with y up, right from +x (default: "
                     "iso, or slanted onto the flat side of a flat body)")
    top.add_argument("--cut", nargs="+", action="append", metavar="CONDITION",
                     help='leaves out spheres whose centers meet all conditions, such as "y<0" "z>0" (units of the dump); "y<0 or z>0": one of them is '
                     "enough. May be given again, which leaves out more. Not for --vtk")
    top.add_argument("--strip", nargs="?", type=whole(1), const=STRIP, metavar="N",
                     help=f"N snapshots of the series in one picture (default: {STRIP})")
    top.add_argument("--film", type=pathlib.Path, metavar="FILE", help="a film, .gif")
    top.add_argument("--rate", type=positive, default=10.0, metavar="N", help="pictures per second of the film, to the nearest that a GIF can show (default: 10)")
    top.add_argument("--vtk", type=pathlib.Path, metavar="PREFIX", help="PREFIX.pvd and PREFIX_K.vtu for ParaView, all columns as named arrays")
    top.add_argument("--out", type=pathlib.Path, metavar="PNG", help="(default: view.png where no film and no VTK is asked for)")
    top.add_argument("--pixels", type=whole(100, 6000), default=700, metavar="N", help="longest side of a view (default: 700)")
    top.add_argument("--captions", nargs="+", metavar="TEXT", help="above the pictures of a PNG, one for each snapshot, in place of load, time or step")
    top.add_argument("--unfinished", action="store_true", help="leave out a last snapshot that ends in the middle: the run goes on, or was stopped")
    return top


def check(args):
    """ValueError where choices cannot be met; before anything is read."""
    if args.out and args.out.suffix.lower() != ".png":
        raise ValueError(f"--out {args.out}: the name of a picture ends in .png")
    if args.film and args.film.suffix.lower() != ".gif":
        raise ValueError(f"--film {args.film}: the name of a film ends in .gif; other kinds: ffmpeg -i FILM.gif FILM.mp4")
    for option, path in (("--out", args.out), ("--film", args.film)):
        if path and any(path.resolve() == other.resolve() for other in args.dumps):
            raise ValueError(f"{option} {path} would be written over a dump that is read")
    if args.range and not args.range[0] < args.range[1]:
        raise ValueError(f"--range {args.range[0]:g} {args.range[1]:g}: the first must be less than the second")
    if args.range and not args.color:
        raise ValueError("--range needs --color COLUMN")


def main(argv=None):
    """Writes what is asked for; ends with one message on bad input, before anything is written."""
    args = parser().parse_args(argv)
    with errors_in_one_line("view.py"):
        check(args)
        series = dump.index(args.dumps, args.unfinished)
        units = series[0].units or "si"
        if args.film:
            draw_film(args, Scene(args, series, units), series)
        if args.vtk:
            write_vtk(args, series)
        if args.out or args.strip or not (args.film or args.vtk):
            args.out = args.out or pathlib.Path("view.png")
            shown = scenes.evenly(series, args.strip) if args.strip else list({snapshot.path: snapshot for snapshot in series}.values())
            draw_picture(args, Scene(args, shown, units), shown, series)


if __name__ == "__main__":
    main()
