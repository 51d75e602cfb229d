# SPDX-License-Identifier: GPL-2.0-only
"""Bodies with known answers: lattices, chains, random packs, the affine curve; closed forms by their number in the project's model notes. Each test derives
its tolerance from the terms that the form leaves out.

Lengths are in diameters of the spheres, 1 m; mass of a sphere 1 kg; stiffness of a bond at rest K = m1 n1 e1/deq^2 = 1 N/m at deq = 1 m. A pair's force is
F deq/K = -x + 7.5 x^2 - 32.5 x^3 at d = (1 + x) deq, exponents 8 and 4."""

import itertools

import numpy as np
import pytest
import small_bodies
from evp import law
from lammps_run import write_data
from small_bodies import dump, thermo

ROW = law.Row(1.0 / 32.0, 8.0, 4.0, 3.0 / 80.0 / 32.0, 8.0, 4.0, 0.005, 0.0, 1.5)  # Table 1 with e1 = 1/32 J


def head(row=ROW):
    """Up to the recording, for body.data in a periodic box."""
    return small_bodies.head(boundary="p p p", skin=0.05) + small_bodies.pair(row, "none")


def write_body(folder, x, box):
    write_data(folder / "body.data", x, np.full(len(x), 0.5), box, density=6.0 / np.pi)


def box_strain(axes, size, edge):
    """Commands that set the box to (1 + strain) along the axes, from any state, atoms along with it."""
    return "change_box all " + " ".join(f"{axis} final 0 {edge * (1.0 + size):.17g}" for axis in axes) + " remap units box\nrun 0\n"


# ---- elastic constants of the face-centred cubic lattice ---------------------------------------------------

STRAIN = 1e-4
# Central differences leave the cubic terms: 32.5 of the law and a few of geometry, times STRAIN squared.
CUBIC = 50.0 * STRAIN**2


@pytest.mark.parametrize("alpha, bonds, expected, young, anisotropy", [
    (1.4, 6, (2.0**0.5, 0.5**0.5, 0.5**0.5), 8.0**0.5 / 3.0, 2.0), (1.5, 9, (8.0**0.5, 0.5**0.5, 0.5**0.5), 1.8 * 2.0**0.5, 2.0 / 3.0)])
def test_fcc_elastic_constants(lmp, tmp_path, alpha, bonds, expected, young, anisotropy):
    """Closed form 2: every atom is a centre of symmetry, so the lattice deforms as its box does, and each shell of bonds
    adds K_s sum(u_a u_b u_c u_d) d^2/(2 V) per atom. The second shell, K/2 at sqrt(2) diameters, adds to C11 alone. Anisotropy
    2 C44/(C11 - C12) is 2 with one shell and 2/3 with two. C11, C12, C44 [N/m2] by strains of +-STRAIN along [100]."""
    corner = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 2.0
    grid, edge = np.array(list(itertools.product(range(3), repeat=3)), dtype=float), 3.0 * np.sqrt(2.0)
    x = np.sqrt(2.0) * (grid[:, None, :] + corner + 0.25).reshape(-1, 3)
    write_body(tmp_path, x, [[0.0, edge]] * 3)
    text = head(ROW._replace(alpha=alpha)) + thermo("pxx pyy pxy f_bonds") + "run 0\n" + "".join(box_strain("x", strain, edge) for strain in (STRAIN, -STRAIN, 0.0))
    text += "change_box all triclinic\n" + "".join(f"change_box all xy final {strain * edge:.17g} remap units box\nrun 0\n" for strain in (STRAIN, -STRAIN))
    run = lmp(text).ok()
    _, plus, minus, _, right, left = (run.thermo(block) for block in range(6))
    assert plus["f_bonds"][0] == len(x) * bonds, "control: 12 neighbors, and 6 in the second shell"
    c11, c12, c44 = measured = [-(a[name][0] - b[name][0]) / (2.0 * STRAIN) for name, a, b in (("Pxx", plus, minus), ("Pyy", plus, minus), ("Pxy", right, left))]
    assert measured == pytest.approx(expected, rel=CUBIC)
    assert c11 - 2.0 * c12**2 / (c11 + c12) == pytest.approx(young, rel=3.0 * CUBIC)
    assert 2.0 * c44 / (c11 - c12) == pytest.approx(anisotropy, rel=5.0 * CUBIC)


# ---- chain -------------------------------------------------------------------------------------------------

COUNT, SMALL = 32, 1e-7  # strain of the waves: the quadratic term of the law is 7.5 of it, round-off of places 1e-16 * 20/SMALL


def mode_of(a, interval):
    """Angular frequency and decay rate of a sampled mode, a = exp(-rate t) cos(omega t + phase), which obeys a[k+1] = p a[k] - r a[k-1]
    with r = |z|^2, p = 2 |z| cos(turn)."""
    p, r = np.linalg.lstsq(np.stack([a[1:-1], -a[:-2]], axis=1), a[2:], rcond=None)[0]
    return float(np.arccos(np.clip(p / (2.0 * np.sqrt(r)), -1.0, 1.0)) / interval), float(-np.log(r) / (2.0 * interval))


@pytest.mark.parametrize("gamma", [0.0, 0.05])
def test_chain_dispersion_and_damping(lmp, tmp_path, gamma):
    """Closed form 3: w = 2 sqrt(K/m) |sin(q/2)|, decay (gamma/m)(1 - cos q), at each wave number from 32 spheres to 2, after a kick to one of a closed chain.
    LAMMPS computes damping with the velocities of the last half step: each mode obeys z^2 - (2 - c dt - w^2 dt^2) z + 1 - c dt = 0, c = 2 gamma (1 - cos q)/m,
    but for the quadratic term, 7.5 SMALL times the 16 modes that it couples. The continuous decay is off by c dt/2 of itself, the frequency by
    (w dt)^2/24 + c dt/4."""
    dt = 0.02
    write_body(tmp_path, np.stack([np.arange(COUNT) + 0.5, np.full(COUNT, 2.5), np.full(COUNT, 2.5)], axis=1), [[0.0, COUNT], [0.0, 5.0], [0.0, 5.0]])
    run = lmp(head(ROW._replace(gamma=gamma)) + f"""
group one id 1
velocity one set {SMALL} 0 0
fix move all nve
{dump(every=1, columns="vx")}timestep {dt}
run 2000
""").ok()
    q = 2.0 * np.pi * np.arange(1, COUNT // 2 + 1) / COUNT
    modes = np.array([snapshot["vx"] for snapshot in run.dump("all.dump")]) @ np.cos(np.outer(np.arange(COUNT), q))
    measured = np.array([mode_of(mode[1:], dt) for mode in modes.T])
    w2, c = 4.0 * np.sin(0.5 * q) ** 2, 2.0 * gamma * (1.0 - np.cos(q))
    turn = np.arccos((2.0 - c * dt - w2 * dt**2) / (2.0 * np.sqrt(1.0 - c * dt))) / dt
    decay = -np.log(1.0 - c * dt) / (2.0 * dt)
    small = 7.5 * SMALL * len(q)
    assert np.all(np.abs(measured[:, 0] - turn) < small * turn)
    assert np.all(np.abs(measured[:, 1] - decay) < small * turn)
    exact = np.sqrt(w2 - c**2 / 4.0)
    assert np.all(np.abs(measured[:, 0] / exact - 1.0) < small + w2 * dt**2 / 24.0 * 1.1 + c * dt / 4.0 * 1.1)
    assert np.all(np.abs(measured[:, 1] - c / 2.0) < small * turn + c / 2.0 * c * dt / 2.0 * 1.1)
    assert measured[-1, 0] > 10.0 * measured[0, 0] and (gamma == 0.0 or measured[-1, 1] > 50.0 * measured[0, 1]), "control"


# ---- isotropic random pack ---------------------------------------------------------------------------------

PACK = """region box block 0 {edge:.17g} 0 {edge:.17g} 0 {edge:.17g}
create_box 1 box
create_atoms 1 random {count} 2017 box
set group all diameter 1 density 1"""
RELAX = """min_style cg
min_modify dmax 0.1 norm max
pair_style soft 1.0
pair_coeff * * 1.0
minimize 0 1e-4 300 3000
"""


def state(name, axes, commands, strain, edge):
    """Commands that strain the box along some axes, something to do there, and a line of what is then there."""
    return (box_strain("xyz", 0.0, edge) + box_strain(axes, strain, edge) + commands
            + f'run 0\nprint "STATE {name} $(pxx:%.17g) $(pyy:%.17g) $(pzz:%.17g) $(f_bonds)"\n')


def test_isotropic_random_pack(lmp):
    """Closed form 1: E = K deq^2 (bonds/volume)/6, nu = 1/4 for bonds in all directions that move with the body. The bulk modulus under affine motion,
    K deq^2 (bonds/volume)/9, holds for any directions, up to the quadratic term of the law and the volume, 7.5 + 3 of the strain. At rest E is below the
    closed form: by 3 % in periodic packs, and 7000 bonds scatter by about 1 %. The zone is below dlim, so that no strain loses a bond."""
    count, strain = 1000, 1e-5
    edge = (count * np.pi / 6.0 / 0.65) ** (1.0 / 3.0)
    text = small_bodies.head(boundary="p p p", start=PACK.format(count=count, edge=edge), skin=0.05) + RELAX
    text += small_bodies.pair(ROW, "none", "fix bonds all evp/bonds zone 1.45") + "run 0\n" + thermo("pxx pyy pzz f_bonds")
    text += state("swollen", "xyz", "", strain, edge) + state("stiff", "x", "", strain, edge)
    text += "".join(state(axis, axis, "minimize 0 1e-10 3000 9000\n", strain, edge) for axis in "xyz")
    lines = [line.split()[1:] for line in lmp(text).ok().stdout.splitlines() if line.startswith("STATE")]
    stress = {name: -np.array(values[:3], dtype=float) / strain for name, *values in lines}
    bonds = int(float(lines[0][-1]))
    affine = ROW.m1 * ROW.n1 * ROW.e1 * bonds / edge**3 / 6.0
    assert 6.5 * count < bonds < 8.5 * count, "control: a dense pack"
    assert np.mean(stress["swollen"]) / 3.0 == pytest.approx(affine / 1.5, rel=11.0 * strain)

    c = np.array([stress[axis] for axis in "xyz"])
    c11, c12 = np.trace(c) / 3.0, (c.sum() - np.trace(c)) / 6.0
    young, poisson = (c11 - c12) * (c11 + 2.0 * c12) / (c11 + c12), c12 / (c11 + c12)
    assert 0.95 < young / affine < 1.0
    assert poisson == pytest.approx(0.25, rel=0.05)
    assert stress["stiff"][0] == pytest.approx(1.2 * affine, rel=0.02), "control: before rest, C11 = 1.2 E at nu = 1/4"
    assert stress["x"][0] < 0.98 * stress["stiff"][0], "control: it came to rest"


# ---- affine two-regime curve -------------------------------------------------------------------------------

def affine_stress(strain, points=4000):
    """Closed form 5, of an axial strain: Cauchy and nominal stress over E of bonds in all directions under affine motion with no lateral stress, and the
    lateral strain; midpoint rule over the axial cosine."""
    cosine2 = ((np.arange(points) + 0.5) / points) ** 2

    def stresses(lateral):
        axial, across = cosine2 * (1.0 + strain) ** 2, (1.0 - cosine2) * (1.0 + lateral) ** 2
        d = np.sqrt(axial + across)
        pull = -law.force(d, 1.0, ROW) / d
        volume = (1.0 + strain) * (1.0 + lateral) ** 2
        scale = 6.0 / (ROW.m1 * ROW.n1 * ROW.e1) / volume
        return scale * np.mean(pull * axial), scale * np.mean(pull * across) / 2.0, volume / (1.0 + strain)

    low, high = -strain, 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if stresses(middle)[1] > 0.0 else (middle, high)
    cauchy, _, area = stresses(high)
    return cauchy, cauchy * area, high


def test_affine_two_regime_curve(lmp, tmp_path):
    """Closed form 5: pairs that touch each other and nothing else, in 4096 directions, multiples of the golden angle at equal steps of the axial cosine,
    moved as the box is, with the lateral strain that the law's own integral over all directions asks for. To that integral the curve owes the evenness
    of the directions, 1/4096 of E xi_s."""
    per_side, bonds = 16, 16**3
    k, edge = np.arange(bonds) + 0.5, 4.0 * per_side
    cosine, turn = 1.0 - 2.0 * k / bonds, np.pi * (3.0 - np.sqrt(5.0)) * k
    sine = np.sqrt(1.0 - cosine**2)
    half = 0.5 * np.stack([cosine, sine * np.cos(turn), sine * np.sin(turn)], axis=1)
    centre = 4.0 * (np.array(list(itertools.product(range(per_side), repeat=3)), dtype=float) + 0.5)
    write_body(tmp_path, np.concatenate([centre - half, centre + half]), [[0.0, edge]] * 3)
    even, young = ROW.xi_s / bonds, ROW.m1 * ROW.n1 * ROW.e1 * bonds / edge**3 / 6.0
    text, closed = head() + thermo("pxx pyy pzz vol") + "run 0\n", {strain: affine_stress(strain) for strain in (0.005, 0.006, 0.008, 0.01, 0.015, 0.02, 0.03, 0.05)}
    assert closed[0.05][:2] == pytest.approx((0.01042, 0.01027), abs=1e-5), "as in the notes"
    for strain, (_, _, lateral) in closed.items():
        text += (f"change_box all x final 0 {edge * (1.0 + strain):.17g} y final 0 {edge * (1.0 + lateral):.17g} "
                 f"z final 0 {edge * (1.0 + lateral):.17g} remap units box\nrun 0\n")
    run = lmp(text).ok()
    for block, (strain, (cauchy, nominal, _)) in enumerate(closed.items(), start=1):
        table = {name: column[0] for name, column in run.thermo(block).items()}
        area = table["Volume"] / (edge**3 * (1.0 + strain))
        measured = -table["Pxx"] / young, -table["Pxx"] / young * area
        assert measured == pytest.approx((cauchy, nominal), abs=even), strain
        assert abs(table["Pyy"]) / young < even and abs(table["Pzz"]) / young < even, strain
        assert abs(measured[0] - min(strain, ROW.xi_s)) > 5e-5, "control: neither elastic nor ideally plastic"
    assert abs(measured[0] - nominal) > 5e-5, "control: at the last strain the two stresses differ"
