# SPDX-License-Identifier: GPL-2.0-only
"""What a program or shared library says of itself: machine, libraries that it needs, symbols. Read without binutils."""

import os
import pathlib
import stat
import struct
from dataclasses import dataclass

MACHINES = {3: "i386", 21: "ppc64", 22: "s390", 40: "arm", 62: "x86_64", 183: "aarch64", 243: "riscv", 258: "loongarch"}
_NEEDED, _RPATH, _RUNPATH = 1, 15, 29  # tags of the dynamic section
_DYNAMIC, _NOBITS, _DYNSYM = 6, 8, 11  # types of sections
_WEAK = 2


class ElfError(ValueError):
    """A file that is no ELF file, or not a whole one; the text says which."""


@dataclass(frozen=True)
class Elf:
    """Names are without versions. folders: those of RUNPATH and RPATH, $ORIGIN put in."""

    path: pathlib.Path
    machine: str
    bits: int
    needed: tuple
    folders: tuple
    defined: frozenset
    undefined: frozenset  # without weak ones, which may stay open


def _text(strings, at):
    return strings[at:strings.index(b"\0", at)].decode("utf-8", "replace")


def _sections(source, size, order, wide):
    """(type, offset, size, link) of each section; ElfError where one lies beyond the end of the file."""
    source.seek(40 if wide else 32)
    (start,) = struct.unpack(order + ("Q" if wide else "I"), source.read(8 if wide else 4))
    source.seek(58 if wide else 46)
    each, count = struct.unpack(order + "HH", source.read(4))
    if start + each * count > size:
        raise ElfError(f"is not whole: it ends after {size} bytes, and its table of sections is at {start}")
    source.seek(start)
    form = order + ("IIQQQQIIQQ" if wide else "10I")
    table = source.read(each * count)
    for k in range(count):
        words = struct.unpack_from(form, table, k * each)
        kind, offset, length, link = words[1], words[4], words[5], words[6]
        if kind != _NOBITS and offset + length > size:
            raise ElfError(f"is not whole: it ends after {size} bytes, in the middle of a section")
        yield kind, offset, length, link


def _read(source, section):
    source.seek(section[1])
    return source.read(section[2])


def read(path):
    """The Elf of a file; ElfError where it is none, OSError where it cannot be read."""
    path = pathlib.Path(path)
    state = path.stat()
    if not stat.S_ISREG(state.st_mode):  # a pipe would be waited for
        raise ElfError("is no file")
    size = state.st_size
    with open(path, "rb") as source:
        head = source.read(64)
        if not head:
            raise ElfError("is empty")
        if head[:4] != b"\x7fELF":
            raise ElfError("is no shared library or program (no ELF file)")
        if len(head) < 64:
            raise ElfError(f"is not whole: it ends after {size} bytes")
        wide, order = head[4] == 2, "<" if head[5] == 1 else ">"
        (machine,) = struct.unpack_from(order + "H", head, 18)
        sections = list(_sections(source, size, order, wide))
        needed, folders, defined, undefined = [], [], set(), set()
        for section in sections:
            if section[0] not in (_DYNAMIC, _DYNSYM) or section[3] >= len(sections):
                continue
            strings, table = _read(source, sections[section[3]]), _read(source, section)
            if section[0] == _DYNAMIC:
                for tag, value in struct.iter_unpack(order + ("qQ" if wide else "iI"), table):
                    if tag == _NEEDED:
                        needed.append(_text(strings, value))
                    elif tag in (_RPATH, _RUNPATH):
                        folders += _text(strings, value).split(":")
            else:
                for words in struct.iter_unpack(order + ("IBBHQQ" if wide else "IIIBBH"), table):
                    info, index = (words[1], words[3]) if wide else (words[3], words[5])
                    if index:
                        defined.add(_text(strings, words[0]))
                    elif words[0] and info >> 4 != _WEAK:
                        undefined.add(_text(strings, words[0]))
    origin = str(path.resolve().parent)
    folders = [folder.replace("${ORIGIN}", origin).replace("$ORIGIN", origin) for folder in folders if folder]
    return Elf(path, MACHINES.get(machine, f"machine {machine}"), 64 if wide else 32, tuple(needed), tuple(folders),
               frozenset(defined), frozenset(undefined))


def own_machine():
    """Machine of the running kernel, by the same words."""
    machine = os.uname().machine
    return {"i686": "i386", "armv7l": "arm", "ppc64le": "ppc64", "riscv64": "riscv", "s390x": "s390"}.get(machine, machine)
