# SPDX-License-Identifier: GPL-2.0-only
"""What programs write as STL: all in capitals, with the lines of Windows, ASCII words in front of a binary file."""

import numpy as np
import pytest
from evp.stl import read_stl, write_ascii_stl, write_stl

TETRAHEDRON = np.array([[[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
                        [[1, 0, 0], [0, 1, 0], [0, 0, 1]]], dtype=float) / 8.0


@pytest.mark.parametrize("change", [bytes.upper, bytes.lower, lambda raw: raw.replace(b"\n", b"\r\n"), lambda raw: b" \n" + raw])
def test_ascii(tmp_path, change):
    path = tmp_path / "part.stl"
    write_ascii_stl(path, TETRAHEDRON)
    path.write_bytes(change(path.read_bytes()))
    assert np.array_equal(read_stl(path), TETRAHEDRON)


def test_binary_that_begins_as_ascii_does(tmp_path):
    path = tmp_path / "part.stl"
    write_stl(path, TETRAHEDRON)
    path.write_bytes(b"solid vertex".ljust(80) + path.read_bytes()[80:])
    assert np.array_equal(read_stl(path), TETRAHEDRON)


@pytest.mark.parametrize("raw", [b"", b"solid", b"solid a\nendsolid a\n", b"solid a vertex 1 2", bytes(84), bytes(133)])
def test_no_triangle(tmp_path, raw):
    path = tmp_path / "part.stl"
    path.write_bytes(raw)
    with pytest.raises(ValueError, match="export the part as STL again"):
        read_stl(path)
