"""A chunk of a single small message, as a slow topic makes it between two flushes, is worth as much as a full one."""

import shutil
from pathlib import Path

import pytest
from bag_making import CLOCK, topic
from mcap.reader import make_reader

from vessel_hsmc_ros.bags import mcap_writer
from vessel_hsmc_ros.bags.mcap_contents import read_contents, scan
from vessel_hsmc_ros.bags.mcap_writer import McapFile
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import BagWriter

MESSAGES = [bytes(range(size)) for size in (*range(70), 200)]
"""Serialised messages of every size from none on; the records of the smaller half have less than 65 bytes."""

NAME = "bag_0.mcap"


@pytest.fixture(params=["none", "lz4", "zstd"])
def bags(request: pytest.FixtureRequest, tmp_path: Path) -> dict[str, Path]:
    """Bags with a chunk for each of MESSAGES: complete, of a recorder that was killed, and cut off in their summary."""
    found = {name: tmp_path / name / "bag" for name in ("complete", "killed", "cut")}
    writer, ticks = BagWriter(found["complete"], request.param), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for number, data in enumerate(MESSAGES):
        writer.write(ticks, data, number, number)
        writer.flush()
    shutil.copytree(found["complete"], found["killed"])
    writer.close()
    shutil.copytree(found["complete"], found["cut"])
    path = found["cut"] / NAME
    path.write_bytes(path.read_bytes()[:-30])
    return found


@pytest.mark.parametrize("ending", ["complete", "killed", "cut"])
def test_a_message_of_any_size_that_was_flushed_alone_is_read_and_recovered(bags: dict[str, Path], ending: str) -> None:
    bag = bags[ending]
    for contents in (read_contents(bag / NAME), scan(bag / NAME)):
        assert len(contents.chunks) == contents.counts.total() == len(MESSAGES)
    assert [message.data for message in open_bag(bag).raw_messages()] == MESSAGES
    done = repair(bag)
    assert (done.messages, done.damaged) == (len(MESSAGES), 0)
    assert [message.data for message in open_bag(bag).raw_messages()] == MESSAGES
    with (bag / NAME).open("rb") as stream:
        assert [message.data for _, _, message in make_reader(stream).iter_messages()] == MESSAGES


def test_a_file_that_is_closed_at_once_has_the_messages_of_its_last_chunk(tmp_path: Path) -> None:
    file = McapFile(tmp_path / NAME, "none")
    channel = file.add_channel("/clock", file.add_schema(CLOCK, "uint8 x"), {})
    for number, data in enumerate(MESSAGES):
        file.add_message(channel, number, data, number)
    file.close()
    assert [message.data for message in open_bag(tmp_path / NAME).raw_messages()] == MESSAGES


def test_the_summary_of_a_long_recording_that_was_killed_leads_to_most_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_writer, "SUMMARY_FLOOR", 1000)
    writer, ticks = BagWriter(tmp_path / "bag", "none"), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for number in range(300):
        writer.write(ticks, bytes(12), number, number)
        writer.flush()
    with (tmp_path / "bag" / NAME).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count > 200
