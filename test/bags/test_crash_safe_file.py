"""A bag's file is valid after every system call, and after every page of a call that SIGKILL cut short."""

import io
import os
import random
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bag_making import made_run, write_run
from durations import rest_long
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Header, Metadata
from mcap.stream_reader import StreamReader

from vessel_hsmc_ros.bags import mcap_writer
from vessel_hsmc_ros.bags.mcap_contents import DATA_END, FOOTER, MAGIC, scan
from vessel_hsmc_ros.bags.mcap_writer import HEADER, PAGE, CrashSafeFile
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import BagWriter

STEPS = 120

Calls = list[tuple[bytes | None, int]]


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """The writing system calls on named files in order: bytes and offset, or None and a new size."""
    made: Calls = []

    class Watched:
        """The operating system, as the module under test sees it."""

        def __getattr__(self, name: str) -> Any:
            return getattr(os, name)

        def pwrite(self, fd: int, data: bytes, offset: int) -> int:
            if not str(Path(f"/proc/self/fd/{fd}").readlink()).endswith("(deleted)"):  # as that of the index of chunks is
                made.append((bytes(data), offset))
            return os.pwrite(fd, data, offset)

        def ftruncate(self, fd: int, size: int) -> None:
            made.append((None, size))
            os.ftruncate(fd, size)

    monkeypatch.setattr(mcap_writer, "os", Watched())
    return made


def states(calls: Calls, begun: bytearray | None = None) -> Iterator[bytearray]:
    """The file's content after every page of every call, from what calls before have begun, which goes on too."""
    content = bytearray() if begun is None else begun
    for data, offset in calls:
        if data is None:
            del content[offset:]
            yield content
            continue
        position = 0
        while position < len(data):
            size = min(len(data) - position, PAGE - (offset + position) % PAGE)
            content.extend(bytes(max(0, offset + position + size - len(content))))
            content[offset + position : offset + position + size] = data[position : position + size]
            position += size
            yield content


def count_by_stream(path: Path) -> int:
    with path.open("rb") as stream:
        return sum(1 for _ in NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False))


def count_by_index(path: Path) -> int:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.chunk_indexes
        return sum(1 for _ in reader.iter_messages())


@pytest.mark.parametrize("compression", rest_long(["none", "zstd"]))
def test_after_every_page_written_the_file_is_valid_and_has_no_fewer_messages_than_before(
    tmp_path: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch, compression: str
) -> None:
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", 64 * 1024)
    writer = BagWriter(tmp_path / "bag", compression)
    writer.attach("scenario.yaml", "a text\n" * 1000)
    write_run(None, STEPS, writer=writer)
    path = tmp_path / "left.mcap"
    found, a_chunk = [], 250
    for number, content in enumerate(states(calls)):
        if not content.endswith(MAGIC):
            assert number < 3  # the file has only been begun
            continue
        path.write_bytes(content)
        contents = scan(path)
        found.append(contents.counts.total())
        if number % 5 == 0:  # reading takes time
            assert count_by_stream(path) == found[-1]
            if found[-1] > a_chunk:
                assert found[-1] - a_chunk <= count_by_index(path) <= found[-1]
    assert len(found) > 200
    assert found == sorted(found)
    assert found[-1] == len(made_run(STEPS))
    assert path.read_bytes() == (tmp_path / "bag" / "bag_0.mcap").read_bytes()


def metadata_record(size: int, letter: str = "x") -> bytes:
    """A Metadata record of a size."""
    builder = RecordBuilder()
    Metadata(name=letter * (size - HEADER - 8), metadata={}).write(builder)
    return bytes(builder.end())


def count_by_any_reader(content: bytes) -> int:
    """Metadata records in a complete file, read by MCAP's own library from front to back."""
    return sum(isinstance(record, Metadata) for record in StreamReader(io.BytesIO(content)).records)


def test_wherever_a_record_ends_before_a_page_every_state_is_a_complete_file(
    tmp_path: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_writer, "LEAST_RESERVE", PAGE)  # so that the file is often extended
    builder = RecordBuilder()
    Header(profile="", library="").write(builder)
    file = CrashSafeFile(tmp_path / "file.mcap", MAGIC + builder.end())
    appended = 0
    for gap in range(1, HEADER + 2):
        file.append([metadata_record(3 * PAGE // 2 + -(file.end + 3 * PAGE // 2) % PAGE - gap)])
        file.append([metadata_record(100)])
        appended += 2
    # Headers and footers, which make what they point to visible, are written by calls of their own.
    pointers = [(offset, len(data)) for data, offset in calls if data and len(data) <= FOOTER.size]
    assert all(offset // PAGE == (offset + size - 1) // PAGE for offset, size in pointers)
    begun = 3  # states of a file that has only been begun
    found = [count_by_any_reader(bytes(content)) for number, content in enumerate(states(calls)) if number >= begun]
    assert found == sorted(found)
    assert found[-1] == appended


def test_closing_and_recovery_remove_the_reserved_space(tmp_path: Path) -> None:
    for name, close in (("closed", True), ("left", False)):
        writer = BagWriter(tmp_path / name)
        write_run(None, STEPS, writer=writer, close=close)
    sizes = {name: (tmp_path / name / f"{name}_0.mcap").stat().st_size for name in ("closed", "left")}
    assert sizes["left"] > sizes["closed"] + 100_000
    repair(tmp_path / "left")
    recovered = (tmp_path / "left" / "left_0.mcap").stat().st_size
    assert abs(recovered - sizes["closed"]) < 10_000


def test_while_a_file_is_closed_with_more_than_its_reserve_takes_every_state_is_a_complete_file(
    tmp_path: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_writer, "LEAST_RESERVE", PAGE)
    builder = RecordBuilder()
    Header(profile="", library="").write(builder)
    file = CrashSafeFile(tmp_path / "file.mcap", MAGIC + builder.end())
    file.append([metadata_record(100)])
    footer = FOOTER.pack(Opcode.FOOTER, FOOTER.size - HEADER, 0, 0, 0)
    file.close([metadata_record(100 * PAGE), DATA_END, footer, MAGIC])
    begun = 3
    found = [count_by_any_reader(bytes(content)) for number, content in enumerate(states(calls)) if number >= begun]
    assert found == sorted(found)
    assert found[-1] == 2


def summary_of(content: bytes) -> bytes:
    """What the footer of a complete file points to, up to the footer."""
    start = FOOTER.unpack(content[-FOOTER.size - len(MAGIC) : -len(MAGIC)])[2]
    return content[start:]


@pytest.mark.parametrize("pages", [0, 1, 3, 9, 100])
@pytest.mark.parametrize("summaries", [1, 2, 3])
def test_while_a_file_is_closed_its_last_summary_holds_to_the_end(
    tmp_path: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch, pages: int, summaries: int
) -> None:
    monkeypatch.setattr(mcap_writer, "LEAST_RESERVE", PAGE)
    builder = RecordBuilder()
    Header(profile="", library="").write(builder)
    file = CrashSafeFile(tmp_path / "file.mcap", MAGIC + builder.end())
    file.append([metadata_record(100)])
    for number in range(summaries):
        file.set_summary(metadata_record(200 + number))
    begun = len(calls)
    footer = FOOTER.pack(Opcode.FOOTER, FOOTER.size - HEADER, 0, 0, 0)
    file.close([metadata_record(100 + pages * PAGE), DATA_END, footer, MAGIC])
    summary, before = metadata_record(199 + summaries), sum(1 for _ in states(calls[:begun]))
    every = [bytes(content) for number, content in enumerate(states(calls)) if number >= before]
    assert all(summary_of(content).startswith(summary) for content in every[:-1] if content.endswith(MAGIC))
    assert every[-1] == (tmp_path / "file.mcap").read_bytes()


@pytest.mark.parametrize("seed", range(6))
def test_whatever_is_appended_between_summaries_of_any_size_every_state_is_complete_and_has_one_of_the_two_last_summaries(
    tmp_path: Path, calls: Calls, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr(mcap_writer, "LEAST_RESERVE", PAGE)
    builder, draw = RecordBuilder(), random.Random(seed)  # noqa: S311
    Header(profile="", library="").write(builder)
    file = CrashSafeFile(tmp_path / "file.mcap", MAGIC + builder.end())
    content, appended, last, summary = bytearray(), 0, b"", b""
    deque(states(calls, content), maxlen=0)
    calls.clear()
    for number in range(24):
        left, slot = file._slots - file.end, file._slot_size
        # Records that leave hardly anything of the reserve, of a page of it, or of the place of a summary, and other ones.
        near = [left - each for each in (draw.randrange(2 * HEADER), PAGE + draw.randrange(2 * HEADER))]
        count = appended
        if number % 3 == 2:
            last, summary = summary, metadata_record(draw.choice([50, 5 * PAGE, min(slot, 5 * PAGE) - draw.randrange(24)]), "s")
            file.set_summary(summary)
        else:
            last, appended = summary, appended + 1
            file.append([metadata_record(draw.choice([100, draw.randrange(100, 3 * PAGE), *(n for n in near if n >= 100)]))])
        for state in states(calls, content):
            records = [each.name[0] for each in StreamReader(io.BytesIO(bytes(state))).records if isinstance(each, Metadata)]
            assert records.count("x") in (count, appended)
            assert summary_of(bytes(state)).startswith((summary, last) if last else (summary, MAGIC))
        calls.clear()
    assert records.count("x") == appended


def footer_of(path: Path) -> tuple[int, int]:
    """Where the summary and its offsets begin by the footer of a file."""
    content = path.read_bytes()
    fields = FOOTER.unpack(content[-len(MAGIC) - FOOTER.size : -len(MAGIC)])
    return fields[2], fields[3]


def test_the_footer_leads_to_no_summary_before_there_is_one_and_never_to_offsets_of_it(tmp_path: Path) -> None:
    file = CrashSafeFile(tmp_path / "file.mcap", MAGIC)
    assert footer_of(tmp_path / "file.mcap") == (0, 0)
    assert mcap_writer.is_being_written(tmp_path / "file.mcap")
    del file
    writer = BagWriter(tmp_path / "bag")
    for _ in range(2):
        writer.flush()
        start, offsets = footer_of(tmp_path / "bag" / "bag_0.mcap")
        assert start > 0
        assert offsets == 0
    writer.close()
    start, offsets = footer_of(tmp_path / "bag" / "bag_0.mcap")
    assert start > 0
    assert offsets == 0
    assert not mcap_writer.is_being_written(tmp_path / "bag" / "bag_0.mcap")
