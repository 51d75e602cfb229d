# SPDX-License-Identifier: GPL-2.0-only
"""tools/view.py: spheres are where the projection puts them, snapshots and misuse; files for others are read by others; the commands of 'Look at a
result' in doc/Howto_evp.rst, and the picture beside them."""

import base64
import os
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import inputs
import matplotlib.colors
import matplotlib.image
import numpy as np
import pytest
import study
import view as tool
from evp import dump, run, scenes, specimen, spheres
from PIL import Image

BODY = run.CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
RED, GREEN, BLUE = np.eye(3)
WORDS = "id type x y z radius vx bonds share_second share_lost new_pairs plastic_work plastic_strain volume_strain strain"


def show(*words):
    return inputs.call(tool.main, *words)


def shown(*words):
    """What it prints; it must do well."""
    done = show(*words)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def some_spheres():
    """Rows x y z radius, apart from each other, sizes of 1 to 2 mm in a body of 4 cm."""
    random = np.random.default_rng(1)
    return np.column_stack([random.uniform(-0.02, 0.02, (20, 3)), random.uniform(1e-3, 2e-3, 20)])


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def one(tmp_path):
    """A dump of one snapshot, IDs not in order."""
    rows = [(20 - k, *row, k / 20) for k, row in enumerate(some_spheres())]
    (tmp_path / "one.dump").write_text(inputs.snapshot("id x y z radius share_second", rows), encoding="utf-8")
    return "one.dump"


@pytest.fixture(scope="module")
def pulled(tmp_path_factory):
    """A folder with pull_frames.dump, by a short run of the traction deck with frames."""
    folder = tmp_path_factory.mktemp("pulled")
    variables = {"specimen": BODY, "rate": 100, "strain": 0.005, "out": "pull", "also": run.DECKS / "frames.lmp", "frames": 5}
    study.output_of(run.deck_command(run.DECKS / "in.traction", variables), folder, "in.traction")
    return folder


# ---- where spheres are ----


def shades(*colors):
    """Colors of a map with these at equal distances."""
    return np.stack([np.interp(np.linspace(0, 1, spheres.SHADES), np.linspace(0, 1, len(colors)), part) for part in np.array(colors).T], axis=1)


def blob(picture, color):
    """(column, row, pixels) of what has the hue of this color: middle and size."""
    rows, cols = np.nonzero((np.ptp(picture.astype(float), axis=2) > 20) & (picture.argmax(axis=2) == np.argmax(color)))
    return cols.mean() + 0.5, rows.mean() + 0.5, len(rows)


# To the right and up in each view, for a body whose axis is x.
PLANES = {"front": ((1, 0, 0), (0, 0, 1)), "back": ((-1, 0, 0), (0, 0, 1)), "right": ((0, 1, 0), (0, 0, 1)), "left": ((0, -1, 0), (0, 0, 1)),
          "top": ((1, 0, 0), (0, 1, 0)), "bottom": ((1, 0, 0), (0, -1, 0))}
THREE = np.array([[0.3, 0.1, 0.2], [-0.4, -0.3, 0.1], [0.1, 0.4, -0.5]]), np.array([0.05, 0.08, 0.1])


@pytest.mark.parametrize("unit, shift", [(1.0, 0.0), (1e-6, 7.0), (1e3, 7.0)])
def test_spheres_are_where_the_projection_puts_them(unit, shift):
    """Three spheres in all six views, and in a slanted one by the angles of the manual of dump image: middle within 0.7 of a pixel,
    area within 3 percent; whatever the unit of length, and wherever the body is."""
    x, radius = unit * (THREE[0] + shift), unit * THREE[1]
    a, b = np.radians((65.0, -60.0))
    flat = {**{name: np.array(plane, dtype=float) for name, plane in PLANES.items()},
            "iso": np.array([[-np.sin(b), np.cos(b), 0], [-np.cos(a) * np.cos(b), -np.cos(a) * np.sin(b), np.sin(a)]])}
    views = [spheres.VIEWS[name] for name in flat]
    cameras = spheres.cameras([spheres.extents(x, radius, *angles) for angles in views], views, 400)
    drawn = spheres.draw(x, radius, np.array([0.0, 0.5, 1.0]), shades(RED, GREEN, BLUE), cameras)
    for (name, plane), camera, picture in zip(flat.items(), cameras, drawn):
        assert picture.shape == (camera.height, camera.width, 3) and max(picture.shape) <= 402
        found = np.array([blob(picture, color) for color in (RED, GREEN, BLUE)])
        expected = (x - x[0]) @ plane.T / camera.per_pixel * (1, -1)
        assert found[:, :2] - found[0, :2] == pytest.approx(expected, abs=1.4), name
        middle = (x @ spheres.axes(camera.theta, camera.phi)[:2].T - camera.middle) / camera.per_pixel * (1, -1) + (0.5 * camera.width, 0.5 * camera.height)
        assert found[:, :2] == pytest.approx(middle, abs=0.9), name
        assert found[:, 2] == pytest.approx(np.pi * (radius / camera.per_pixel) ** 2, rel=0.03), name


def test_a_long_rod_is_whole_from_its_end():
    """The camera of LAMMPS would stand inside of it. The last sphere hides all others."""
    x, radius, angles = np.array([[k, 0.0, 0.1 * (k == 8)] for k in range(9)]), np.full(9, 0.5), spheres.VIEWS["right"]
    (camera,) = spheres.cameras([spheres.extents(x, radius, *angles)], [angles], 200)
    (picture,) = spheres.draw(x, radius, (x[:, 0] == 8).astype(float), shades(RED, BLUE), [camera])
    assert blob(picture, BLUE)[2] == pytest.approx(np.pi * (0.5 / camera.per_pixel) ** 2, rel=0.05)


def test_scale_bar_and_pictures_of_a_figure():
    """The pictures are in the PNG pixel by pixel; the bar is as long as its text says."""
    pictures = [[np.full((200, 300, 3), 90, dtype=np.uint8), np.full((120, 300, 3), 150, dtype=np.uint8)]]
    scale = scenes.ColorScale(0.0, 1.0, (0.0, 2.0))
    pixels = scenes.to_pixels(scenes.compose(pictures, ["a", "b"], [""], 1e-4, "si", scale))  # 0.1 mm per pixel
    gray = np.all(pixels == pixels[:, :, :1], axis=2)
    assert np.sum(gray & (pixels[:, :, 0] == 90)) >= 60000 and np.sum(gray & (pixels[:, :, 0] == 150)) >= 36000
    line = max((np.all(row < 60, axis=1).sum() for row in pixels[-60:]), default=0)
    assert scenes.round_length(0.35 * 300 * 1e-4) == pytest.approx(0.01) and line == pytest.approx(100, abs=2)
    assert scale.extend == "max"


@pytest.mark.parametrize("found, text", [
    *((scenes.length_text(length, units), text) for length, units, text in
      ((0.02, "si", "20 mm"), (5e-6, "si", "5 \u00b5m"), (2e3, "si", "2 km"), (2.0, "lj", "2 length units (lj)"))),
    *((scenes.time_text(time), text) for time, text in ((0.0, "0 s"), (3.7e-5, "37 \u00b5s"), (1e-3, "1 ms"), (2.5, "2.5 s"), (1e-12, "1 ps"))),
    (dump.described("plastic_work").label(), "plastic work of each sphere [J]"), (dump.described("plastic_work", "lj").label(), "plastic work of each sphere"),
    (dump.described("mine").label(), "mine")])
def test_numbers_and_columns_have_words_and_units(found, text):
    assert found == text


def test_limits_of_the_colors():
    """Without single spheres that would stretch them; the same on both sides of zero."""
    values = np.append(np.linspace(0.0, 2.0, 999), 250.0)
    shown = scenes.bulk(values)
    assert 1.9 < shown[1] < 2.0 and scenes.note_of_outer((0.0, 250.0), (0.0, shown[1]), "%") == "highest 250 %"
    assert scenes.bulk(values[:-1]) == (0.0, 2.0) and scenes.note_of_outer((0.0, 2.0), (0.0, 2.0)) == ""
    assert scenes.bulk(np.append(np.zeros(999), 1.0)) == (0.0, 1.0), "what is all the same leaves no bar"
    assert scenes.limits(0.1, 3.0) == (0.1, 3.0) and scenes.limits(-1.0, 3.0) == (-3.0, 3.0)
    assert scenes.ColorScale(2.0, 2.0, (2.0, 2.0)).share(np.array([2.0])) == [0.5], "all values the same"
    assert np.array_equal(scenes.ColorScale(0, 4, (0, 8)).share(np.array([-1.0, 2.0, 8.0])), [0.0, 0.5, 1.0])


# ---- the command ----


def test_picture_of_a_dump(one, tmp_path):
    """A column colors; what is cut is gone; rows are sorted by ID, and radius and value of each sphere are those of its row."""
    pictures = {}
    for name, words in (("plain", ()), ("cut", ("--cut", "x>0")), ("colored", ("--color", "share_second"))):
        shown(one, "--view", "front", "--pixels", 300, "--out", f"{name}.png", *words)
        pictures[name] = matplotlib.image.imread(tmp_path / f"{name}.png")[:, :, :3]
    hues = {name: len(np.unique((picture[picture.std(axis=2) > 0.1] * 8).astype(int), axis=0)) for name, picture in pictures.items()}
    assert hues["colored"] > 3 * hues["plain"]
    assert pictures["cut"].shape != pictures["plain"].shape, "what is left fills the picture"
    expected = some_spheres()[::-1]
    x, z, values = expected[:, 0], expected[:, 2], np.arange(19, -1, -1) / 20
    assert dump.last_positions(tmp_path / one) == pytest.approx(expected[:, :3], rel=1e-8)
    cuts = [[scenes.condition(text) for text in group] for group in (("x>0", "z>0"), ("x<-0.01",))]
    either = [[scenes.condition("x>0 or z>0"), scenes.condition("share_second > 0.5")]]
    for groups, kept in (((), x < 1), (cuts, ~((x > 0) & (z > 0)) & (x >= -0.01)), (either, ~(((x > 0) | (z > 0)) & (values > 0.5)))):
        found = scenes.spheres_of(dump.index([one])[0], "share_second", groups)
        assert found.x == pytest.approx(expected[kept, :3], rel=1e-8) and found.radius == pytest.approx(expected[kept, 3], rel=1e-8)
        assert found.values == pytest.approx(values[kept])
    shown(BODY, BODY, "--pixels", 120, "--out", "body.png")  # of a data file
    titled = tmp_path / "titled.data"  # LAMMPS ignores the first line, and comments
    titled.write_text("9 atoms of a layer\n# 0 3 xlo xhi\n" + BODY.read_text(encoding="utf-8").partition("\n")[2], encoding="utf-8")
    assert len(specimen.read_data(titled).ids) == 500
    own, read = specimen.read_data(BODY), scenes.spheres_of(dump.index([BODY])[0])
    assert np.array_equal(read.x, own.x) and np.array_equal(read.radius, own.radius) and tool.when_of(dump.index([BODY])[0]) == "500 spheres"


def test_a_few_whole_numbers_get_a_color_each(tmp_path):
    """Two parts of a body in two colors and a legend; not what is known as a quantity, what is asked for with a range, and what has more or other numbers."""
    body = [(k, x, 0.0, 0.0, 0.01) for k, x in enumerate((-0.03, -0.01, 0.01, 0.03))]
    columns = {"part": (1, 1, 2, 2), "half": (1, 1, 1.5, 2), "new_pairs": (1, 1, 2, 2)}
    (tmp_path / "two.dump").write_text(inputs.snapshot(f"id x y z radius {' '.join(columns)}", [(*row, *more) for row, more in zip(body, zip(*columns.values()))]), encoding="utf-8")

    def scale(*words):
        args = tool.parser().parse_args(["two.dump", *words])
        return tool.Scene(args, dump.index(args.dumps), "si").scale

    found = scale("--color", "part")
    assert found.label == "part" and found.entries() == [("1", scenes.PARTS[0]), ("2", scenes.PARTS[1])]
    shades = found.colors()[np.round(found.share(np.array([1.0, 2.0])) * (spheres.SHADES - 1)).astype(int)]
    assert np.array_equal(shades, [matplotlib.colors.to_rgb(color) for color in scenes.PARTS[:2]])
    assert all(isinstance(scale("--color", *words), scenes.ColorScale) for words in (("half",), ("new_pairs",), ("part", "--range", "0", "3")))
    assert scenes.few_numbers([np.arange(9.0)]) is None and list(scenes.few_numbers([np.array([3.0]), np.array([1.0])])) == [1.0, 3.0]
    shown("two.dump", "--color", "part", "--view", "front", "--pixels", 300, "--out", "two.png")
    picture = (255 * matplotlib.image.imread(tmp_path / "two.png")[:, :, :3]).round()
    middles = [picture[:, left : left + 10] for left in (55, 230)]  # of spheres
    assert all((part[:, :, 2] > part[:, :, 0]).any() == is_blue for part, is_blue in zip(middles, (True, False)))
    legend = picture[:, 340:]
    assert all((np.abs(legend - 255 * np.array(matplotlib.colors.to_rgb(color))).max(axis=2) < 2).sum() > 50 for color in scenes.PARTS[:2])


@pytest.mark.parametrize("thin", range(3))
def test_a_hole_through_a_plate_is_seen(thin):
    """Without --view, whichever way the plate lies: a line of sight through the middle of a hole of radius 6 stays in it to both faces."""
    half = np.insert([12.0, 12.0], thin, 3.0)
    x = half * (2.0 * np.indices((2, 2, 2)).reshape(3, 8).T - 1.0)
    theta, phi = np.radians(tool.view_angles(tool.slanted(x, np.full(8, 0.75))))
    sight = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    aside = 3.75 * np.linalg.norm(np.delete(sight, thin)) / abs(sight[thin])
    assert 1.0 < aside < 6.0 - 0.75, "slanted, but not too much"


EACH = np.linspace(0, 1, 20)
CURVE = "strain,stress_grip,stress_virial\n0,0,0\n0.02,2e8,2e8\n{0},{1},{1}\n"


@pytest.mark.parametrize("name, values, head, curve, titles", [
    ("strain", (0.0, -0.0123), "", None, ["strain 0 %", "strain -1.23 %"]), ("strain", (1e-12, 0.5), "", None, ["strain 0 %", "strain 50 %"]),
    ("angle", (0.002, 0.1), "", None, ["angle 0.002 rad", "angle 0.1 rad"]), ("length", (0.1, 0.2), "ITEM: TIME\n0.25", None, ["0.25 time units"] * 2),
    ("strain", (EACH, EACH), "ITEM: TIME\n0.25", None, ["0.25 time units"] * 2), ("length", (0.1,), "", None, ["step 7"]),
    *(("length", (0.1,), "", end, [title]) for end, title in
      (((0.03, 3e8), "strain 3 %"), ((0.0131, 1e5), "strain 1.31 %, released"), ((0.019, 1e8), "strain 1.9 %")))])
def test_titles_of_snapshots(tmp_path, name, values, head, curve, titles):
    """By the load of the body, not by a column that each atom has a value of its own in; by the end of the curve that the deck wrote beside it."""
    rows = [[(k + 1, *row, value if np.isscalar(value) else value[k]) for k, row in enumerate(some_spheres())] for value in values]
    text = "".join(inputs.snapshot(f"id x y z radius {name}", table, 7, head) for table in rows)
    (tmp_path / "pull_state.dump").write_text(text, encoding="utf-8")
    if curve:
        (tmp_path / "pull.csv").write_text(CURVE.format(*curve), encoding="utf-8")
    series = dump.index([tmp_path / "pull_state.dump"])
    assert tool.names_of(series, series) == titles


def test_frames_of_a_run(pulled, tmp_path):
    """`frames` and the first, at equal times to the end; names are words; strip, views and film take as many as they are told."""
    series = dump.index([pulled / "pull_frames.dump"])
    assert [s.time for s in series] == pytest.approx(5e-5 * np.arange(6) / 5, abs=1e-7)
    assert all(s.names == tuple(WORDS.split()) and s.units == "si" and s.count == 500 for s in series)
    assert tool.names_of(series, series) == [f"strain {k / 10:g} %" for k in range(6)]
    assert tool.names_of(series[:1], [*dump.index([BODY]), *series]) == ["pull_frames, strain 0 %"], "of several files"
    assert [s.time for s in scenes.evenly(series, 3)] == [series[k].time for k in (0, 2, 5)] and scenes.evenly(series, 1) == series[-1:]
    for words in (("--strip", 3), ("--strip", 6, "--view", "front", "right", "--cut", "y<0")):
        assert shown(pulled / "pull_frames.dump", "--color", "share_second", *words, "--pixels", 120, "--out", "strip.png") == "strip.png"
    assert matplotlib.image.imread(tmp_path / "strip.png").shape[0] > 6 * 100, "six rows"
    shown(pulled / "pull_frames.dump", "--film", "film.gif", "--pixels", 120)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 6 and film.info["duration"] == 100
        first = np.asarray(film.convert("RGB")).astype(int)
        assert np.all(first[:10] == 255), "the page is white"
        film.seek(5)
        assert np.abs(np.asarray(film.convert("RGB")).astype(int) - first).max() > 50, "it moves"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.gif", "strip.png"]


def test_dumps_of_diameters_and_in_other_units(tmp_path):
    rows = [(k + 1, *row[:3], 0.004) for k, row in enumerate(some_spheres())]
    text = inputs.snapshot("id xu yu zu diameter", rows, head="ITEM: UNITS\nlj") + inputs.snapshot("id xu yu zu diameter", rows, step=5)
    (tmp_path / "lj.dump").write_text(text, encoding="utf-8")
    series = dump.index(["lj.dump"])
    assert [s.units for s in series] == ["lj", "lj"], "LAMMPS writes them once"
    shown("lj.dump", "--out", "lj.png", "--pixels", 200)
    found = scenes.spheres_of(series[1])
    assert np.all(found.radius == 0.002) and found.x == pytest.approx(some_spheres()[:, :3], rel=1e-8)


# ---- for others ----


def read_vtu(path):
    """(points, {name: array}) by a second reading of the format: base64 of a count of bytes and the bytes."""
    kinds, root, arrays = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}, ElementTree.parse(path).getroot(), {}
    assert root.attrib["type"] == "UnstructuredGrid" and root.attrib["header_type"] == "UInt64"
    for element in root.iter("DataArray"):
        content = base64.b64decode(element.text)
        assert int.from_bytes(content[:8], "little") == len(content) - 8
        values = np.frombuffer(content[8:], dtype=kinds[element.attrib["type"]])
        arrays[element.attrib["Name"]] = values.reshape(-1, int(element.attrib.get("NumberOfComponents", 1))).squeeze()
    piece, number = next(root.iter("Piece")), np.arange(len(arrays["Points"]))
    assert int(piece.attrib["NumberOfPoints"]) == int(piece.attrib["NumberOfCells"]) == len(number) and np.all(arrays.pop("types") == 1)
    assert np.array_equal(arrays.pop("connectivity"), number) and np.array_equal(arrays.pop("offsets"), 1 + number)
    return arrays.pop("Points"), arrays


def test_others_read_the_numbers_of_the_dump(pulled, tmp_path):
    """VTK; and ASE reads the dump as OVITO does, by the names of its columns: as many snapshots, atoms, places and types."""
    shown(pulled / "pull_frames.dump", "--vtk", tmp_path / "vtk" / "pull")
    sets = list(ElementTree.parse(tmp_path / "vtk" / "pull.pvd").getroot().iter("DataSet"))
    series = dump.index([pulled / "pull_frames.dump"])
    assert [float(one.attrib["timestep"]) for one in sets] == [s.time for s in series] and not (tmp_path / "view.png").exists()
    assert sorted(path.name for path in (tmp_path / "vtk").iterdir()) == sorted(["pull.pvd", *(one.attrib["file"] for one in sets)])
    atoms = pytest.importorskip("ase.io").read(pulled / "pull_frames.dump", index=":", format="lammps-dump-text")
    assert len(atoms) == len(sets) == 6
    for one, snapshot, found in zip(sets, series, atoms):
        points, arrays = read_vtu(tmp_path / "vtk" / one.attrib["file"])
        table = np.array([line.split() for line in snapshot.path.read_bytes()[snapshot.start : snapshot.end].splitlines()], dtype=float)  # sorted by ID
        assert list(arrays) == WORDS.split() and arrays["id"].dtype == np.int64
        assert all(np.array_equal(arrays[name], table[:, k]) for k, name in enumerate(WORDS.split()))
        assert np.array_equal(points, table[:, 2:5]) and np.array_equal(found.positions, points) and np.array_equal(found.numbers, table[:, 1])
    text = inputs.snapshot("id x y z radius c_stress[1]", [(2, 0, 0, 1, 0.5, 7), (1, 1, 0, 0, 0.5, 8)])
    (tmp_path / "v.dump").write_text(text, encoding="utf-8")
    shown("v.dump", "--vtk", "v.vtu")
    _, arrays = read_vtu("v_0.vtu")
    assert np.array_equal(arrays["c_stress_1"], [8, 7])


# ---- misuse ----

ROWS = "id x y z radius"
GOOD = inputs.snapshot(ROWS, [(1, 0, 0, 0, 0.5), (2, 1, 0, 0, 0.5)])
BAD_DUMPS = {
    "empty": ("", "is empty: no snapshot has been written"),
    "binary": ("ITEM:\0\1\2", "is no text dump of LAMMPS"),
    "other": ("strain,stress\n0,0\n", "is no text dump of LAMMPS: its first line is not 'ITEM: ...'"),
    "cut in a row": (GOOD + GOOD[:-8], "ends in the middle of a snapshot, after that of step 0.*--unfinished"),
    "cut in the bounds": (GOOD + "ITEM: TIMESTEP\n9\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ss ss ss\n0 1\n0", "ends in the middle"),
    "cut at once": (GOOD[:-8], "ends before its first whole snapshot"),
    "rows missing": (GOOD.replace("ATOMS\n2", "ATOMS\n3") + GOOD, "is no dump of LAMMPS|ends"),
    "pairs": (GOOD.replace("NUMBER OF ATOMS", "NUMBER OF ENTRIES").replace("ITEM: ATOMS", "ITEM: ENTRIES"), r"dump of pairs \(dump local\)"),
    "short row": (GOOD.replace("2 1 0 0 0.5", "2 1 0 0"), "a row has not 5 words"),
    "no count": ("ITEM: TIMESTEP\n0\nITEM: ATOMS id x\n", "lacks TIMESTEP, NUMBER OF ATOMS"),
    "data file": ("\n".join(BODY.read_text(encoding="utf-8").splitlines()[:300]), "does not hold the 500 atoms of the header"),
    "no atoms": (inputs.snapshot(ROWS, []), "has no atoms"),
    "no radius": (inputs.snapshot("id x y z mass", [(1, 0, 0, 0, 1)]), "has no column radius; it has id x y z mass: add radius to the dump command"),
    "no place": (inputs.snapshot("id xs ys zs radius", [(1, 0, 0, 0, 1)]), "has no column x; it has id xs ys zs radius"),
    "not finite": (GOOD.replace("2 1 0", "2 nan 0"), "position or radius that is not finite"),
    "no size": (GOOD.replace("0 0.5", "0 0"), "radius that is not positive: 0"),
}


def refused(folder, *words, option=False):
    """The message of a refusal, which left the folder as it was. option: by the parser of options, below its usage."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    failed = show(*words)
    message = failed.stderr.splitlines()[-1] if option else failed.stderr.rstrip("\n")
    assert failed.returncode == 1 + option and re.fullmatch("view.py: error: .*" if not option else r"\S+: error: argument .*", message), failed.stderr
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return failed.stderr


@pytest.mark.parametrize("name", BAD_DUMPS)
def test_bad_dumps_are_refused_by_name(tmp_path, name):
    text, rule = BAD_DUMPS[name]
    (tmp_path / "bad.dump").write_text(text, encoding="utf-8")
    (tmp_path / "good.dump").write_text(GOOD, encoding="utf-8")
    for output in (("--out", "a.png", "--strip", 9), ("--vtk", "a"), ("--film", "a.gif")):
        message = refused(tmp_path, "good.dump", "bad.dump", *output)
        assert "bad.dump" in message and re.search(rule, message), message


BAD_CHOICES = {
    "--color heat": "one.dump, step 0 has no column heat; it has id x y z radius share_second",
    "--color plastic_strain": "to write it: 'compute state all evp/state/atom plastic_strain', c_state[5] among the columns of the dump command, and 'dump_modify ID "
    "colname c_state[5] plastic_strain'",
    "--cut share_lost>0": "'compute state all evp/state/atom', c_state[3] among",
    "--cut y=0": "--cut 'y=0' is no condition: give COLUMN>NUMBER or COLUMN<NUMBER",
    "--cut y<0orz<0": "--cut 'y<0orz<0' is no condition: give COLUMN>NUMBER or COLUMN<NUMBER, such as \"y>0\", or several with the word or between them",
    "--cut y>-9": "--cut leaves no sphere",
    "--view above": "--view above: give iso front back right left top bottom, or THETA,PHI",
    "--view 190,0": "--view 190,0: give",
    "--captions a b": "--captions: 2 for 1 snapshots: give one for each",
    "--range 1 0 --color share_second": "--range 1 0: the first must be less",
    "--range 0 1": "--range needs --color",
    "--out one.dump": "--out one.dump: the name of a picture ends in .png",
    "--film one.avi": "--film one.avi: the name of a film ends in .gif",
    "--film one.gif --rate 1000": "--rate 1000: a GIF shows 0.002 to 50 pictures per second",
    "--pixels 9": "argument --pixels: give a whole number from 100 to 6000, got 9",
    "--strip -1": "argument --strip: give a whole number of 1 or more, got -1",
    "absent.dump": "view.py: error: there is no file absent.dump\n",
    ".": "cannot use .: Is a directory",
    "--out a.png": "no program /no/such/lmp: run tools/setup.sh first, or set EVP_LMP",
}


@pytest.mark.parametrize("words", BAD_CHOICES)
def test_bad_choices_are_refused(one, tmp_path, monkeypatch, words):
    """Where there is no LAMMPS."""
    monkeypatch.setenv("EVP_LMP", "/no/such/lmp")
    assert BAD_CHOICES[words] in refused(tmp_path, "one.dump", *words.split(), option=BAD_CHOICES[words].startswith("argument "))


def test_what_the_refusal_of_a_column_says_to_write(tmp_path):
    """The lines of the message, in a deck: the column is there."""
    script = f"units si\natom_style sphere\nread_data {BODY}\npair_style evp/lj\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\nfix 1 all evp/bonds\n"
    script += "fix volume all evp/volume 0\n"
    for name in (*dump.STATE, *dump.ON_REQUEST):
        compute, modify = re.findall("'(.*?)'", dump.how_to_write(name))
        place = re.search(r"c_state\[\d\]", modify)[0]
        script += f"{compute}\ndump ID all custom 1 {name}.dump id x y z radius {place}\n{modify}\nrun 0\nundump ID\nuncompute state\n".replace("PHI", "0.6")
    (tmp_path / "in.lmp").write_text(script, encoding="utf-8")
    study.output_of([*run.lammps_command(), "-log", "none", "-in", "in.lmp"], tmp_path, "columns")
    for name in (*dump.STATE, *dump.ON_REQUEST):
        assert dump.index([tmp_path / f"{name}.dump"])[-1].names[-1] == name


def test_a_lammps_without_graphics(one, tmp_path, monkeypatch):
    """As an lmp of 11 Feb 2026 or later without that package answers: the remedy is named, and commands that draw after runs learn it before.
    Its other errors are passed on."""
    study.check_drawing()
    monkeypatch.setattr(spheres, "_script", lambda *_: "no_such_command\n")
    assert "LAMMPS could not draw the spheres: ERROR: Unknown command: no_such_command" in refused(tmp_path, "one.dump")
    said = "ERROR: Unrecognized dump style 'image' is part of the GRAPHICS package which is not enabled in this LAMMPS binary."
    monkeypatch.setenv("EVP_LMP", str(inputs.program(tmp_path / "lmp", f'echo "{said}"\nexit 1')))
    text = refused(tmp_path, "one.dump")
    assert f"{tmp_path / 'lmp'} was built without the package GRAPHICS" in text and "-DPKG_GRAPHICS=on" in text and said in text, text
    with pytest.raises(run.RunError, match="-DPKG_GRAPHICS=on"):
        study.check_drawing()


def test_a_run_that_goes_on(tmp_path):
    (tmp_path / "run.dump").write_text(GOOD + GOOD.replace("STEP\n0", "STEP\n5") + GOOD[:-5], encoding="utf-8")
    assert "after that of step 5" in refused(tmp_path, "run.dump") and shown("run.dump", "--unfinished", "--vtk", "whole") == "whole.pvd: 2 snapshots"


SECTION = (run.CHECKOUT / "doc" / "Howto_evp.rst").read_text(encoding="utf-8").partition("**Look at a result**")[2].partition("References\n")[0]
COMMANDS = re.search(r"code-block:: bash\n\n((?:   .*\n)+)", SECTION)[1].replace("\n   ", "\n").strip().splitlines()
WRITTEN = ("torn.png", "torn_end.png", "torn.gif", "torn.pvd", "torn_table.csv")


def test_commands_of_the_page(tmp_path):
    """From the checkout's root: each file is written, the body is torn, and the picture of the page is that of its command."""
    assert [words.split()[0] for words in COMMANDS] == ["lmp"] + 4 * ["tools/view.py"] + ["tools/curves.py"]
    for name in ("lammps_inputs", "tests", "tools"):
        (tmp_path / name).symlink_to(run.CHECKOUT / name)
    script = "\n".join(["set -e", f"lmp() {{ {run.lammps_command()[0]} \"$@\"; }}", *COMMANDS])
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env={**os.environ, **run.environment()}, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert all((tmp_path / name).stat().st_size > 100 for name in WRITTEN)
    series = dump.index([tmp_path / "torn_frames.dump"])
    assert len(series) == 11 and series[-1].read()["share_lost"].max() > 0.5 and series[0].read()["share_lost"].max() == 0.0
    drawn, shown = (matplotlib.image.imread(folder / "torn.png") for folder in (tmp_path, run.CHECKOUT / "doc" / "figures"))
    assert drawn.shape == shown.shape and np.mean(np.abs(drawn - shown)) < 0.02, "make it again by the command of the page"
