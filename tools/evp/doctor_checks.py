# SPDX-License-Identifier: GPL-2.0-only
"""Checks of the plugin: where LAMMPS looks for it, whether it is whole, what it was built for, whether it loads; and of a log."""

import hashlib
import os
import pathlib
import re

from . import doctor_elf as elf
from . import doctor_lammps as lammps
from . import doctor_plugin as plugins
from . import doctor_remedies as remedies

_PATH = "plugin path"
# Packages beside PLUGIN: what for, and the release that has them first.
WANTED = {"GRANULAR": ("friction and rigid tools by pair_style granular", 0), "GRAPHICS": ("pictures by evp view", 20260211)}


def _path_text(host):
    seen = host.trial.environment if host and host.trial else {}
    return seen.get("LAMMPS_PLUGIN_PATH", os.environ.get("LAMMPS_PLUGIN_PATH", ""))


def find_plugin(host, given):
    """The plugin file to look at: that of --plugin or of the log, of LAMMPS_PLUGIN_PATH, EVP's own; None where there is none."""
    if given:
        return pathlib.Path(os.path.abspath(given))
    found = [path for entry in plugins.path_entries(_path_text(host)) for path in plugins.plugins_in(entry)]
    beside = [host.path.parent / "evpplugin.so"] if host else []
    found += [path for path in [*beside, *plugins.own_plugins()] if path.is_file()]
    return pathlib.Path(os.path.abspath(found[0])) if found else None


def check_path(report, host, plugin, given):
    """Does LAMMPS find a plugin by itself?"""
    text = _path_text(host)
    entries = plugins.path_entries(text)
    faults = [plugins.fault_of_entry(entry) for entry in entries]
    found = [path for entry in entries for path in plugins.plugins_in(entry)]
    if len({_digest(path) for path in found}) > 1:
        report.fault(_PATH, f"two plugins that differ: {' '.join(map(str, found))}",
                     f"LAMMPS_PLUGIN_PATH has two EVP plugins that differ; LAMMPS takes {found[0]} and ignores the other.",
                     f"export LAMMPS_PLUGIN_PATH={remedies.quoted(found[0].parent)}")
    elif found:
        report.ok(_PATH, f"LAMMPS_PLUGIN_PATH={text}")
    elif given:
        report.ok(_PATH, f"without EVP's plugin: a deck must begin with: plugin load {plugin}")
    elif host.trial.exe is None:
        report.not_checked(_PATH, "lmp ends before it can say what it has loaded")
    else:
        what = "; ".join(faults) if entries else "LAMMPS_PLUGIN_PATH is not set"
        bad = remedies.fault_for(plugin, host.help)
        command = _mend(host, plugin) if bad else remedies.take_plugin(plugin.parent)
        cause = f"{what}{f', and {bad}' if bad else ''}: LAMMPS loads no EVP plugin by itself, and a deck without `plugin load` knows no evp/lj."
        if bad and not command.startswith(("export LAMMPS_PLUGIN_PATH=", "cmake --install ")):
            cause = f"there is no plugin for this lmp ({host.help.words()}): {bad}."
        report.fault(_PATH, what, cause, command)


def _mend(host, plugin):
    return remedies.mend_plugin(plugin, host) if host and host.sound else remedies.get_lammps()


def _digest(path):
    return hashlib.sha256(plugins.content(path)).hexdigest()


def check_file(report, host, plugin):
    """Is it a whole library of this machine that LAMMPS can start in? Its Elf, or None."""
    try:
        found = elf.read(plugin)
    except (elf.ElfError, OSError) as error:
        text = error.strerror if isinstance(error, OSError) else error
        report.fault("plugin file", f"{plugin} {text}", f"the file {plugin} {text}.", _mend(host, plugin))
        return None
    if found.machine != elf.own_machine():
        report.fault("plugin file", f"{plugin} is for {found.machine}", f"{plugin} was built for {found.machine}, and this machine is {elf.own_machine()}.",
                     _mend(host, plugin))
        return None
    if "lammpsplugin_init" not in found.defined:
        report.fault("plugin file", f"{plugin} has no lammpsplugin_init", f"{plugin} is a library, but no plugin of LAMMPS.", _mend(host, plugin))
        return None
    report.ok("plugin file", f"{plugin}, {found.machine}, sha256 {_digest(plugin)[:12]}")
    return found


def check_facts(report, host, plugin):
    """Was it built for this LAMMPS? True where it was, or does not say."""
    facts = plugins.read_facts(plugin)
    if facts is None:
        report.not_checked("built for", "the file does not say: it is no EVP plugin, or one older than this doctor")
        return True
    differences = facts.differences(host.help)
    if not differences:
        report.ok("built for", facts.words())
        return True
    text = " and ".join(differences)
    report.fault("built for", facts.words(), f"{plugin} was built for {text}.", _mend(host, plugin))
    return False


def check_symbols(report, host, plugin, found):
    """Is all that it leaves open in the libraries that lmp loads? True where it is, or cannot be told."""
    if not host.libraries:
        report.not_checked("symbols", "no /proc that shows what lmp loads")
        return True
    left = set(found.undefined)
    for path in [*host.libraries, host.exe]:
        try:
            left -= elf.read(path).defined
        except (OSError, ValueError):
            continue
    if not left:
        report.ok("symbols", f"all {len(found.undefined)} that the plugin needs are in lmp")
        return True
    names = sorted(left)
    if not any(path.name.startswith("liblammps") for path in host.libraries):
        report.fault("symbols", f"missing in lmp: {len(names)}", f"LAMMPS is linked into {host.exe}, and does not show plugins its symbols: plugins need "
                     "the shared library.", remedies.with_option(host.exe, "BUILD_SHARED_LIBS"))
        return False
    owner = "MPI" if re.match(r"P?MPI_|ompi_", names[0]) else "LAMMPS"
    shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    report.fault("symbols", f"missing in lmp: {shown}",
                 f"symbols that {plugin} needs are missing in this lmp ({shown}): it was built with other headers of {owner} than those of this lmp, or is damaged.",
                 _mend(host, plugin))
    return False


def check_load(report, host, plugin, given):
    """Does lmp load it and know the style? By itself where LAMMPS_PLUGIN_PATH has a plugin, else by `plugin load`."""
    own, first = host.trial.output, [path for path in host.trial.plugins() if plugins.is_evp(path)]
    if plugins.refusal(own.text) or (own.status is not None and own.status < 0):
        _does_not_load(report, host, plugin, own)
    elif first and given and _digest(first[0]) != _digest(plugin):
        report.fault("load", f"lmp has loaded {first[0]} first and ignores {plugin}",
                     f"the plugin is loaded twice: lmp takes {first[0]} from LAMMPS_PLUGIN_PATH, and ignores a later `plugin load {plugin}`.",
                     f"export LAMMPS_PLUGIN_PATH={remedies.quoted(plugin.parent)}")
    elif host.trial.knows():
        report.ok("load", "lmp loads it by itself and knows pair_style evp/lj")
    else:
        trial = lammps.try_deck(host.path, plugin, apart=True)
        if trial.knows():
            report.ok("load", "by `plugin load` lmp knows pair_style evp/lj")
        else:
            _does_not_load(report, host, plugin, trial.output)


def _does_not_load(report, host, plugin, output):
    """The line of a plugin that lmp does not load."""
    failures = plugins.open_failures(output.text)
    refusal = plugins.refusal(output.text)
    if refusal:
        text, cause = f"the plugin refuses this LAMMPS: {refusal}", f"{plugin} was built for another LAMMPS: {refusal}."
    elif failures:
        text, cause = failures[0][1], explained(plugin, failures[0][1])
        if plugins.kind_of_failure(text) == "permission":
            report.fault("load", text, cause, f"chmod a+rX {remedies.quoted(plugin)}")
            return
    elif output.status is not None and output.status < 0:
        text = f"lmp ends by signal {-output.status}"
        cause = f"lmp crashes when it loads {plugin}, as plugins of another MPI, release or integer size do."
    else:
        text = next((line for line in output.text.splitlines() if line.startswith("ERROR")), "lmp does not know pair_style evp/lj")
        cause = f"lmp loads {plugin}, but says: {text}."
    report.fault("load", text, cause, _mend(host, plugin))


def explained(plugin, text):
    """A sentence for what dlopen said."""
    return {
        "damaged": f"{plugin} is not whole: {text}.",
        "no library": f"{plugin} is no shared library: {text}.",
        "machine": f"{plugin} was built for another machine: {text}.",
        "runtime": f"{plugin} was compiled by a newer compiler than the libraries of this machine are of: {text}.",
        "MPI symbol": f"{plugin} was built for another MPI: {text}.",
        "symbol": f"{plugin} was built for another LAMMPS release, or with other options: {text}.",
        "permission": f"you may not read {plugin}: {text}.",
        "absent": f"a library that {plugin} needs is missing: {text}.",
    }.get(plugins.kind_of_failure(text), f"{plugin} cannot be opened: {text}.")


def check_age(report, host, plugin):
    """A LAMMPS that was built again since may be of the same release, and differ."""
    library = next((path for path in host.libraries if path.name.startswith("liblammps")), None)
    if library is None:
        report.not_checked("plugin age", "no file of liblammps is known")
    elif plugin.stat().st_mtime < library.stat().st_mtime:
        report.ok("plugin age", "older than liblammps: where LAMMPS was built again with other sources or options, build the plugin again")
    else:
        report.ok("plugin age", "not older than liblammps")


def check_packages(report, host, log):
    """Does this LAMMPS have what decks and pictures need beside PLUGIN?"""
    packages = host.help.packages
    if log and log.package and log.package[1] not in packages:
        style, name = log.package
        report.fault("packages", f"{name} is absent", f"the deck uses {style} of LAMMPS' package {name}, which this lmp was built without.",
                     remedies.with_option(host.exe, f"PKG_{name}"))
        return
    wanted = {name: use for name, (use, first) in WANTED.items() if host.help.number >= first}
    absent = [f"{name} is absent ({use}): add it by -DPKG_{name}=on of LAMMPS' CMake" for name, use in wanted.items() if name not in packages]
    report.ok("packages", "; ".join(absent) or "; ".join(f"{name} ({use})" for name, use in wanted.items()))


def _take(report, host, plugin):
    """Command that has LAMMPS load a plugin in which no check found a fault."""
    return f"export LAMMPS_PLUGIN_PATH={remedies.quoted(plugin.parent)}" if plugin and not report.faults() else _mend(host, plugin)


def _log_of_failure(report, host, plugin, file, text):
    """The line of a log in which a plugin did not open."""
    if plugins.kind_of_failure(text) == "absent" and not os.path.isfile(file):
        hint = "" if "/" in file else " (a name without / is looked for in the folders of libraries only)"
        cause = f"the deck says `plugin load {file}`, and there is no such file{hint}. Without that line LAMMPS takes the plugin of LAMMPS_PLUGIN_PATH."
        report.fault("log", f"{file}: no such file", cause, _take(report, host, plugin))
    else:
        report.fault("log", f"{file} did not open: {text}", explained(file, text), _take(report, host, plugin))


def check_log(report, host, plugin, log):
    """What does the log say of the run that failed?"""
    if log is None:
        report.not_checked("log", "give one by --log log.lammps")
        return
    own = lammps.release_number(host.help.release) if host and host.help else 0
    if log.release and own and lammps.release_number(log.release) != own:
        report.fault("log", f"the run was LAMMPS {log.release}", f"the run of this log was by another lmp (LAMMPS {log.release}) than {host.path} "
                     f"({host.help.release}).", remedies.in_front("PATH", host.path.parent))
    elif log.refusal:
        report.fault("log", f"the plugin refused that LAMMPS: {log.refusal}", f"the plugin of that run was built for another LAMMPS: {log.refusal}.",
                     _mend(host, plugin))
    elif log.failures:
        _log_of_failure(report, host, plugin, *log.failures[0])
    elif log.unknown and not log.loaded and log.empty:
        report.fault("log", log.empty[0], f"the log says '{log.empty[0]}': LAMMPS_PLUGIN_PATH was set in the shell or job script of that run, to a place "
                     "where LAMMPS found no plugin, and the deck has no `plugin load`.", _take(report, host, plugin))
    elif log.unknown and not log.loaded:
        report.fault("log", f"no plugin was loaded, so that {log.unknown} was not known",
                     "the run of this log loaded no plugin: LAMMPS_PLUGIN_PATH was not set in its shell or job script, and the deck has no "
                     "`plugin load`.", _take(report, host, plugin))
    elif log.unknown:
        report.fault("log", f"a plugin was loaded, but {log.unknown} is not known",
                     f"the plugin of that run does not have {log.unknown}: it is older than the deck.", _mend(host, plugin))
    elif log.twice:
        report.ok("log", "the plugin was loaded twice, and LAMMPS ignored the second: leave out `plugin load` or LAMMPS_PLUGIN_PATH")
    elif not log.ended:
        report.not_checked("log", "it breaks off without an error: lmp crashed or was stopped. If that was at `plugin load FILE`, give --plugin FILE")
    else:
        told = f"; before that it warned: {log.warning}" if log.warning else ""
        report.ok("log", f"no fault of the installation; it ends with: {log.error}{told}" if log.error and not log.package else "no fault of the installation")
