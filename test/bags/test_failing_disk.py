"""A disk that refuses a write: no other file is touched, no loss is reported as success, and what was flushed is read."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest
from bag_making import CLOCK, clock, topic
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.bags import mcap_writer, rosbag2_metadata, writer
from vessel_hsmc_ros.bags.mcap_contents import MAGIC
from vessel_hsmc_ros.bags.mcap_writer import CrashSafeFile
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError

STEP = 10_000_000


class Disk:
    """The operating system as the writers see it: calls that write are counted, and some of them fail.

    Args:
        refused: The number of the first call that fails.
        count: How many fail from there on.
        partly: Whether the first of them writes half of its bytes before.
    """

    def __init__(self, refused: int, count: int, partly: bool) -> None:
        self.calls, self._refused, self._partly = 0, range(refused, refused + count), partly

    def __getattr__(self, name: str) -> Any:
        return getattr(os, name)

    def refuses(self) -> bool:
        self.calls += 1
        return self.calls - 1 in self._refused

    def check(self) -> None:
        if self.refuses():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def open(self, *arguments: Any) -> int:
        self.check()
        return os.open(*arguments)

    def pwrite(self, fd: int, data: bytes, offset: int) -> int:
        if self.refuses():
            if self._partly and len(data) > 1:
                os.pwrite(fd, data[: len(data) // 2], offset)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return os.pwrite(fd, data, offset)

    def ftruncate(self, fd: int, size: int) -> None:
        self.check()
        os.ftruncate(fd, size)


def prepared(patch: pytest.MonkeyPatch, disk: Disk) -> None:
    """Let the modules that write bags see the disk; a small chunk makes many writes."""

    def described(*arguments: Any) -> None:
        disk.check()
        rosbag2_metadata.write_metadata(*arguments)

    patch.setattr(mcap_writer, "os", disk)
    patch.setattr(writer, "write_metadata", described)
    patch.setattr(mcap_writer, "CHUNK_SIZE", 400)
    patch.setattr(mcap_writer, "LEAST_RESERVE", 4096)


def recorded(folder: Path, count: int, bystander: Path) -> tuple[int, list[BagError]]:
    """Write a bag of three files; another file is opened after the first failure, and takes the number of one that was closed.

    Returns:
        The messages that were flushed without a failure, and the failures, with None for a method that reported success.
    """
    flushed, failures = 0, []
    try:
        bag = BagWriter(folder, "none", Splitting(duration=count / 3 * STEP * 1e-9))
    except BagError as error:
        return 0, [error]
    try:
        ticks = topic("/clock", CLOCK)
        bag.add_topic(ticks)
        bag.attach("scenario.yaml", "a: 1")
        for k in range(count):
            bag.write(ticks, clock(k * STEP), k * STEP, k * STEP)
            if k % 4 == 3:
                bag.flush()
                flushed = k + 1
    except BagError as error:
        failures.append(error)
    with bystander.open("wb", buffering=0) as other:
        other.write(b"another file")
        try:
            bag.close()
        except BagError as error:
            failures.append(error)
        other.write(b", still open")  # its descriptor has not been closed
    return (flushed if failures else count), failures


def descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> int:
    """Number of the writing calls of a recording without a failure."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        disk = Disk(0, 0, partly=False)
        prepared(patch, disk)
        assert recorded(folder / "bag", 60, folder / "other") == (60, [])
    return disk.calls


@pytest.mark.long
@given(data=st.data(), count=st.sampled_from([1, 2, 10**9]), partly=st.booleans())
@settings(max_examples=120, deadline=None)
def test_whatever_write_fails_no_other_file_is_touched_no_loss_reported_as_success_and_what_was_flushed_is_read(
    calls: int, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject, count: int, partly: bool
) -> None:
    refused = data.draw(st.integers(0, calls - 1))
    folder, before = tmp_path_factory.mktemp("full"), descriptors()
    with pytest.MonkeyPatch.context() as patch:
        prepared(patch, Disk(refused, count, partly))
        flushed, failures = recorded(folder / "bag", 60, folder / "other")
    assert failures
    assert all(str(error) == f"bag {folder / 'bag'} cannot be written: No space left on device" for error in failures)
    assert descriptors() == before
    if not (folder / "bag").exists():
        assert flushed == 0  # it could not be begun
        return
    assert (folder / "other").read_bytes() == b"another file, still open"
    for _ in range(2):
        found = [message.log_time for message in open_bag(folder / "bag").raw_messages()]
        assert found == [k * STEP for k in range(len(found))]
        assert len(found) >= flushed
        assert repair(folder / "bag").messages == len(found)


def test_after_a_split_that_failed_nothing_is_written_and_the_failure_is_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = BagWriter(tmp_path / "bag", "none", Splitting(duration=1.0))
    ticks = topic("/clock", CLOCK)
    bag.add_topic(ticks)
    bag.write(ticks, clock(0), 0, 0)
    with monkeypatch.context() as patch:
        prepared(patch, Disk(0, 10**9, partly=False))
        with pytest.raises(BagError, match="No space left"):
            bag.write(ticks, clock(2), 2_000_000_000, 2_000_000_000)
    for refused in (
        lambda: bag.write(ticks, clock(3), 3_000_000_000, 3_000_000_000),
        lambda: bag.add_topic(topic("/late", CLOCK)),
        lambda: bag.attach("scenario.yaml", "a: 1"),
        bag.flush,
        bag.flush_metadata,
        bag.close,
    ):
        with pytest.raises(BagError, match="No space left"):
            refused()


def test_a_bag_is_closed_once(tmp_path: Path) -> None:
    bag = BagWriter(tmp_path / "bag")
    bag.close()
    content = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    with (tmp_path / "other").open("wb", buffering=0) as other:
        with pytest.raises(BagError, match="is closed: nothing can be added"):
            bag.close()
        assert other.write(b"x") == 1
    assert (tmp_path / "bag" / "bag_0.mcap").read_bytes() == content


@pytest.mark.parametrize("refused", [0, 1, 2, 3])
def test_a_file_that_cannot_be_begun_leaves_neither_a_descriptor_nor_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: int
) -> None:
    before = descriptors()
    prepared(monkeypatch, Disk(refused, 1, partly=True))
    with pytest.raises(OSError, match="No space left"):
        CrashSafeFile(tmp_path / "file.mcap", MAGIC)
    assert descriptors() == before
    assert not (tmp_path / "file.mcap").exists()
