# SPDX-License-Identifier: GPL-2.0-only
"""The runs of doc/studies/accuracy_cost.py: every setting that a user of the decks chooses, varied one at a time.

The unit of work is one tension test to a strain of 2 %. Each knob has a reference setting of its own, against which its error is
that of the setting alone; the routes among them aim at one target as well, the damped curve at 1/s (figure 4 of the paper).
"""

from typing import NamedTuple

TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
POW = "80 8.0000001 4.0000001 3 8.0000001 4.0000001 0.005 0 1.5"  # the same law by pow(): powers that are no integers
ROW = 1e-4  # strain per row of in.traction
STRAIN = 0.02
ALPHAS = (1.3, 1.4, 1.5, 1.6, 1.7)
ZONES = (1.2, 1.3, 1.4, 1.5)  # with contact none: the literal rule would pull at the pairs left out with all its force


class Case(NamedTuple):
    """One setting of one knob.

    guess: processor time over that of the baseline; priority: 1 is always run, others as the budget allows. hook: commands
    included before the test. Of the variables `timestep` [s], `samples`, `tolerance` and `zone` are no choices of the decks, but numbers of
    lines that are changed. ledger: the energy balance is read instead of the time. keep_modulus: e is changed with the
    number of bonds, so that the affine E stays.
    """

    knob: str
    choice: str
    deck: str
    variables: dict
    guess: float
    priority: int = 2
    hook: str = ""
    spheres: int = 500
    seed: int = 1
    ranks: int = 1
    ledger: bool = False
    keep_modulus: bool = False

    @property
    def key(self):
        return (self.knob, self.choice, str(self.spheres), str(self.seed), "ledger" if self.ledger else "timed")


class Knob(NamedTuple):
    """What a knob is about. route: its settings compute the target's curve, by the same model on the same specimen.
    converges: its settings tend to the reference, in their order."""

    title: str
    reference: str  # setting that its others are compared with
    route: bool
    colour: str
    converges: bool = False


KNOBS = {
    "explicit": Knob("timestep size, explicit damping, 1/s", "0.4 of the limit", True, "#CC3311", True),
    "implicit": Knob("timestep size, implicit damping, 1/s", "1e-6 s", True, "#0072B2", True),
    "tol": Knob("tol of fix nve/evp, implicit damping, dt = 1e-5 s, 1/s", "1e-8", True, "#56B4E9", True),
    "damped rate": Knob("strain rate, implicit damping", "1/s", True, "#009E73"),
    "rate": Knob("strain rate, no damping", "1/s", True, "#E69F00", True),
    "start": Knob("initial velocities, no damping, 10/s", "linear profile", True, "#A0522D"),
    "step": Knob("timestep size, no damping, 10/s", "0.05 of the limit", True, "#6F4A8E", True),
    "increment": Knob("strain increment, quasi-static", "0.0001", True, "#111111", True),
    "rest": Knob("tolerance of the minimization, quasi-static", "3e-5", True, "#777777", True),
    "rows": Knob("number of averaged stresses, no damping, 10/s", "14 stresses per 1e-4", True, "#CC79A7", True),
    "contact": Knob("rule for new contacts, no damping, 10/s", "literal", False, "#882255"),
    "alpha": Knob("range alpha with E kept, no damping, 10/s", "1.5", False, "#999933"),
    "zone": Knob("range of the bonds with E kept, contact none, no damping, 10/s", "1.5", False, "#DDCC77"),
    "output": Knob("output of energy and virial, no damping, 10/s", "where printed", True, "#44AA99"),
    "exponents": Knob("exponents, no damping, 10/s", "8 4", True, "#332288"),
    "particles": Knob("number of spheres, no damping, 10/s", "", False, "#117733"),
}
TARGET = ("explicit", KNOBS["explicit"].reference)
RECIPE = ("explicit", "0.8 of the limit")  # the paper's method, with a stable timestep size
CHECK_SEED = 20261  # of a specimen that is no part of the sweep
BASELINE = {"rate": 10, "dtfraction": 0.4}  # of in.traction: the unit of time
EVERY_STEP = """compute each_e all pe
compute each_p all pressure NULL virial
fix each all ave/time 1 1000 1000 c_each_e c_each_p
"""
UNDAMPED_STEP = 7e-7  # [s], some 0.77 of the limit of 500 spheres: one timestep size where the knob is another
AT_REST = "velocity free set 0 0 0\n"
LEDGER = """fix ledger all evp/energy
variable open equal f_ledger
variable work equal f_ledger[7]
fix balance all print ${every} "$(v_strain_now:%.9g),${open},${work}" file balance.csv screen no title "strain,open,work"
"""


def body_cases():
    """Cases of one specimen of 500 spheres, those that matter most first."""

    def pull(knob, choice, guess, priority=2, hook="", coeff=TABLE1, **variables):
        strained = float(f"{variables.get('timestep', 0) * variables['rate']:.6g}")  # in a timestep: no row is shorter
        row = {"row": strained} if strained > variables.get("row", ROW) else {}
        return Case(knob, choice, "in.traction", {"coeff": coeff, "strain": STRAIN, **variables, **row}, guess, priority, hook)

    def implicit(knob, choice, guess, step, priority=2, hook="", rate=1):
        samples = 1 if step * rate > 0.9e-5 else 5
        return pull(knob, choice, guess, priority, hook, TABLE2, rate=rate, integrator="implicit", timestep=step, samples=samples)

    def rest(knob, choice, guess, priority=2, **variables):
        return Case(knob, choice, "in.quasistatic", {"coeff": TABLE1, "strain": STRAIN, **variables}, guess, priority)

    def undamped(knob, choice, guess, priority=2, hook="", coeff=TABLE1, **variables):
        return pull(knob, choice, guess, priority, hook, coeff, **{"rate": 10, "timestep": UNDAMPED_STEP, "samples": 7, **variables})

    cases = [pull("explicit", f"{share} of the limit", 58 / share, priority, coeff=TABLE2, rate=1, dtfraction=share)
             for share, priority in ((0.8, 1), (0.4, 1), (0.9, 3), (0.2, 4))]
    cases += [implicit("implicit", f"{step} s", guess, float(step), priority)
              for step, guess, priority in (("1e-6", 16, 1), ("2e-6", 9, 2), ("5e-6", 5, 2), ("1e-5", 3, 1), ("1.6e-5", 2.5, 2))]
    cases += [implicit("tol", word, guess, 1e-5, 2, f"fix integrate free nve/evp tol {word}\n")
              for word, guess in (("0.3", 1.5), ("0.1", 1.5), ("1e-2", 2), ("1e-3", 3), ("1e-5", 5), ("1e-8", 8))]
    cases += [implicit("damped rate", f"{rate}/s", guess, 1e-5, priority, rate=rate)
              for rate, guess, priority in ((1, 3, 1), (2, 1.5, 2), (5, 0.8, 2), (10, 0.5, 1), (30, 0.3, 2))]
    cases += [undamped("rate", f"{rate}/s", 6 / rate, 1 if rate in (1, 10) else 2, rate=rate, samples=7 if rate <= 10 else 1) for rate in (1, 3, 10, 30, 100, 300)]
    cases += [undamped("start", name, 0.7, hook=hook) for name, hook in (("linear profile", ""), ("from rest", AT_REST))]
    cases += [undamped("step", f"{share} of the limit", 0.4 / share, 1 if share in (0.8, 0.4) else 2, timestep=0, dtfraction=share, samples=1)
              for share in (0.9, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05)]
    cases += [rest("increment", step, guess, 1 if step in ("0.001", "0.0005") else 2, increment=step)
              for step, guess in (("0.005", 0.3), ("0.0025", 0.3), ("0.001", 0.4), ("0.0005", 0.5), ("0.00025", 0.8), ("0.0001", 1.2))]
    cases += [rest("rest", word, guess, tolerance=word)
              for word, guess in (("3e-2", 0.3), ("1e-2", 0.3), ("3e-3", 0.4), ("3e-4", 0.5), ("3e-5", 0.8))]
    cases += [undamped("rows", f"{samples} stress{'es' * (samples > 1)} per {row}", 0.7, row=float(row), samples=samples)
              for row, samples in (("1e-4", 1), ("1e-4", 7), ("1e-4", 14), ("5e-4", 7), ("5e-4", 71))]
    cases += [undamped("contact", mode, 0.7, contact=mode) for mode in ("literal", "repulsive", "none")]
    cases += [undamped("alpha", f"{alpha:g}", 0.7, coeff=TABLE1[:-3] + f"{alpha:g}")._replace(keep_modulus=True) for alpha in ALPHAS]
    cases += [undamped("zone", f"{zone:g}", 0.7, contact="none", zone=zone)._replace(keep_modulus=True) for zone in ZONES]
    cases += [undamped("output", name, 1.0, hook=hook) for name, hook in (("where printed", ""), ("every step", EVERY_STEP))]
    cases += [undamped("exponents", name, guess, coeff=coeff) for name, guess, coeff in (("8 4", 0.7, TABLE1), ("8 4 by pow()", 5, POW))]
    return cases


def ledger_cases():
    """Energy balances: of the timestep sizes."""
    wanted = [case for case in body_cases() if case.knob in ("step", "implicit")]
    return [case._replace(ledger=True, hook=case.hook + LEDGER, guess=2 * case.guess, priority=3) for case in wanted]


def size_cases(sizes):
    """Specimens of more spheres, of the same material; those of 8000 and more on two ranks."""
    made = []
    for spheres, seeds, priority in sizes:
        for seed in seeds:
            case = Case("particles", str(spheres), "in.traction", {"coeff": TABLE1, "strain": STRAIN, "rate": 10, "dtfraction": 0.8, "samples": 2},
                        (0.7 if spheres < 8000 else 1.6) * (spheres / 500) ** (4 / 3), priority, spheres=spheres, seed=seed, ranks=2 if spheres >= 8000 else 1)
            made.append(case)
    return made


def all_cases(seeds=(1, 2, 3, 4)):
    """The whole plan, in the order in which it is run."""
    body = [case._replace(seed=seed) for seed in seeds for case in body_cases() if seed == seeds[0] or case.priority < 4]
    sizes = ((500, (1, 2, 3, 4, 5, 6), 1), (1000, (1, 2, 3, 4), 2), (2000, (1, 2, 3), 1), (4000, (1, 2, 3), 2), (8000, (1, 2), 1),
             (16000, (1, 2), 3), (32000, (1, 2), 2))
    return body + size_cases(sizes) + ledger_cases()


def check_cases(chosen):
    """The target and the recommended settings, (knob, choice) each, on the specimen that is no part of the sweep."""
    return [case._replace(seed=CHECK_SEED, priority=1) for case in body_cases() if (case.knob, case.choice) in {TARGET, *chosen}]


def quick_cases():
    """A few short ones, whose orders and monotonicity tests can check."""
    keep = {"step": ("0.8 of the limit", "0.4 of the limit", "0.2 of the limit"), "damped rate": ("5/s", "10/s"),
            "increment": ("0.001", "0.0005"), "exponents": ("8 4", "8 4 by pow()"), "implicit": ("1e-5 s",)}
    chosen = [case for case in body_cases() if case.choice in keep.get(case.knob, ())]
    chosen += [case for case in ledger_cases() if case.knob == "step" and case.choice in keep["step"]]
    return chosen + size_cases(((500, (1,), 1), (1000, (1,), 1)))
