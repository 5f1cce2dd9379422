"""A file that is a whole MCAP file after every single system call, so that it may be left behind at any moment.

    [data][hole ... | summary slot 0 | summary slot 1][end of data][footer][closing mark]

The hole is a record of a private kind, which readers skip. New data is written into it out of sight, and comes into sight when
the nine bytes of its first record's head are put in place of the hole's. A new summary goes into the slot that is not in use,
and into use when the footer is told where it is. Such heads and the footer never lie across the border of a page, so that the
operating system writes each of them at once or not at all, even for a process that is being killed.
"""

import os
import struct
from collections.abc import Sequence
from pathlib import Path

from mcap.opcode import Opcode

from vessel_hsmc_ros.bags.mcap_scan import DATA_END, MAGIC, PRIVATE, RECORD_HEADER

Bytes = bytes | bytearray

PAGE = 4096
HEAD = RECORD_HEADER.size
LEAST_ROOM, ROOM_SHARE = 128 * 1024, 8
"""Where the hole is too small it is made this large, or as large as this fraction of the file."""

_HOLE, _SPACER, _FILLER = PRIVATE, PRIVATE + 1, PRIVATE + 2
_FOOTER = struct.Struct("<BQQQI")

TRAILER = len(DATA_END) + _FOOTER.size + len(MAGIC)


class GrowingFile:
    """A new MCAP file that grows by whole records.

    Args:
        path: The file, which must not exist.
        start: Its first bytes.

    Attributes:
        end: Where the next record will lie.

    Raises:
        OSError: from every method, when the operating system does not take what is written.
    """

    def __init__(self, path: Path, start: bytes) -> None:
        self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self.end = len(start)
        self._slots = self._slot_size = self._trailer = 0
        self._summary: tuple[int, int] | None = None
        self._put([start], 0)
        self._grow(0, 0)

    def append(self, parts: Sequence[Bytes]) -> None:
        """Whole records after those that are there."""
        size = sum(map(len, parts))
        if self.end + size + PAGE > self._slots:
            self._grow(size, 0)
        behind = self.end + size
        filler = b""
        if 0 < (gap := -behind % PAGE) < HEAD:  # the hole's head would lie across the border of a page
            filler = RECORD_HEADER.pack(_FILLER, gap) + bytes(gap)
            behind += len(filler)
        first, *others = parts
        self._put([memoryview(first)[HEAD:], *others, filler, self._hole(behind)], self.end + HEAD)
        self._put([first[:HEAD]], self.end)
        self.end = behind

    def set_summary(self, parts: Sequence[Bytes]) -> None:
        """The summary of all there is so far, for readers that begin at the end."""
        size = sum(map(len, parts))
        if len(DATA_END) + size + HEAD > self._slot_size:
            self._grow(0, size)
        used = self._summary is not None and self._summary[0] < self._slots + self._slot_size
        self._show(parts, self._slots + (self._slot_size if used else 0))

    def close(self, parts: Sequence[Bytes]) -> None:
        """Put the ending in place of hole and slots, and close the file."""
        size = sum(map(len, parts))
        try:
            if self.end + size > self._slots:
                self._grow(size, 0)
            self._put([b"".join(parts)[HEAD:]], self.end + HEAD)
            self._put([b"".join(parts)[:HEAD]], self.end)
            os.ftruncate(self._fd, self.end + size)
        finally:
            os.close(self._fd)

    def _grow(self, data_size: int, summary_size: int) -> None:
        """Make hole and slots larger; the summary moves along."""
        old = self._summary and os.pread(self._fd, self._summary[1], self._summary[0])
        room = max(LEAST_ROOM, 2 * data_size, self.end // ROOM_SHARE)
        self._slot_size = max(self._slot_size, _pages(2 * summary_size + PAGE), 4 * PAGE)
        after = self._trailer + TRAILER if self._trailer else 0
        self._slots = max(_pages(self.end + HEAD + room), after)
        self._trailer = self._slots + 2 * self._slot_size + PAGE - TRAILER
        self._put([DATA_END, self._footer(), MAGIC], self._trailer)
        if old:
            self._show([old], self._slots)
        self._put([self._hole(self.end)], self.end)

    def _show(self, parts: Sequence[Bytes], slot: int) -> None:
        """Write a summary into a slot that is not in use, behind a mark of the data's end, and let the footer point to it."""
        size = sum(map(len, parts))
        at = slot + len(DATA_END)
        rest = self._trailer + len(DATA_END) - at - size - HEAD
        self._put([DATA_END, *parts, RECORD_HEADER.pack(_SPACER, rest)], slot)
        self._summary = at, size
        self._put([self._footer()], self._trailer + len(DATA_END))

    def _footer(self) -> bytes:
        return _FOOTER.pack(Opcode.FOOTER, _FOOTER.size - HEAD, self._summary[0] if self._summary else 0, 0, 0)

    def _hole(self, at: int) -> bytes:
        return RECORD_HEADER.pack(_HOLE, self._trailer - at - HEAD)

    def _put(self, parts: Sequence[Bytes | memoryview], offset: int) -> None:
        data = b"".join(parts)
        done = 0
        while done < len(data):
            done += os.pwrite(self._fd, data[done:], offset + done)


def _pages(size: int) -> int:
    """A size rounded up to whole pages."""
    return -(-size // PAGE) * PAGE
