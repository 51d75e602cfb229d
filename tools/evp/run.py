# SPDX-License-Identifier: GPL-2.0-only
"""Starts LAMMPS runs side by side on the cores that there are, and says on stderr how long they will take.

EVP_LMP      the lmp to run (default: build/lmp of this checkout)
EVP_MPIRUN   mpirun with its flags (default: mpirun -np); a run on one rank does without
"""

import contextlib
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import Callable, List, Optional

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]
DECKS = CHECKOUT / "lammps_inputs"
_POLL = 0.1  # [s] between two looks at the running jobs
INTERVAL = 5.0  # [s] between two lines where the output is no terminal and runs are long
KNOWN = 0.05  # share done from which the time left is told: before, it is off by a factor of ten


class RunError(RuntimeError):
    """A LAMMPS run could not be had; the text says why."""


class Failed(RunError):
    """A run that had started failed; the text holds LAMMPS' own error and where the log is."""


@dataclass
class Job:
    """One run of a deck in a folder; its screen output goes to folder/name.log."""

    name: str
    deck: str
    variables: dict
    folder: pathlib.Path
    ranks: int = 1
    cost: float = 1.0  # share of the whole, in any unit
    done: Callable[[], float] = field(default=lambda: 0.0)  # 0..1 while it runs
    process: Optional[subprocess.Popen] = None

    @property
    def log(self):
        return pathlib.Path(self.folder) / (self.name + ".log")

    def start(self):
        """Start the process; RunError if lmp or mpirun is not there, OSError if it is no program."""
        command = deck_command(DECKS / self.deck, self.variables, self.ranks)
        with open(self.log, "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(command, cwd=self.folder, env=environment(), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)

    def check(self):
        """Failed with LAMMPS' own words if the ended process failed, RunError if it had not even started."""
        text = self.log.read_text(encoding="utf-8", errors="replace")
        if not ended_well(self.process.returncode, text):
            said = start_failure(text, self.process.returncode, self.ranks)
            if said:
                raise RunError(f"{self.name}: LAMMPS did not start (exit {self.process.returncode}): {said}\n"
                               "  run evp doctor (tools/doctor.py): it names the cause and the command that mends it")
            raise Failed(f"{self.name}: {self.deck} failed (exit {self.process.returncode}): {lammps_error(text)}\n  whole output: {self.log}")

    def end(self):
        """Waits until the process, which was terminated, has ended, and kills it where it does not."""
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def lammps_command(ranks=1):
    """Words that start lmp on so many ranks. RunError if the programs are missing."""
    lmp = os.environ.get("EVP_LMP") or str(CHECKOUT / "build" / "lmp")
    if shutil.which(lmp) is None:
        raise RunError(f"no program {lmp}: run tools/setup.sh first, or set EVP_LMP")
    lmp = str(pathlib.Path(shutil.which(lmp)).absolute())
    if ranks == 1:
        return [lmp]
    words = shlex.split(os.environ.get("EVP_MPIRUN") or "mpirun")
    if shutil.which(words[0]) is None:
        raise RunError(f"no program {words[0]}: install Open MPI, or set EVP_MPIRUN")
    if words[-1] not in ("-np", "-n"):
        words.append("-np")
    return [*words, str(ranks), lmp]


def deck_command(deck, variables, ranks=1):
    """Words that run a deck."""
    words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
    return [*lammps_command(ranks), "-in", str(deck), "-log", "none", *words]


def environment():
    """Of a run: ranks that spin while they wait make it several times slower where cores are shared, or ranks are bound to one.

    Open MPI refuses root unless told otherwise, as in a container, where nobody else is. One rank alone needs no daemon of Open MPI, which takes longer to start
    than LAMMPS.
    """
    root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"} if os.geteuid() == 0 else {}
    return {"OMPI_MCA_mpi_yield_when_idle": "1", "OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_hwloc_base_binding_policy": "none", **os.environ, **root}


def ended_well(code, text):
    """Whether a run with this exit code and output did all it should.

    Open MPI 4 at times takes a rank that has finalized for a failed one, of 'PID 0' (open-mpi/ompi issues 7833 and 9389), and exits with 1.
    """
    return code == 0 or (code == 1 and "Total wall time:" in text and " with PID 0 on" in text)


def ended(command, folder):
    """The process of a command that has ended; its stdout is all that it printed."""
    return subprocess.run(command, cwd=folder, env=environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", check=False)


def start_failure(text, code, ranks):
    """What mpirun, or the loader of one rank, said where LAMMPS did not begin: another try would end as this one did. Empty where it began.

    text, code: output and exit code of the run, which failed.
    """
    if code <= 0 or (ranks == 1 and code not in (126, 127)):
        return ""
    if "LAMMPS (" in text or re.search(r"\bsignal\b|BAD TERMINATION|^ERROR\b", text, re.M):
        return ""  # a crash loses what was not written yet
    paragraphs = re.split(r"\n\s*\n", re.sub(r"^-{20,}$", "\n", text.strip(), flags=re.M))
    paragraphs = [" ".join(words.split()) for words in paragraphs if words.strip()]
    return next((words for words in paragraphs if not words.startswith("WARNING")), "it printed nothing")[:300]


def lammps_error(text):
    """The error lines of what LAMMPS printed, or its last lines where there are none."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    found = [line for line in lines if re.match(r"ERROR\b", line)]  # no echoed print
    if found:
        return " / ".join(dict.fromkeys(found[:3]))
    return "\n  ".join(["no ERROR line; it ends with", *lines[-5:]])


def last_strain(path):
    """Strain in the last whole line of a growing PREFIX.csv; 0.0 before there is one."""
    try:
        return float(pathlib.Path(path).read_bytes().split(b"\n")[-2].split(b",")[0])
    except (OSError, IndexError, ValueError):
        return 0.0


@contextlib.contextmanager
def interrupted_later():
    """An interrupt that comes in the block takes effect at its end, so that a process that has just started is known and can be ended; not where the block fails."""
    came = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    before = {number: handler for number, handler in before.items() if callable(handler)}  # what is ignored stays so
    for number in before:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    for number in came:
        signal.raise_signal(number)


def run_jobs(jobs: List[Job], cores=None, title="LAMMPS"):
    """Run all jobs, in their order, as many at once as the cores allow.

    cores: default all that this process may use. At the first failure the others are stopped and
    RunError is raised; so they are on any other exception, the user's interrupt among them.
    """
    cores = cores or len(os.sched_getaffinity(0))
    waiting, running, finished = list(jobs), [], 0.0
    try:
        with Progress(title, sum(job.cost for job in jobs), INTERVAL) as progress:
            while waiting or running:
                for job in list(waiting):
                    free = cores - sum(other.ranks for other in running)
                    if job.ranks <= free or not running:
                        waiting.remove(job)
                        with interrupted_later():
                            job.start()
                            running.append(job)
                time.sleep(_POLL)
                for job in [job for job in running if job.process.poll() is not None]:
                    job.check()
                    running.remove(job)
                    finished += job.cost
                if running:
                    done = sum(job.cost * min(1.0, max(0.0, job.done())) for job in running)
                    progress.show(finished + done, ", ".join(job.name for job in running))
    finally:
        with interrupted_later():  # a second interrupt leaves none behind
            for job in running:
                job.process.terminate()
            for job in running:
                job.end()


def format_seconds(seconds):
    """'8 s', '2 min 05 s' or '31 h 07 min'."""
    whole = int(round(seconds))
    if whole >= 3600:
        return f"{whole // 3600} h {whole // 60 % 60:02d} min"
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


class Progress:
    """One line: rewritten on a terminal, elsewhere a new one, at intervals [s]. whole: what all runs cost, in any unit."""

    def __init__(self, title, whole, interval=0.0):
        self.title, self.whole, self.terminal = title, whole, sys.stderr.isatty()
        self.begin = self.shown = time.monotonic()
        self.interval = min(interval, 0.3) if self.terminal else interval

    def __enter__(self):
        return self

    def show(self, done, name):
        """Says that so much of the whole is done, and what runs now."""
        now = time.monotonic()
        if now - self.shown < self.interval:
            return
        self.shown, share, spent = now, done / self.whole, now - self.begin
        left = f"about {format_seconds(spent * (1 - share) / share)} left" if share >= KNOWN else f"{format_seconds(spent)} so far"
        text = f"{self.title} {100 * share:3.0f} %, {left}: {name}"
        print(f"\r\x1b[K{text}" if self.terminal else text, end="" if self.terminal else "\n", file=sys.stderr, flush=True)

    def __exit__(self, kind, *_):
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr)
        if kind is None:
            print(f"{self.title} done in {format_seconds(time.monotonic() - self.begin)}", file=sys.stderr, flush=True)


def watched(title, items, name=str, cost=lambda item: 1.0, interval=0.0):
    """Gives the items one after the other, and shows progress before each."""
    costs = [cost(item) for item in items]
    with Progress(title, sum(costs), interval) as progress:
        for number, item in enumerate(items):
            progress.show(sum(costs[:number]), name(item))
            yield item
