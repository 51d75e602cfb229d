# SPDX-License-Identifier: GPL-2.0-only
"""Explicit runs of small bodies with `plasticity isotropic`: plain numpy over a fixed list of pairs.

Velocity Verlet as LAMMPS has it: half a kick, drift, forces by the positions and the half-step velocities, half a kick.
The law of pairs is that of tools/evp/law.py. Order of a step, after the drift:

1. At steps divisible by `every`: p of each sphere that had bonds at the last update grows by (sum of the |ln| that
   wait)/(number of these bonds)/0.31, the sum begins again, bonds are counted, y = xi_s Y(p). Pairs beyond a y that
   fell are returned at fixed d, or at dlim where a bond is past it: Psi before - Psi after is dissipated, less the work
   over half a step of the force that is lost; the |ln| of bonds waits for the next update.
2. Forces, with deq of the step before, clamped; nothing is changed.
3. deq moves; half of each D is plastic work of each sphere; |ln| of bonds waits; bonds end. A bond past dlim flows to
   d = dlim. One of a sphere that has parted ends, and flows to d. Both lose their Psi of there and carry no force in that
   step. What is left only repels: below R_i + R_j, or the smaller of d and R_i + R_j.
   With contact join a pair without a bond becomes one with deq = d where d is at most BETA (R_i + R_j), once it has been
   beyond APART times that; what it stored as a contact is lost.

With a Yield each sphere keeps a factor of its y, and meets the condition of von Mises as it flows: see there.
With a Volume the energy of oracle.volume acts too, of pairs that are in the list; no bond may end then.

The set-up does 2 alone. Energies close to O(dt^2) while y is constant. Each y that moves, and each bond that ends with
a force, is a kink or a jump of a force within a timestep: O(dt), with a small factor where y grows.
"""

from typing import NamedTuple

import numpy as np

from evp import law

from . import volume
from .brute import rows_of_pairs, sums

APART = 1.05  # times BETA (R_i + R_j): beyond, a pair that was inside may join


class Pairwise(NamedTuple):
    """What an evaluation finds, arrays over the pairs (P,); it changes nothing."""

    d: np.ndarray  # [length]
    unit: np.ndarray  # (P, 3), from j to i
    flowed: law.Flowed  # after the clamp; of bonds past dlim at d = dlim
    force: np.ndarray  # of eq. 1 behind the clamp [force], positive repels; zero of pairs that do nothing or end
    damping: np.ndarray  # of eq. 4, along unit [force]
    past: np.ndarray  # bonds past dlim
    fails: np.ndarray  # bonds of spheres that have parted


class Yield(NamedTuple):
    """Flow stress S0 Y(p) that spheres meet, as of a row with `yield`.

    After the forces of a step with an update: S_i = -1/2 sum F d u (x) u, without damping; A_i the sum of S over a sphere and those it is
    bonded to, over the sum of their volumes m/density; s_i that of S_i/V_i along A_i, (3/2) dev(S_i/V_i) : dev(A_i)/mises(A_i).
    At the next update: p stays where mises(A_i) < 0.5 S0 Y(p_i); else the factor k_i moves by the share min(0.5, growth of p/0.0001) to
    K (1 - 0.6 (r - 1)), with K the mean factor around at the measurement, r = s_i/(1.02 S0 Y) within 2/3 and 3/2, 1 for spheres that are
    prescribed; it stays within 1/2 and 2. Y as before the update.
    """

    stress: float  # S0 [pressure]
    density: float  # of the solid


class Failure(NamedTuple):
    """Ductile failure, as of a row with `damage` and `rupture`; needs a Yield, or one of stress 0, for the density.

    After the forces of a step with an update, with A_i as of Yield: sigma* = (tr A/3)/mises(A), at most 3; omega_i grows by the mean of the
    growth of p of that update, over the sphere and those it is bonded to, over D1 + D2 exp(D3 sigma*), but not at sigma* <= -1/3. It stops at 1;
    the share beyond is taken off the growth of the sphere's own p, the rest is its first opening over L = 1.6 diameters.
    From the next update on: the opening grows by L times the growth of p, D = opening/UF, or opening mises(A) at initiation/(2 GF), at most 1. Bonds
    have the limit y_i Y(p at initiation)/Y(p_i) max(0.001, 1 - D), contacts y_i; what an expansion stores is multiplied by 1 - D. With D = 1
    all bonds of the sphere end, and it joins no more.
    """

    damage: tuple  # D1 D2 D3
    rupture: float = 0.0  # UF [length]
    energy: float = None  # GF [energy/area], instead of UF

    def strain(self, triaxiality):
        """Plastic strain at initiation."""
        d1, d2, d3 = self.damage
        return d1 + d2 * np.exp(d3 * np.minimum(triaxiality, 3.0))


class Volume(NamedTuple):
    """Volume energy of the pairs: kv, its Rest, and (bulk, from) of what it takes over from bonds."""

    kv: float
    rest: volume.Rest
    taken: tuple = (0.0, 0.0)


def deviator(tensors):
    """Of tensors (N,3,3)."""
    return tensors - np.trace(tensors, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)


def von_mises(tensors):
    """Equivalent stress (N,) of tensors (N,3,3)."""
    return np.sqrt(1.5 * np.sum(deviator(tensors) ** 2, axis=(1, 2)))


class Metal:
    """A body in motion; read its attributes, change them between calls of run() alone.

    x, v (N,3) positions [length] and velocities; radius, mass (N,); IDs are 1..N.
    rows: one law.Row, or {(type_i, type_j): Row}; flows: one table p0 Y0 p1 Y1 ... or None, or {type: table or None};
    types (N,) int, default 1; Limits are by the rows and tables of a sphere's own type.
    bonds: {(id_i, id_j): deq}; contact: none, repulsive or join; join: BETA; near (P,2): 0-based pairs that may meet, default all others.
    every: of the updates of p; prescribed (N,) bool: spheres that keep their v.

    Per pair: i, j (0-based), bonded, deq, touching = R_i + R_j. Per sphere: p, slip (what waits), work, count, y.
    Energies [energy]: kinetic(), stored(), dissipated, lost, viscous, work_done (by prescribed spheres); ended: bonds.
    """

    def __init__(self, x, v, radius, mass, rows, bonds, dt, flows=None, types=None, contact="none", near=None, every=10,
                 prescribed=None, p=0.0, join=1.2, condition=None, volume_energy=None, fails=None):
        if contact not in ("none", "repulsive", "join"):
            raise ValueError(f"contact {contact} has no plasticity")
        self.x, self.v = np.array(x, dtype=float), np.array(v, dtype=float)
        n = len(self.x)
        self.radius, self.mass = np.broadcast_to(radius, n), np.broadcast_to(np.asarray(mass, dtype=float), n)
        self.types = np.ones(n, dtype=int) if types is None else np.asarray(types)
        self.prescribed = np.zeros(n, dtype=bool) if prescribed is None else np.asarray(prescribed)
        self.dt, self.every, self.contact = dt, every, contact
        known = {(min(a, b) - 1, max(a, b) - 1): deq for (a, b), deq in bonds.items()}
        others = []
        if contact != "none" or volume_energy:
            near = np.stack(np.triu_indices(n, 1), axis=1) if near is None else np.sort(near, axis=1)
            others = [pair for pair in map(tuple, near.tolist()) if pair not in known]
        self.i, self.j = np.array([*known, *others], dtype=int).reshape(-1, 2).T
        self.bonded = np.arange(len(self.i)) < len(known)
        self.touching = self.radius[self.i] + self.radius[self.j]
        self.deq = np.concatenate([np.fromiter(known.values(), float), self.touching[len(known):]])
        self.row = rows_of_pairs(rows, self.types[self.i], self.types[self.j])
        self.dlim = self.row.alpha * self.touching
        self._laws = {}
        for kind in np.unique(self.types).tolist():
            own = rows if isinstance(rows, law.Row) else rows[kind, kind]
            self._laws[kind] = own, flows[kind] if isinstance(flows, dict) else flows
        self.p, self.slip, self.work = np.full(n, p, dtype=float), np.zeros(n), np.zeros(n)
        self.condition, self.volume_energy = condition, volume_energy
        self.fails, self.growth = fails, np.zeros(n)
        self.omega, self.opening, self.damage, self.triaxiality = (np.zeros(n) for _ in range(4))
        self.strain_at, self.stress_at, self.began = np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool)
        self.count = self._to_spheres(self.bonded)
        self.factor, self.around, self.along, self.mean_stress = np.ones(n), np.ones(n), np.zeros(n), np.zeros(n)
        self.fresh = ~self.bonded
        self.y = self._limits()
        self.n_steps, self.ended, self.joined, self.join = 0, 0, 0, join
        self.inside = ~self.bonded & (np.linalg.norm(self.x[self.i] - self.x[self.j], axis=1) <= APART * join * self.touching)
        self.by_flow = self.half_steps = self.lost = self.viscous = self.work_done = 0.0
        self._setup()

    def _to_spheres(self, of_pair, sign=1.0):
        """Sums (N,) of values (P,), or (N,3) of (P,3), over the pairs of each sphere; sign: of j."""
        return sums(self.i, of_pair, len(self.x)) + sign * sums(self.j, of_pair, len(self.x))

    def _limits(self):
        found = np.zeros(len(self.x))
        for kind, (row, flow) in self._laws.items():
            mine = self.types == kind
            found[mine] = np.minimum(self.factor[mine] * law.limit(self.p[mine], row, flow), law.largest_limit(row))
        return found

    def _flow_stresses(self):
        """S0 Y(p) (N,) [pressure]."""
        found = np.zeros(len(self.x))
        for kind, (row, flow) in self._laws.items():
            mine = self.types == kind
            found[mine] = self.condition.stress * law.limit(self.p[mine], row, flow) / row.xi_s
        return found

    def _move_factors(self, growth, flow_stress):
        ratio = np.clip(self.along / (1.02 * flow_stress), 2.0 / 3.0, 1.5)
        ratio[self.prescribed] = 1.0
        aim = self.around * (1.0 - 0.6 * (ratio - 1.0))
        moved = self.factor + np.minimum(0.5, growth / 1e-4) * (aim - self.factor)
        self.factor = np.where(growth > 0.0, np.clip(moved, 0.5, 2.0), self.factor)

    def _measure(self):
        """Stresses by the forces of now."""
        now, volumes = self.pairs, self.mass / self.condition.density
        pair_force = now.force + (self.by_volume.pair_force if self.volume_energy else 0.0)
        own = self._to_spheres((-0.5 * pair_force * now.d)[:, None, None] * now.unit[:, :, None] * now.unit[:, None, :])

        def around(values):
            i, j = self.i[self.bonded], self.j[self.bonded]
            return values + sums(i, values[j], len(values)) + sums(j, values[i], len(values))

        mean = around(own) / around(volumes)[:, None, None]
        self.mean_stress = von_mises(mean)
        single = own / volumes[:, None, None]
        self.along = 1.5 * np.sum(single * deviator(mean), axis=(1, 2)) / np.where(self.mean_stress > 0.0, self.mean_stress, np.inf)
        self.around = around(self.factor) / around(np.ones(len(self.x)))
        if self.fails:
            self._initiate(np.trace(mean, axis1=1, axis2=2) / 3.0, around(self.growth) / around(np.ones(len(self.x))))

    def _initiate(self, mean, growth):
        """omega by the mean stress and the mean growth of p around each sphere."""
        with np.errstate(divide="ignore", invalid="ignore"):
            self.triaxiality = np.where(self.mean_stress > 0.0, mean / self.mean_stress, self.triaxiality)
            moved = np.where((growth > 0.0) & (self.triaxiality > -1.0 / 3.0 + 1e-9), growth / self.fails.strain(self.triaxiality), 0.0)
            grows, sound = self.omega + moved, self.omega < 1.0
            begins = sound & (grows >= 1.0)
            self.opening = np.where(begins, 3.2 * self.radius * self.growth * np.where(np.isfinite(moved), (grows - 1.0) / moved, 1.0), self.opening)
        self.omega = np.where(sound, np.minimum(1.0, grows), self.omega)
        self.stress_at[begins] = self.mean_stress[begins]
        if self.condition.stress:
            self.stress_at[begins] = np.maximum(self.stress_at, 0.1 * self._flow_stresses())[begins]

    def _damage(self):
        """By the growth of p at an update."""
        fails, length = self.omega >= 1.0, 3.2 * self.radius
        fresh = fails & ~self.began
        self.strain_at[fresh] = (self.p - self.growth - self.opening / length)[fresh]
        self.began |= fresh
        self.opening[fails] += (length * self.growth)[fails]
        if self.fails.energy:
            damage = 0.5 * self.opening * self.stress_at / self.fails.energy
        else:
            damage = self.opening / self.fails.rupture if self.fails.rupture else np.ones(len(self.x))
        self.damage[fails] = np.minimum(1.0, damage)[fails]

    def _left(self):
        """Limits of bonds over those of contacts (N,), by damage and by the hardening that has stopped."""
        found = np.ones(len(self.x))
        for kind, (row, flow) in self._laws.items():
            mine = (self.types == kind) & self.began
            stopped = law.limit(np.minimum(self.strain_at, self.p)[mine], row, flow) / law.limit(self.p[mine], row, flow)
            found[mine] = stopped * np.maximum(0.001, 1.0 - self.damage[mine])
        return found

    def _of_pair(self, y):
        held = y * self._left() if self.fails else y
        return np.where(self.bonded, np.minimum(held[self.i], held[self.j]), np.minimum(y[self.i], y[self.j]))

    def _flow(self, d, deq, y):
        """Flowed of all pairs at d with deq and the limit y (P,); contacts do nothing with contact none."""
        bonds, meets = self.bonded, ~self.bonded & (d < deq) & (self.contact != "none")
        at_bonds, at_contacts = (law.Row(*(value[those] for value in self.row)) for those in (bonds, meets))
        found = law.Flowed(np.where(~bonds & (d > self.touching) & (self.contact != "none"), self.touching, deq), *np.zeros((4, len(d))))
        of_bonds = law.flow_bond(np.minimum(d, self.dlim)[bonds], deq[bonds], at_bonds, y[bonds])
        of_contacts = law.flow_contact(d[meets], deq[meets], self.touching[meets], at_contacts, y[meets])
        for values, *own in zip(found, of_bonds, of_contacts):
            values[bonds], values[meets] = own
        return found

    def evaluate(self):
        """The Pairwise of the present x, v, deq and y."""
        r = self.x[self.i] - self.x[self.j]
        d = np.linalg.norm(r, axis=1)
        unit = r / d[:, None]
        flowed = self._flow(d, self.deq, self._of_pair(self.y))
        past, fails = self.bonded & (d > self.dlim), np.zeros(len(d), dtype=bool)
        if self.fails:
            parted = self.damage >= 1.0
            fails |= self.bonded & ~past & (parted[self.i] | parted[self.j])
        acts = np.where(self.bonded, ~past & ~fails, (d < self.deq) & (self.contact != "none"))
        opening = np.sum(unit * (self.v[self.i] - self.v[self.j]), axis=1)
        force, damping = np.where(acts, flowed.force, 0.0), np.where(acts, -self.row.gamma * opening, 0.0)
        return Pairwise(d, unit, flowed, force, damping, past, fails)

    def _setup(self):
        self.pairs = self.evaluate()
        self.force = self._to_spheres((self.pairs.force + self.pairs.damping)[:, None] * self.pairs.unit, -1.0)
        if self.volume_energy:
            kv, rest, taken = self.volume_energy
            self.by_volume = volume.evaluate(self.x, self.i, self.j, self.dlim, kv, rest, fresh=self.fresh, taken=taken, tension=1.0 - self.damage)
            self.force += self.by_volume.force

    def _book(self, dissipated, slip):
        """D and |ln| (P,) of pairs that flowed."""
        self.by_flow += float(np.sum(dissipated))
        self.work += self._to_spheres(0.5 * dissipated)
        self.slip += self._to_spheres(np.where(self.bonded, slip, 0.0))

    def _update(self):
        growth, has_bonds = np.zeros(len(self.x)), self.count > 0
        growth[has_bonds] = self.slip[has_bonds] / self.count[has_bonds] / law.SLIP_PER_STRAIN
        if self.condition and self.condition.stress:
            flow_stress = self._flow_stresses() * (self._left() if self.fails else 1.0)
            growth[self.mean_stress < 0.5 * flow_stress] = 0.0
            self._move_factors(growth, flow_stress)
        before = self._of_pair(self.y)
        self.p, self.growth = self.p + growth, growth
        if self.fails:
            self._damage()
        self.slip[:] = 0.0
        self.count = self._to_spheres(self.bonded)
        self.y = self._limits()
        after = self._of_pair(self.y)
        d = np.linalg.norm(self.x[self.i] - self.x[self.j], axis=1)
        held = self._flow(d, self.deq, before)  # what flows in this step anyhow
        left = self._flow(d, held.deq, after)
        returned = (after < before) & (left.slip > 0.0)
        self._book(np.where(returned, held.dissipated + held.stored - left.stored, 0.0),
                   np.where(returned, held.slip + left.slip, 0.0))
        self.deq = np.where(returned, left.deq, self.deq)
        # the first half of the step had the force before it fell, the second has that after: their mean does the work
        opening = np.sum((self.x[self.i] - self.x[self.j]) * (self.v[self.i] - self.v[self.j]), axis=1) / d
        self.half_steps += 0.5 * self.dt * float(np.sum(np.where(returned & ~(self.bonded & (d > self.dlim)), (left.force - held.force) * opening, 0.0)))

    @property
    def dissipated(self):
        """By flow, less the work over half a step of forces that fell [energy]."""
        return self.by_flow - self.half_steps

    def _commit(self):
        now = self.pairs
        self._book(now.flowed.dissipated, now.flowed.slip)
        ends = now.past | now.fails
        self.lost += float(np.sum(now.flowed.stored[ends]))
        self.ended += int(np.sum(ends))
        self.bonded, self.fresh = self.bonded & ~ends, self.fresh | ends
        self.deq = np.where(ends, np.where(now.past, self.touching, np.minimum(now.d, self.touching)), now.flowed.deq)
        if self.contact != "join":
            return
        near, apart = now.d <= self.join * self.touching, now.d > APART * self.join * self.touching
        begins = ~self.bonded & ~ends & ~self.inside & near
        if self.fails:
            begins &= (self.damage[self.i] < 1.0) & (self.damage[self.j] < 1.0)
        self.inside = ~self.bonded & ~apart & (self.inside | ends)
        self.lost += float(np.sum(now.flowed.stored[begins]))
        self.joined += int(np.sum(begins))
        self.bonded, self.deq = self.bonded | begins, np.where(begins, now.d, self.deq)

    def step(self):
        old, old_force = self.pairs, self.force
        free = ~self.prescribed[:, None]
        self.v += np.where(free, 0.5 * self.dt * self.force / self.mass[:, None], 0.0)
        moved = self.dt * self.v
        self.x += moved
        self.n_steps += 1
        if self.n_steps % self.every == 0:
            self._update()
        self._setup()
        if self.condition and self.n_steps % self.every == 0:
            self._measure()
        self._commit()
        self.v += np.where(free, 0.5 * self.dt * self.force / self.mass[:, None], 0.0)
        parted = moved[self.i] - moved[self.j]
        for pairs, force in ((old, old_force), (self.pairs, self.force)):
            self.viscous -= 0.5 * float(np.sum(pairs.damping * np.sum(pairs.unit * parted, axis=1)))
            self.work_done -= 0.5 * float(np.sum(force[self.prescribed] * moved[self.prescribed]))

    def run(self, steps):
        for _ in range(steps):
            self.step()
        return self

    def kinetic(self):
        """Of all spheres [energy]."""
        return 0.5 * float(np.sum(self.mass * np.sum(self.v**2, axis=1)))

    def stored(self):
        """Psi of the pairs [energy]."""
        own = float(np.sum(self._flow(self.pairs.d, self.deq, self._of_pair(self.y)).stored))
        return own + (float(np.sum(self.by_volume.energy)) if self.volume_energy else 0.0)

    def energy(self):
        """kinetic + Psi + D + lost + viscous - work [energy]; it stays what it was."""
        return self.kinetic() + self.stored() + self.dissipated + self.lost + self.viscous - self.work_done

    def inside_pairs(self):
        """IDs of pairs that may not join before they have been apart."""
        chosen = self.inside & (self.contact == "join")
        return set(zip((self.i[chosen] + 1).tolist(), (self.j[chosen] + 1).tolist()))

    def records(self, bonds=True):
        """{(id_i, id_j): deq} of the bonds, or of the contacts whose deq is not R_i + R_j."""
        chosen = self.bonded if bonds else ~self.bonded & (self.deq != self.touching) & ~(self.inside & (self.contact == "join"))
        keys = zip((self.i[chosen] + 1).tolist(), (self.j[chosen] + 1).tolist())
        return dict(zip(keys, self.deq[chosen].tolist()))
