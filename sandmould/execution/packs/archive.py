"""The file of a pack: a tar archive in xz, its index first, read without trust.

Anybody's ``tar`` shows and unpacks it. Ours reads no more of the format than it writes: plain files
in the order of the index, so that no link, device or longer name can be meant by a header.
"""

from __future__ import annotations

import hashlib
import lzma
import tarfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sandmould.execution.packs.index import (
    INDEX_FILE,
    MOST_INDEX_BYTES,
    Member,
    PackedFile,
    PackIndex,
    index_text,
    read_index,
)
from sandmould.runs.files import replaced

_BLOCK = 512
_CHUNK = 1 << 20
_PRESET = 3
"""Of xz: 6 packs a study of ours 2 % smaller and takes half as long again."""
_MEMORY_BYTES = 1 << 28
"""That unpacking may take: xz lets a file ask for gigabytes."""
_MOST_SWELLING = 2000
"""Bytes unpacked for one of the pack; our tables come to 10, a file of zeros to 7000."""
_SLACK_BYTES = 10**7


@dataclass(frozen=True)
class Source:
    """Where the bytes of a file that is packed come from."""

    path: Path | None = None
    text: bytes = b""
    """Where it is no file as it is."""

    def chunks(self) -> Iterator[bytes]:
        """All bytes in turn."""
        if self.path is None:
            yield self.text
            return
        with self.path.open("rb") as file:
            while chunk := file.read(_CHUNK):
                yield chunk

    def packed(self) -> PackedFile:
        """Size and hash."""
        hashed, size = hashlib.sha256(), 0
        for chunk in self.chunks():
            hashed.update(chunk)
            size += len(chunk)
        return PackedFile(size=size, sha256=hashed.hexdigest())


def write_archive(index: PackIndex, source_of: Callable[[Member], Source], path: Path) -> None:
    """Write a pack; the same runs come to the same bytes.

    Raises
    ------
    ValueError
        When a file's name is too long, or it changed since it was listed.
    """
    text = index_text(index).encode()
    with replaced(path) as partial, lzma.open(partial, "wb", preset=_PRESET) as out:
        out.write(_head(f"{index.study}/{INDEX_FILE}", len(text)))
        out.write(_padded(text))
        for member in index.members():
            out.write(_head(member.name(index.study), member.file.size))
            size, hashed = 0, hashlib.sha256()
            for chunk in source_of(member).chunks():
                out.write(chunk)
                hashed.update(chunk)
                size += len(chunk)
            if (size, hashed.hexdigest()) != (member.file.size, member.file.sha256):
                raise ValueError(f"{member.name(index.study)} changed while it was packed")
            out.write(b"\0" * (-size % _BLOCK))
        out.write(b"\0" * 2 * _BLOCK)


def _head(name: str, size: int) -> bytes:
    """Header of a file: no owner, no time."""
    info = tarfile.TarInfo(name)
    info.size, info.mode = size, 0o644
    return info.tobuf(tarfile.USTAR_FORMAT)


def _padded(text: bytes) -> bytes:
    return text + b"\0" * (-len(text) % _BLOCK)


class Archive:
    """A pack that is read from its beginning to its end, once."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        """Read the index.

        Raises
        ------
        ValueError
            With what is wrong, in a few words.
        """
        self._file = file
        self._unpack = lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_MEMORY_BYTES)
        self._most = _MOST_SWELLING * path.stat().st_size + _SLACK_BYTES
        self._given = 0
        name, size = self._next_head()
        study = name.removesuffix(f"/{INDEX_FILE}")
        if name == study or size > MOST_INDEX_BYTES:
            raise ValueError("it does not begin with an index")
        text = b"".join(self._body(size))
        self.index = read_index(text)
        if self.index.study != study:
            raise ValueError("its index names another study than its files")

    def members(self) -> Iterator[tuple[Member, Iterator[bytes]]]:
        """Files in the order of the index, each with its bytes, all of which must be taken.

        Raises
        ------
        ValueError
            Where the archive is cut short or is not what its index says. Bytes that were given
            before are those of a damaged file then.
        """
        for member in self.index.members():
            if self._next_head() != (member.name(self.index.study), member.file.size):
                raise ValueError(f"{member.path!r} is not where its index says")
            yield member, self._checked(member)

    def _checked(self, member: Member) -> Iterator[bytes]:
        hashed = hashlib.sha256()
        for chunk in self._body(member.file.size):
            hashed.update(chunk)
            yield chunk
        if hashed.hexdigest() != member.file.sha256:
            raise ValueError(f"{member.path!r} does not match its hash")

    def _next_head(self) -> tuple[str, int]:
        """Name and size of the file that follows; of a plain file alone."""
        block = self._exactly(_BLOCK)
        try:
            info = tarfile.TarInfo.frombuf(block, "utf-8", "strict")
        except (tarfile.HeaderError, ValueError):
            raise ValueError("it is no archive of ours or damaged") from None
        if info.type != tarfile.REGTYPE or info.linkname:
            raise ValueError(f"{info.name[:200]!r} in it is no plain file")
        return info.name, info.size

    def _body(self, size: int) -> Iterator[bytes]:
        left = size
        while left > 0:
            chunk = self._exactly(min(left, _CHUNK))
            left -= len(chunk)
            yield chunk
        self._exactly(-size % _BLOCK)

    def _exactly(self, number: int) -> bytes:
        parts, left = [], number
        while left > 0:
            part = self._more(left)
            parts.append(part)
            left -= len(part)
        return b"".join(parts)

    def _more(self, most: int) -> bytes:
        """Some unpacked bytes, at least one."""
        while True:
            if self._unpack.eof:
                raise ValueError("it ends before its last file")
            packed = self._file.read(_CHUNK // 16) if self._unpack.needs_input else b""
            if self._unpack.needs_input and not packed:
                raise ValueError("it is cut short")
            try:
                part = self._unpack.decompress(packed, most)
            except lzma.LZMAError as error:
                raise ValueError(f"it cannot be unpacked: {error}") from None
            self._given += len(part)
            if self._given > self._most:
                raise ValueError("it swells to more than any pack of runs does")
            if part:
                return part
