#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Friction stir: torque, temperatures, wake and the strength of the seam of in.stir and in.seam, with the controls that say which rules matter.

Plates of 3000 spheres of aluminium 2024-T351. About 70 minutes on one core, most of it for nine turns of the pin and for the run that is ten times as fast as the real pin; --ranks 2 takes two cores.
"""

import re
import sys

from study import CHECKOUT, DECKS, Study, output_of, store_picture
import numpy as np
from scipy.spatial import cKDTree

from evp import curves, dump, figures
from evp.calibration import MISES
from metals import METALS

NAME = "aluminium_2024T351"
POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
A, B, N = METALS[NAME].law
LENGTH, WIDTH, HEIGHT = 0.026, 0.022, 0.005  # of the plate [m]
PIN, DEPTH, TMELT = 0.0025, 0.0025, 775.0  # of in.stir
WHOLE, SHORT = {"dwell": 1, "turns": 8}, {"dwell": 1, "turns": 1}
FAST = {"dwell": 1, "turns": 3, "feed": 3800}
CRITERIA = {"all": "all", "pressed": "all exposure 0.4 pressure 1", "pressed_twice": "all exposure 0.4 pressure 2"}
FAR = {"from": 0.0133, "to": 0.0183}  # a strip that the pin does not touch [m]
MPA = 1e6
COLUMN = 2.0  # width of the columns of the wake, in mean diameters
POINTS = 400_000  # in the wake
STUCK = ("pair_coeff 1 3 evp/lj ${row_e1} ${row_m1} ${row_n1} ${row_e2} ${row_m2} ${row_n2} ${stick} ${row_gamma} ${row_alpha} spacing ${row_spacing} "
         "coordination ${row_coordination} limit own")
# Of the deck, line for line: a shoulder that sticks as the pin does.
STICKS = ((r"^pair_coeff +1 3 granular hooke.*", STUCK + "\npair_coeff 3 3 granular hooke 1 0.5 tangential linear_nohistory 1 0"), (r"^pair_coeff +1 3 granular \${tool_contact}", ""))
SLIPS = "pair_coeff 1 2 evp/lj ${plate_words}\n"  # a pin that holds as the plate does
FRAMES = """variable frame equal $(25*v_row_steps)
dump frames all custom ${frame} ${out}_frames.dump id type mol x y z radius c_temperature c_state[*]
dump_modify frames sort id time yes units yes format float %.6g colname mol plate colname c_temperature temperature ${state_titles}
"""


def cold_row():
    """Coefficients of the metal without softening and melting."""
    row = re.search(rf"^{NAME} (.*)", POTENTIALS.read_text(encoding="utf-8"), re.M)[1]
    return re.sub(r"(soften( \S+){3}|melt \S+) ?", "", row).strip()


def edited(runs, name, changes):
    """A copy of in.stir with other lines."""
    text = (DECKS / "in.stir").read_text(encoding="utf-8").replace("${here}", str(DECKS))
    for pattern, line in changes:
        text, count = re.subn(pattern, lambda _: line, text, flags=re.M)
        if count != 1:
            raise ValueError(f"in.stir has {count} lines '{pattern}', not one")
    path = runs.folder / name
    path.write_text(text, encoding="utf-8")
    return path


class Stirred:
    """A run of in.stir: its curve, what it printed, the plate at the end and where the pin has passed."""

    def __init__(self, runs, name, text):
        self.text, self.seconds = text, runs.seconds(name)
        names = (runs.folder / f"{name}.csv").read_text(encoding="utf-8").partition("\n")[0].split(",")
        self.curve = curves.read_columns(runs.folder / f"{name}.csv", names)
        self.state = dump.index([runs.folder / f"{name}_state.dump"])[-1].read()
        self.wake = {key: float(value) for key, value in re.findall(r"^variable (top|path_\w+) string (\S+)", (runs.folder / f"{name}.wake").read_text(encoding="utf-8"), re.M)}

    def last(self, column, turns=1.0):
        """Mean of a column over the last turns, by time."""
        return self.between(column, self.curve["turns"][-1] - turns, self.curve["turns"][-1])

    def between(self, column, start, end):
        """Mean of a column between two numbers of turns, by time."""
        turns, at = self.curve["turns"], np.linspace(start, end, 400)
        return float(np.mean(np.interp(at, turns, self.curve[column])))

    @property
    def torque(self):
        """Of the pin, row by row [N m]."""
        return -self.curve["torque_pin"]

    @property
    def axis(self):
        """Of the pin at the end [m], along x."""
        return self.wake["path_end"] + PIN + 2.0 * np.mean(self.state["radius"])

    def near(self, distance):
        """Temperatures of the plate within a distance of the pin, above its end [K]."""
        state = self.state
        rho = np.hypot(state["x"] - self.axis, state["y"])
        return state["temperature"][(state["type"] == 1) & (rho < PIN + distance) & (state["z"] > self.wake["top"] - DEPTH)]

    def wake_measures(self):
        """Of what the pin has passed: share of points farther than a mean diameter from all spheres, solid fraction, that of its least solid column; of the plate the share of
        spheres that are above it."""
        state = self.state
        plate = state["type"] != 3
        centers, radius = np.stack([state[c][plate] for c in "xyz"], axis=1), state["radius"][plate]
        d = 2.0 * float(np.mean(radius))
        low = np.array([self.wake["path_start"], -PIN, self.wake["top"] - DEPTH])
        high = np.array([self.wake["path_end"], PIN, self.wake["top"]])
        points = np.random.default_rng(1).uniform(low, high, (POINTS, 3))
        tree = cKDTree(centers)
        distance, nearest = tree.query(points, k=6)
        solid = np.any(distance < radius[nearest], axis=1)
        cells = tuple(((points - low) // (COLUMN * d)).astype(int)[:, :2].T)
        shape = tuple(np.maximum(((high - low) // (COLUMN * d)).astype(int)[:2], 1))
        inside = (cells[0] < shape[0]) & (cells[1] < shape[1])
        column = np.ravel_multi_index((cells[0][inside], cells[1][inside]), shape)
        fractions = np.bincount(column, solid[inside]) / np.bincount(column)
        out = np.mean(centers[:, 2] > self.wake["top"])
        return float(np.mean(distance[:, 0] > d)), float(np.mean(solid)), float(fractions.min()), float(out)


def slip_torque(beyond):
    """Of the flow stress in shear at a plastic strain of 2, the last of the row, on a cylinder and half a ball that are so much wider than the pin [N m]."""
    r = PIN + beyond
    return (2.0 * np.pi * r**2 * DEPTH + 2.0 / 3.0 * np.pi * r**3) * (A + B * 2.0**N) / MISES


def percent(value, other):
    """By how much a value differs from another one."""
    return f"{100.0 * (value / other - 1.0):+.1f} %"


def rows_by_turn(run):
    """Table of what happens in each turn."""
    header = ("turn", "torque of pin [N m]", "of shoulder [N m]", "first layer", "second layer", "mean T [K]", "highest [K]", "near the pin [K]", *(f"{k} [K]" for k in range(1, 6)))
    rows = []
    for start in np.arange(round(run.curve["turns"][-1])):
        inside = (run.curve["turns"] > start) & (run.curve["turns"] <= start + 1.0)
        mean = {name: run.between(name, start, start + 1.0) for name in run.curve}
        rows.append((f"{start + 1:g}", f"{-mean['torque_pin']:.1f}", f"{-mean['torque_shoulder']:.1f}", f"{mean['follow_first']:.2f}", f"{mean['follow_second']:.2f}",
                     f"{mean['temperature']:.0f}", f"{run.curve['temperature_highest'][inside].max():.1f}", f"{mean['temperature_near']:.0f}",
                     *(f"{mean[f'thermocouple_{k}']:.0f}" for k in range(1, 6))))
    return header, rows


def draw(study, run):
    """Torques and temperatures over the turns."""
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 2, figsize=(10.0, 4.2))
        panels = ((("torque_pin", "pin"), ("torque_shoulder", "shoulder")), (("temperature_highest", "highest"), ("temperature_near", "within 1.5 mm of the pin"),
                  *((f"thermocouple_{k}", f"thermocouple {k}") for k in (1, 3, 5))))
        rows = []
        for axis, lines in zip(axes, panels):
            for k, (name, label) in enumerate(lines):
                values = -run.curve[name] if name.startswith("torque") else run.curve[name]
                values = np.convolve(values, np.full(9, 1 / 9), "same")[4:-4] if name.startswith("torque") else values[4:-4]
                axis.plot(run.curve["turns"][4:-4], values, label=label, **figures.line_style(k))
                rows += [(label, f"{turns:.4g}", f"{value:.5g}") for turns, value in zip(run.curve["turns"][4:-4], values)]
            axis.set(xlim=(0, None), ylim=(0, None), xlabel="turns", ylabel="torque [N m]" if axis is axes[0] else "temperature [K]")
            figures.legend_below(axis, 2)
        return study.save(figure, ("curve", "turns", "value"), rows)


def draw_plates(study):
    """The two plates and their temperatures from above, without the tool, and a film of the plates."""
    folder, view = study.runs.folder, [sys.executable, CHECKOUT / "tools" / "view.py"]
    inside = ["--cut", "type>1.5", "--cut", f"z>{0.0005 + HEIGHT / 2 - DEPTH / 2}", "--view", "top"]
    for name, more in (("stir_plates.png", ["--color", "plate", "--strip", 3, "--pixels", 520]), ("stir_temperatures.png", ["--color", "temperature", "--strip", 3, "--pixels", 520]),
                       ("stir.gif", ["--color", "plate", "--film", "stir.gif", "--pixels", 280])):
        out = [] if "--film" in more else ["--out", name]
        output_of(list(map(str, [*view, "seam_frames.dump", *inside, *more, *out])), folder, name)
        store_picture(folder / name, study.out.parent / "figures")


def page(found, strength):
    """Values of the page."""
    seam = found["seam"]
    d = 2.0 * float(np.mean(seam.state["radius"]))
    near = seam.near(0.0015) / TMELT
    measures = {name: found[name].wake_measures() for name in ("seam", "sticks")}
    largest_heat = max(abs(float(re.search(r"heat imbalance (\S+) of", run.text)[1])) for run in found.values())
    balance = {name: abs(run.curve["energy_imbalance"][-1] / run.curve["plastic_work"][-1]) for name, run in found.items() if len(run.curve["plastic_work"])}  # without turns there is no row
    cold_torque = -found["cold_alone"].between("torque_pin", 0.1, 0.3)
    peak = np.convolve(seam.torque, np.full(5, 0.2), "valid").max()
    torque = {name: -found[name].last("torque_pin") for name in ("short", "seed", "slow", "cold")}
    one, two = (-found[name].between("torque_pin", 0.03, 0.1) for name in ("one_rank", "two_ranks"))
    period, peclet, inertia = re.search(r"a turn takes (\S+) s,.* Peclet number of the pin (\S+), inertia: rho v\^2 is (\S+) ", seam.text).groups()
    wake = (("", "void share", "solid fraction", "least of its columns", "spheres out"),
            [(label, f"{100 * void:.2f} %", f"{solid:.3f}", f"{least:.3f}", f"{100 * out:.2f} %") for label, (void, solid, least, out) in (
                ("two plates, after nine turns", measures["seam"]), ("one plate with a shoulder that sticks as the pin does, after five", measures["sticks"]))])
    pulls = (("strip", "strength [MPa]", "of the same strip of the plate [MPa]", "ratio"),
             [(label, *(f"{value:.1f}" for value in strength[name]), f"{strength[name][0] / strength[name][1]:.3f}") for label, name in (
                 ("two plates that were never stirred", "never"), ("stirred, hardening kept", "kept"), ("stirred, hardening forgotten", "forgotten"))])
    criteria = (("seam", "strength [MPa]", "ratio", "void share of the wake"),
                [(f"`{words}`", f"{strength[name][0]:.1f}", f"{strength[name][0] / strength[name][1]:.3f}", f"{100 * found[name].wake_measures()[0]:.2f} %") for name, words in CRITERIA.items()])
    ratio = {name: f"{seam / uncut:.2f}" for name, (seam, uncut) in strength.items()}
    width = float(found["apart"].state["y"][found["apart"].state["type"] == 1].max()) - 2.1 * d - PIN  # from the first layer to the clamps
    places = [1e3 * (PIN + d + (k - 0.5) * width / 5.0) for k in range(1, 6)]
    first = {name: found[name].between("follow_first", 0.3, 0.6) for name in ("alone", "slips")}
    return {"period": f"{1e3 * float(period):.2f}", "places": f"{', '.join(f'{place:.1f}' for place in places[:-1])} and {places[-1]:.1f}",
            "turns": rows_by_turn(seam), "wake": wake, "pulls": pulls, "criteria": criteria, "d": f"{1e3 * d:.2f}", "pin": f"{1e3 * PIN:g}", "depth": f"{1e3 * DEPTH:g}",
            "first": f"{seam.last('follow_first', 8.0):.2f}", "second": f"{seam.last('follow_second', 8.0):.2f}", "sticks": f"{first['alone']:.2f}", "slips": f"{first['slips']:.2f}",
            "cold_torque": f"{cold_torque:.0f}", "outside": f"{slip_torque(d):.0f}", "outside_ratio": f"{cold_torque / slip_torque(d):.2f}",
            "inside": f"{slip_torque(0.5 * d):.0f}", "inside_ratio": f"{cold_torque / slip_torque(0.5 * d):.2f}",
            "hot": f"{-seam.between('torque_pin', 1.0, 2.0):.0f}", "peak": f"{peak:.0f}",
            "highest": f"{seam.curve['temperature_highest'].max() / TMELT:.4f}", "near": f"{near.mean():.2f}", "near_95": f"{np.quantile(near, 0.95):.3f}",
            "near_4": f"{seam.near(0.004).mean() / TMELT:.2f}",
            "unsoftened": f"{found['cold'].curve['temperature_highest'].max() / TMELT:.2f}", "seed": percent(torque["seed"], torque["short"]), "slow": percent(torque["slow"], torque["short"]),
            "ranks_differ": percent(two, one), "balance": f"{balance['seam']:.1e}", "balances": f"{max(balance.values()):.1e}", "heat": f"{largest_heat:.0e}",
            "peclet": peclet, "inertia": inertia, "force_z": f"{seam.last('force_z') / 1e3:.1f}",
            "share": f"{100 * seam.last('torque_shoulder') / (seam.last('torque_shoulder') + seam.last('torque_pin')):.0f}",
            "stuck_void": f"{100 * measures['sticks'][0]:.1f} %", "stuck_least": f"{measures['sticks'][2]:.2f}", "stuck_out": f"{100 * measures['sticks'][3]:.1f} %",
            "minutes": f"{seam.seconds / 60.0:.0f}", **ratio}


def main(words=None):
    with Study(__doc__, "stir", ranks=2).started(words) as study:
        runs = study.runs
        (runs.folder / "frames.lmp").write_text(FRAMES, encoding="utf-8")
        (runs.folder / "slips.lmp").write_text(SLIPS, encoding="utf-8")
        plates = {seed: runs.body(f"plate_{seed}", n=3000, shape="block", length=LENGTH, width=WIDTH, height=HEIGHT, seed=seed) for seed in (1, 2)}
        hot, cold = {"material": f"{POTENTIALS}:{NAME}"}, {"coeff": cold_row()}
        plan = {  # name: choices
            "seam": {**hot, **WHOLE, "seam": "all", "also": "frames.lmp"}, "apart": {**hot, "dwell": 0, "turns": 0, "seam": "all"},
            "short": {**hot, **SHORT}, "seed": {**hot, **SHORT, "specimen": plates[2]}, "slow": {**hot, **SHORT, "faster": 10}, "one_rank": {**hot, "dwell": 0.1, "turns": 0},
            "two_ranks": {**hot, "dwell": 0.1, "turns": 0}, "cold": {**cold, **SHORT}, "cold_alone": {**cold, "dwell": 0.6, "turns": 0, "shoulder_radius": 0},
            "alone": {**hot, "dwell": 0.6, "turns": 0, "shoulder_radius": 0}, "slips": {**hot, "dwell": 0.6, "turns": 0, "shoulder_radius": 0, "also": "slips.lmp"},
            "sticks": {**hot, "dwell": 1, "turns": 4},
            **{name: {**hot, **FAST, "seam": words} for name, words in CRITERIA.items()}}
        cost = {"seam": 9.0, "slow": 4.0, "sticks": 5.0, "apart": 0.01}
        found = {}
        for name in study.each(plan, str, lambda name: cost.get(name, plan[name]["dwell"] + plan[name]["turns"])):
            deck = edited(runs, "in.stir_sticks", STICKS) if name == "sticks" else "in.stir"
            ranks = {"one_rank": 1, "two_ranks": 2}.get(name, study.ranks)
            found[name] = Stirred(runs, name, runs.run(deck, name, ranks, **{"specimen": plates[1], **plan[name]}))
        strength = {}
        for name, stirred, more in (("never", "apart", FAR), ("kept", "seam", {}), ("forgotten", "seam", {"hardening": "forgotten"}), *((name, name, {}) for name in CRITERIA)):
            text = runs.run("in.seam", f"pull_{name}", stirred=stirred, **more)
            strength[name] = [float(value) for value in re.search(r"strength (\S+) MPa .* of that of the plate, (\S+) MPa", text).groups()]
        draw(study, found["seam"])
        draw_plates(study)
        study.write(**page(found, strength))


if __name__ == "__main__":
    main()
