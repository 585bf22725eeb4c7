"""Triangles of an STL file, ASCII or binary, as CAD programs and scripts write it."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.drawing_file import MeshFileError, check_numbers

Array = NDArray[np.float64]
_HEAD, _TRIANGLE = 84, np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("color", "<u2")])
"""Bytes before the first triangle of a binary file, the last four its number of triangles."""
_FACET = re.compile(rb"(?i)\bfacet\s+(?:normal|outer)\b")
_CORNER = re.compile(rb"(?i)\bvertex\b\s+(\S+)\s+(\S+)\s+(\S+)")
_OTHERS = {
    b"ISO-10303-21": "a STEP file, whose name ends in .step",
    b"PK\x03\x04": "an archive or a 3MF file, whose name ends in .3mf",
    b"\x1f\x8b": "packed by gzip",
    b"version https://git-lfs": "a pointer of Git LFS to a file that was not fetched",
    b"<": "a web page or XML",
    b"\xff\xfe": "text in UTF-16, to be saved in UTF-8",
    b"\xfe\xff": "text in UTF-16, to be saved in UTF-8",
}
"""What a file is that begins so."""


def read_stl(path: Path) -> Array:
    """Corners of the triangles of a file, (nt, 3, 3) float64, in its unit.

    Text is read by its words ``facet`` and ``vertex`` alone: case, blanks, line ends, names,
    further solids and how the end is spelled do not count.

    Raises
    ------
    MeshFileError
        With place and cause where it cannot be read.
    """
    content = path.read_bytes()
    number = int.from_bytes(content[_HEAD - 4 : _HEAD], "little")
    there = max(len(content) - _HEAD, 0) // _TRIANGLE.itemsize
    is_text = b"\0" not in content[:_HEAD]
    if not is_text and 0 < number <= there:
        with np.errstate(invalid="ignore"):  # what is no number is told below
            corners = np.frombuffer(content, _TRIANGLE, number, _HEAD)["corner"].astype(np.float64)
    else:
        for start, what in _OTHERS.items():
            if content.startswith(start):
                raise MeshFileError(f"an STL file; this one is {what}")
        if not is_text and number + there > 0:
            tells = f"its head tells {number:,} triangles, and {there:,} are there"
            raise MeshFileError(
                f"an STL file that is whole; this one is cut or no STL file: {tells}"
            )
        corners = _corners_in(content)
        if is_text and not content.lstrip().lower().startswith(b"solid") and not len(corners):
            raise MeshFileError(
                "an STL file, ASCII or binary, or one of OBJ, PLY, 3MF or STEP whose name ends so"
            )
    if not len(corners):
        raise MeshFileError("an STL file with triangles; here are none")
    check_numbers(corners, "triangle")
    return corners


def _corners_in(text: bytes) -> Array:
    """Corners of the facets of a text, (nt, 3, 3) float64."""
    starts = [found.end() for found in _FACET.finditer(text)]
    numbers: list[float] = []
    for start, end in pairwise([*starts, len(text)]):
        corners = _CORNER.findall(text, start, end)
        if len(corners) != 3:
            ends = ", and the file ends there" if end == len(text) and len(corners) < 3 else ""
            raise MeshFileError(
                f"facets of three corners; that of {_line(text, start)} has {len(corners)}{ends}"
            )
        try:
            numbers.extend([float(x) for corner in corners for x in corner])
        except ValueError as fault:
            wrong = str(fault).rsplit(": ", 1)[-1].removeprefix("b")
            raise MeshFileError(
                f"corners of three numbers with decimal points; the facet of {_line(text, start)} "
                f"has {wrong}"
            ) from fault
    return np.array(numbers).reshape(-1, 3, 3)


def _line(text: bytes, place: int) -> str:
    return f"line {len(text[:place].splitlines())}"
