# SPDX-License-Identifier: GPL-2.0-only
"""Bonds as text: write_evp_bonds and `fix evp/bonds file` carry every bond to the last bit, through any number of
ranks, and a body that is half pulled goes on as if it had not been interrupted. Damaged files are in
test_hostile_bonds.py."""

import os
import subprocess

import lammps_run
import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import law
from oracle import brute
from lammps_run import write_data
from small_bodies import grips, head, pair, thermo
from test_restart import BONDS, MOTION, compare, start


def deck(source="", after="", newton="on", data=REFERENCE, row=law.TABLE1):
    return (head(newton, start=f"read_data {data}") + pair(row, fix=f"fix bonds all evp/bonds {source}") + "fix move all nve\n"
            + thermo("pe f_bonds f_bonds[1]") + f"run 0\n{after}\n")


def read_bonds(path):
    """Header and the set of lines of a bond file; each line occurs once."""
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    assert header == f"# EVP bonds COUNT: {len(lines)} UNITS: si"
    assert len(set(lines)) == len(lines)
    return set(lines)


def as_pairs(lines):
    return {(int(i), int(j)): float(deq) for i, j, deq in (line.split() for line in lines)}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The bonds of the reference specimen as one rank writes them."""
    folder = tmp_path_factory.mktemp("written")
    lammps_run.run_lammps(deck("zone 1.3", "write_evp_bonds all.bonds"), cwd=folder).ok()
    return folder / "all.bonds"


def test_the_file_holds_the_pairs_of_the_zone(written, reference):
    """Against distances in Python: one rounding of a sum of three squares and its root may differ."""
    found, truth = as_pairs(read_bonds(written)), brute.record_bonds(reference.x, reference.radius, 1.3)
    assert found.keys() == truth.keys()
    assert all(i < j for i, j in found)
    assert max(abs(found[pair] / deq - 1.0) for pair, deq in truth.items()) < 4 * np.finfo(float).eps


@pytest.mark.parametrize("ranks, other, newton", [(1, 1, "on"), (1, 4, "off"), (2, 1, "off"), (4, 2, "on")])
def test_every_bit_goes_through_any_ranks(lmp, tmp_path, written, ranks, other, newton):
    """Written by some ranks, read and written again by others: always the same lines."""
    lmp(deck("zone 1.3", "write_evp_bonds a.bonds", newton), ranks=ranks).ok()
    first = read_bonds(tmp_path / "a.bonds")
    assert first == read_bonds(written)
    run = lmp(deck("file a.bonds", "write_evp_bonds b.bonds", newton), ranks=other).ok()
    assert f"recorded {len(first)} pairs from file a.bonds" in run.stdout
    assert read_bonds(tmp_path / "b.bonds") == first
    assert not list(tmp_path.glob("*.part"))


def test_deq_that_is_no_distance_is_kept(lmp, tmp_path, written):
    """The file decides: values of deq that no distance in the data file has, the bonds the other way round."""
    lines = [f"{j} {i} {deq * (0.99 + 1e-5 * (i % 7)):.17g}" for (i, j), deq in as_pairs(read_bonds(written)).items()]
    (tmp_path / "a.bonds").write_text(f"# EVP bonds COUNT: {len(lines)} UNITS: si\n" + "\n".join(lines) + "\n", encoding="utf-8")
    lmp(deck("file a.bonds", "write_evp_bonds b.bonds"), ranks=2).ok()
    turned = {(j, i): deq for (i, j), deq in as_pairs(lines).items()}
    assert as_pairs(read_bonds(tmp_path / "b.bonds")) == turned


@pytest.mark.parametrize("ranks, other, newton", [(1, 4, "on"), (4, 1, "on"), (2, 2, "off")])
def test_half_pulled_body_continues(lmp, ranks, other, newton):
    """Data file and bond file in the middle of a pull at gamma = 0: the second half gives the same numbers to 1e-10."""
    whole = lmp(start(newton) + MOTION.format(name="whole") + "run 100\nwrite_data half.data nocoeff\nwrite_evp_bonds half.bonds\nrun 100\n",
                ranks=ranks).ok()
    x = lammps_run.read_dump(whole.folder / "whole.dump")[0]
    left, right = (" ".join(str(int(k)) for k in x["id"][inside]) for inside in (x["x"] <= 0.005, x["x"] >= 0.045))
    groups = grips(0.005, 0.045).replace("left region left", f"left id {left}").replace("right region right", f"right id {right}")
    resumed = head(newton, start="read_data half.data") + BONDS.replace("zone 1.48", "file half.bonds") + groups
    rest = lmp(resumed + MOTION.format(name="rest") + "reset_timestep 100\nrun 100\n", ranks=other).ok()
    compare(rest, whole, "rest", exact=False)


@pytest.mark.parametrize("ranks", [1, 3])
def test_bonds_of_a_deleted_atom_are_left_out(lmp, tmp_path, written, ranks):
    """A reader could not find the atom. IDs 1, in the middle and the highest; the data file that goes with the bonds reads back."""
    lmp(deck("zone 1.3", "group gone id 1 250 500\ndelete_atoms group gone compress no\nwrite_evp_bonds a.bonds\n"
             "write_data a.data nocoeff"), ranks=ranks).ok()
    kept = {pair: deq for pair, deq in as_pairs(read_bonds(written)).items() if not {1, 250, 500} & set(pair)}
    assert as_pairs(read_bonds(tmp_path / "a.bonds")) == kept
    run = lmp(deck("file a.bonds", data="a.data"), ranks=ranks).ok()
    assert run.thermo()["f_bonds"][-1] == len(kept) < len(read_bonds(written))
    assert run.thermo()["f_bonds[1]"][-1] == 0


@pytest.mark.parametrize("path", ["nowhere/a.bonds", "folder", "file/a.bonds", '""'])
def test_a_path_that_cannot_be_written(lmp, tmp_path, path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    run = lmp(deck(after=f"write_evp_bonds {path}"))
    assert run.returncode == 1 and f"write_evp_bonds: cannot write '{path.strip(chr(34))}': check the folder" in run.stdout, run.stdout
    assert [name for name in sorted(tmp_path.rglob("*")) if name.name != "in.lmp"] == before
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_a_full_disk_leaves_the_old_file(lmp, tmp_path, monkeypatch):
    """A limit of 8 kB on files stands for the full disk; mpirun, which needs files of its own, is outside of it.
    Control: with room the old file is replaced."""
    limited = tmp_path / "limited"
    limited.write_text(f'#!/bin/bash\ntrap "" XFSZ\nulimit -f 8\nexec "{lammps_run.LMP}" "$@"\n', encoding="utf-8")
    limited.chmod(0o755)
    old = tmp_path / "a.bonds"
    old.write_text("mine", encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(lammps_run, "LMP", limited)
        run = lmp(deck(after="write_evp_bonds a.bonds"), ranks=2)
    assert run.returncode == 1 and "write_evp_bonds: cannot write 'a.bonds': check the folder and the free space" in run.stdout
    assert old.read_text(encoding="utf-8") == "mine"
    assert not list(tmp_path.glob("*.part"))
    lmp(deck(after="write_evp_bonds a.bonds"), ranks=2).ok()
    assert len(read_bonds(old)) > 2000


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_star_is_the_step(lmp, tmp_path, ranks):
    """As in write_data: under run every each step has a file of its own."""
    text = deck(after='velocity all ramp vx -1 1 x 0 0.05\ntimestep 1e-7\nrun 21 every 7 "write_data d.*.data nocoeff" "write_evp_bonds d.*.bonds"')
    lmp(text + "write_evp_bonds end.*.*\n", ranks=ranks).ok()
    assert sorted(file.name for file in tmp_path.glob("d.*.bonds")) == [f"d.{step}.bonds" for step in (14, 21, 7)]
    assert sorted(file.name for file in tmp_path.glob("d.*.data")) == [f"d.{step}.data" for step in (14, 21, 7)]
    assert (tmp_path / "end.21.*").exists(), "the first star alone, as there"
    assert len({frozenset(read_bonds(file)) for file in tmp_path.glob("d.*.bonds")}) == 1


def test_file_written_before_the_first_set_up(lmp, tmp_path):
    """After read_restart the pair style has coefficients and no cut-offs yet."""
    lmp(deck(after="run 0\nwrite_evp_bonds live.bonds\nwrite_restart r.bin\n")).ok()
    lmp("read_restart r.bin\nfix bonds all evp/bonds\nwrite_evp_bonds again.bonds\n").ok()
    assert (tmp_path / "again.bonds").read_text(encoding="utf-8") == (tmp_path / "live.bonds").read_text(encoding="utf-8")


SHRUNK = {  # what shrinks after the recording at zone 1.48, and the row of the deck that reads
    "radii": ("set atom 1*200 diameter 0.004\n", 1.5),
    "alpha": ("pair_coeff * * 80 8 4 3 8 4 0.005 0 1.31\n", 1.31),
}


@pytest.mark.parametrize("what, ranks, other", [("radii", 1, 2), ("radii", 4, 1), ("alpha", 2, 1)])
def test_bonds_beyond_a_dlim_that_shrank(lmp, what, ranks, other):
    """The live run and a restart go on with such bonds, so does what is written: the same numbers, also when some of them are pressed until they act."""
    change, alpha = SHRUNK[what]
    press = ("change_box all x scale 0.9 y scale 0.9 z scale 0.9 remap\n" + thermo("pe fmax f_bonds f_bonds[1] f_bonds[2] f_bonds[3]") + "run 0\n")
    live = lmp(deck("zone 1.48", change + "run 0\nwrite_data s.data nocoeff\nwrite_evp_bonds s.bonds\n" + press), ranks=ranks).ok()
    again = lmp(deck("file s.bonds", press, data="s.data", row=law.TABLE1._replace(alpha=alpha)), ranks=other).ok()
    for name, values in live.thermo().items():
        assert again.thermo()[name][0] == pytest.approx(values[0], rel=1e-9), name
    assert live.thermo(1)["f_bonds[1]"][0] > live.thermo(2)["f_bonds[1]"][0] + 100, "control: some act again"


def test_high_ids_cost_no_memory(tmp_path):
    """Peak of a process that records, writes and reads with IDs up to 2^31: a bit for each possible ID would be 268 MB."""
    peaks = []
    for high in (500, 2_147_483_000):
        text = REFERENCE.read_text(encoding="utf-8").replace("\n500 1 ", f"\n{high} 1 ")
        assert high == 500 or f"\n{high} 1 " in text
        (tmp_path / "s.data").write_text(text, encoding="utf-8")
        script = deck("zone 1.3", "write_evp_bonds s.bonds\nunfix bonds\nfix bonds all evp/bonds file s.bonds\nrun 0\n", data="s.data")
        (tmp_path / "in.lmp").write_text(script.replace("map yes", "map hash"), encoding="utf-8")
        process = subprocess.Popen([str(lammps_run.LMP), "-log", "none", "-in", "in.lmp"], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        assert status == 0 and output.count("recorded 2") == 2, output[-1000:]
        peaks.append(usage.ru_maxrss / 1024)
    assert peaks[1] < peaks[0] + 40, f"{peaks} MB"


@pytest.mark.parametrize("ranks, count", [(1, 1_000_000), (2, 100_000)])
def test_a_million_bonds_stream(lmp, tmp_path, ranks, count):
    """Up to a million pairs of 1500 atoms, read in messages of 10 000 and written back; nothing is lost or changed."""
    n = 1500
    i, j = (k[:count] + 1 for k in np.triu_indices(n, 1))
    deq = 0.01 + 1e-9 * (np.arange(count) % 1_000_000)
    with open(tmp_path / "a.bonds", "w", encoding="utf-8") as out:
        out.write(f"# EVP bonds COUNT: {count} UNITS: si\n")
        out.writelines(f"{a} {b} {d:.17g}\n" for a, b, d in zip(i.tolist(), j.tolist(), deq.tolist()))
    place = 0.02 * np.stack(np.unravel_index(np.arange(n), (15, 10, 10)), axis=1)
    write_data(tmp_path / "a.data", place, np.full(n, 0.005), [[-0.01, 0.3], [-0.01, 0.2], [-0.01, 0.2]])
    run = lmp(deck("file a.bonds", "write_evp_bonds b.bonds", data="a.data"), ranks=ranks).ok()
    assert f"recorded {count} pairs from file a.bonds" in run.stdout
    assert read_bonds(tmp_path / "b.bonds") == read_bonds(tmp_path / "a.bonds")
