"""Compiled templates of pages and sentences, kept in the user's cache for the next process.

What is kept there is executed when it is read, so nobody else may write to the folder.
"""

import contextlib

from jinja2 import FileSystemBytecodeCache
from jinja2.bccache import Bucket

from sandmould.kernel_cache import is_own
from sandmould.user_cache import user_cache


class _Kept(FileSystemBytecodeCache):
    """Keeps a template where the disk takes it."""

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Write it, or leave it to be compiled again."""
        with contextlib.suppress(OSError):
            super().dump_bytecode(bucket)


def kept_templates() -> FileSystemBytecodeCache | None:
    """The cache of an environment of Jinja; None where there is no folder of one's own."""
    folder = user_cache() / "templates"
    return _Kept(str(folder)) if is_own(folder) else None
