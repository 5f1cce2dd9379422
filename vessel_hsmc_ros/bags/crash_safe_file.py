"""A crash-consistent MCAP file: it is valid after every single system call, so that its writer may be killed at any moment.

    [data][reserve ... | summary slot 0 | summary slot 1][end of data][footer][magic]

The reserve is a record with a private opcode, which readers skip. New data are written into it, still hidden by its header, and
become visible when the nine bytes of their first record's header replace those of the reserve. A new summary is written into
the slot that is not in use, and becomes valid when the footer is pointed to it. Such headers and the footer never cross a page
boundary, so that the operating system writes each of them entirely or not at all, even for a process that is being killed.
"""

import fcntl
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from mcap.opcode import Opcode

from vessel_hsmc_ros.bags.mcap_layout import DATA_END, FIRST_PRIVATE, FOOTER, MAGIC, RECORD_HEADER

PAGE = 4096
HEADER = RECORD_HEADER.size

LEAST_RESERVE, RESERVE_SHARE = 128 * 1024, 8
"""A reserve that is too small is extended to this many bytes, or to this fraction of the file if that is more."""

_RESERVE, _SPACER, _FILLER = FIRST_PRIVATE, FIRST_PRIVATE + 1, FIRST_PRIVATE + 2

TRAILER = len(DATA_END) + FOOTER.size + len(MAGIC)


class CrashSafeFile:
    """A new MCAP file that grows by complete records.

    After a method has failed the file on the disk is valid, but its further layout is unknown: nothing but `abandon` is
    allowed. `path`: the file, which must not exist. `start`: its first bytes.

    Attributes:
        end: Offset at which the next record will lie.

    Raises:
        OSError: from every method, when the operating system refuses to write. A file that cannot be begun is removed.
    """

    def __init__(self, path: Path, start: bytes) -> None:
        self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)  # as long as it is written; a killed process leaves none behind
        self.end = len(start)
        self._slots = self._slot_size = self._trailer = 0
        self._summary: tuple[int, int] | None = None
        try:
            self._write([start], 0)
            self._extend(0, 0)
        except OSError:
            self.abandon()
            with suppress(OSError):
                path.unlink()  # without an end it is no MCAP file, and would make the bag unreadable
            raise

    def append(self, parts: Sequence[bytes]) -> None:
        """Add complete records after the present ones; the first part begins with a record's header."""
        size = sum(map(len, parts))
        if self.end + size + PAGE > self._slots:
            self._extend(size, 0)
        new_end = self.end + size
        filler = b""
        if 0 < (gap := -new_end % PAGE) < HEADER:  # the reserve's header would cross a page boundary
            filler = RECORD_HEADER.pack(_FILLER, gap) + bytes(gap)
            new_end += len(filler)
        first, *others = parts
        # All but the first header goes in while the old header still hides it; the header then shows everything at once.
        self._write([memoryview(first)[HEADER:], *others, filler, self._reserve(new_end)], self.end + HEADER)
        self._write([first[:HEADER]], self.end)
        self.end = new_end

    def set_summary(self, summary: bytes) -> None:
        """Replace the summary, for readers that begin at the end of the file."""
        if len(DATA_END) + len(summary) + HEADER > self._slot_size:
            self._extend(0, len(summary))
        first_in_use = self._summary is not None and self._summary[0] < self._slots + self._slot_size
        self._write_summary(summary, self._slots + (self._slot_size if first_in_use else 0))

    def close(self, parts: Sequence[bytes]) -> None:
        """Replace reserve and slots by the final records, and close the file."""
        ending = b"".join(parts)
        try:
            if self.end + len(ending) > self._slots:
                self._extend(len(ending), 0)
            self._write([ending[HEADER:]], self.end + HEADER)
            self._write([ending[:HEADER]], self.end)
            os.ftruncate(self._fd, self.end + len(ending))
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Leave the file as it is, and release its descriptor, if that has not been done."""
        # The number is forgotten first: the operating system gives it to the next file that is opened.
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with suppress(OSError):  # it is released all the same
                os.close(fd)

    def _extend(self, data_size: int, summary_size: int) -> None:
        """Enlarge reserve and slots behind the present trailer; the summary moves along."""
        summary = self._summary and os.pread(self._fd, self._summary[1], self._summary[0])
        reserve = max(LEAST_RESERVE, 2 * data_size, self.end // RESERVE_SHARE)
        self._slot_size = max(self._slot_size, _pages(2 * summary_size + PAGE), 4 * PAGE)
        after = self._trailer + TRAILER if self._trailer else 0
        self._slots = max(_pages(self.end + HEADER + reserve), after)
        self._trailer = self._slots + 2 * self._slot_size + PAGE - TRAILER
        self._write([DATA_END, self._footer(), MAGIC], self._trailer)
        if summary:
            self._write_summary(summary, self._slots)
        self._write([self._reserve(self.end)], self.end)  # last: until now the old trailer was the file's valid end

    def _write_summary(self, summary: bytes, slot: int) -> None:
        """Write a summary into an unused slot, preceded by a DataEnd record, and point the footer to it."""
        start = slot + len(DATA_END)
        rest = self._trailer + len(DATA_END) - start - len(summary) - HEADER
        self._write([DATA_END, summary, RECORD_HEADER.pack(_SPACER, rest)], slot)
        self._summary = start, len(summary)
        self._write([self._footer()], self._trailer + len(DATA_END))

    def _footer(self) -> bytes:
        return FOOTER.pack(Opcode.FOOTER, FOOTER.size - HEADER, self._summary[0] if self._summary else 0, 0, 0)

    def _reserve(self, start: int) -> bytes:
        return RECORD_HEADER.pack(_RESERVE, self._trailer - start - HEADER)

    def _write(self, parts: Sequence[bytes | memoryview], offset: int) -> None:
        """Write parts one after the other, by one call of the operating system."""
        data = b"".join(parts)
        while data:
            written = os.pwrite(self._fd, data, offset)
            data, offset = data[written:], offset + written


def is_being_written(path: Path) -> bool:
    """Whether a process has this file open as a CrashSafeFile."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    return False


def _pages(size: int) -> int:
    """A size rounded up to a multiple of PAGE."""
    return -(-size // PAGE) * PAGE
