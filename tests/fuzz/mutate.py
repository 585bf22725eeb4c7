"""Damage files as people, disks and other programs do: cut short, flipped, spliced, swollen.

Archives and pictures are also damaged inside and closed again with the right checksums, or no
damage would get past the outermost check.
"""

from __future__ import annotations

import io
import json
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence

from sandmould.digest import digest

ODD_NUMBERS = (
    b"0", b"-1", b"1", b"nan", b"inf", b"-inf", b"1e308", b"-1e-320", b"9" * 40, b"2147483648",
    b"18446744073709551616", b"0x10", b"1_000", b"1e", b"", b"1.5.2", b"\xd9\xa3",
)  # fmt: skip
ODD_WORDS = (
    b"null", b"true", b"[]", b"{}", b"''", b"!!python/object/apply:os.system ['true']", b"&a",
    b"*a", b"<<: *a", b"- ", b": ", b"\t", b"\x00", b"\r\n", b"../../../../../etc/passwd",
    b"\xff\xfe", b"{{ 7*7 }}", b"$(true)", b"<script>", b"%n%s", "\u202e\U0001f4a5".encode(),
)  # fmt: skip
ODD_BYTES = (0, 1, 0x7F, 0x80, 0xFF)
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_MOST_BYTES = 300_000
PACKED = "manifest.json"
"""List of the files of a pack of runs, with their sizes and hashes."""
Mutation = Callable[[bytes, random.Random], bytes]


def mutated(data: bytes, others: Sequence[bytes], chance: random.Random) -> bytes:
    """One damaged file.

    Parameters
    ----------
    data : bytes
        A sound file.
    others : sequence of bytes
        More files of its kind, to splice with.
    chance : random.Random
    """
    if data[:2] == b"PK" and chance.random() < 0.7:
        return _archive(data, chance)
    if data[:8] == b"\x89PNG\r\n\x1a\n" and chance.random() < 0.7:
        return _picture(data, chance)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        if chance.random() < 0.1:
            other = chance.choice(others)
            data = data[: _place(data, chance)] + other[_place(other, chance) :]
        else:
            data = chance.choice(_TEXT if _is_text(data) else _BINARY)(data, chance)
    return data[:_MOST_BYTES]


def _is_text(data: bytes) -> bool:
    return b"\x00" not in data[:200]


def _place(data: bytes, chance: random.Random) -> int:
    return chance.randrange(len(data) + 1)


def _cut(data: bytes, chance: random.Random) -> bytes:
    return data[: _place(data, chance)]


def _flip(data: bytes, chance: random.Random) -> bytes:
    if not data:
        return data
    swapped = bytearray(data)
    for _ in range(chance.choice((1, 1, 4, 16))):
        swapped[chance.randrange(len(data))] = chance.choice((*ODD_BYTES, chance.randrange(256)))
    return bytes(swapped)


def _remove(data: bytes, chance: random.Random) -> bytes:
    a, b = sorted((_place(data, chance), _place(data, chance)))
    return data[:a] + data[min(b, a + 64) :]


def _repeat(data: bytes, chance: random.Random) -> bytes:
    a, b = sorted((_place(data, chance), _place(data, chance)))
    return data[:b] + data[a:b] * chance.choice((1, 2, 50)) + data[b:]


def _integer(data: bytes, chance: random.Random) -> bytes:
    """A count or an offset that is far off."""
    kind = chance.choice("iIqdf")
    value = chance.choice((0, 1, -1, 2**31 - 1, -(2**31)))
    if kind == "I":
        value = chance.choice((0, 1, 2**32 - 1, 2**31))
    packed = struct.pack("<" + kind, value)
    at = _place(data, chance)
    return data[:at] + packed + data[at + len(packed) :]


def _odd_number(data: bytes, chance: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return _odd_word(data, chance)
    at = chance.choice(found)
    return data[: at.start()] + chance.choice(ODD_NUMBERS) + data[at.end() :]


def _odd_word(data: bytes, chance: random.Random) -> bytes:
    at = _place(data, chance)
    return data[:at] + chance.choice(ODD_WORDS) + data[at:]


def _lines(data: bytes, chance: random.Random) -> bytes:
    """A line lost, doubled, swapped with another, or shifted."""
    lines = data.split(b"\n")
    one, two = chance.randrange(len(lines)), chance.randrange(len(lines))
    how = chance.randrange(4)
    if how == 0:
        del lines[one]
    elif how == 1:
        lines.insert(two, lines[one])
    elif how == 2:
        lines[one], lines[two] = lines[two], lines[one]
    else:
        lines[one] = b"  " + lines[one] if chance.random() < 0.5 else lines[one].strip()
    return b"\n".join(lines)


def _deep(data: bytes, chance: random.Random) -> bytes:
    """Brackets within brackets, as a file that is nested without end."""
    at, open_, close = _place(data, chance), *chance.choice((b"[]", b"{}", b"()"))
    depth = chance.choice((20, 2000))
    return data[:at] + bytes([open_]) * depth + bytes([close]) * depth + data[at:]


_BINARY: tuple[Mutation, ...] = (_cut, _flip, _flip, _integer, _integer, _remove, _repeat)
_TEXT: tuple[Mutation, ...] = (
    _cut, _flip, _odd_number, _odd_number, _odd_number, _odd_word, _lines, _lines, _remove, _repeat,
    _deep,
)  # fmt: skip


def _archive(data: bytes, chance: random.Random) -> bytes:
    """An archive with one of its parts damaged, gone, renamed or exchanged."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(list(parts))
    how = chance.randrange(4)
    if how == 0:
        del parts[name]
    elif how == 1:
        parts[name] = parts[chance.choice(list(parts))]
    elif how == 2:
        parts["other_" + name] = parts.pop(name)
    else:
        parts[name] = chance.choice(_BINARY + _TEXT)(parts[name], chance)
    if PACKED in parts and chance.random() < 0.7:
        parts[PACKED] = _listed_again(parts)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for part, content in parts.items():
            archive.writestr(zipfile.ZipInfo(part), content)  # without the time of day
    return file.getvalue()


def _listed_again(parts: dict[str, bytes]) -> bytes:
    """List of the files of a pack with the sizes and hashes that they have now."""
    try:
        listed = json.loads(parts[PACKED])
        listed["files"] = {
            name.partition("/")[2]: {"size": len(part), "sha256": digest(part)}
            for name, part in parts.items()
            if name != PACKED
        }
    except (ValueError, TypeError, RecursionError):
        return parts[PACKED]
    return json.dumps(listed).encode()


def _picture(data: bytes, chance: random.Random) -> bytes:
    """A PNG file with one chunk damaged, its checksum right again."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        chunks.append([data[at + 4 : at + 8], data[at + 8 : at + 8 + length]])
        at += 12 + length
    chosen = chance.choice(chunks)
    chosen[1] = chance.choice(_BINARY)(chosen[1], chance)
    return data[:8] + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    )
