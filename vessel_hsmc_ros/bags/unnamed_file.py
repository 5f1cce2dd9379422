"""Bytes that grow with a recording, kept on its disk instead of in memory."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PIECE = 64 * 1024
"""Bytes that are read at once."""


class FileRange(NamedTuple):
    """Bytes that lie in a file, for writing them into another one without holding all of them in memory."""

    fd: int
    start: int
    size: int

    def pieces(self) -> Iterator[bytes]:
        """The bytes, in pieces."""
        end = self.start + self.size
        return (os.pread(self.fd, min(PIECE, end - at), at) for at in range(self.start, end, PIECE))


class UnnamedFile:
    """A file without a name, which exists for as long as this object, also if its process is killed.

    Args:
        directory: A folder on the disk that it lies on.

    Raises:
        OSError: from `append`, too, when the operating system refuses to write.
    """

    def __init__(self, directory: Path) -> None:
        self._file = tempfile.TemporaryFile(dir=directory)  # noqa: SIM115 - closed when this object goes
        self._size = 0

    def append(self, data: bytes) -> None:
        """Add bytes at the end."""
        self._file.write(data)
        self._file.flush()
        self._size += len(data)

    @property
    def content(self) -> FileRange:
        """All bytes so far."""
        return FileRange(self._file.fileno(), 0, self._size)

    def close(self) -> None:
        """Close the file, whose bytes are then lost."""
        self._file.close()
