"""Every kind of bag by every reader: the written bytes, all of them or up to where the bag breaks off."""

from pathlib import Path

import pytest
import yaml
from bag_making import write_run
from durations import rest_long
from readers import READERS, files

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import Repair, is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting

STEPS = 150


Sent = dict[str, list[bytes]]
Made = tuple[Sent, int]
"""The written messages by topic, and the least number of steps that must be readable."""


def clean(directory: Path) -> Made:
    return write_run(directory, STEPS), STEPS


def uncompressed(directory: Path) -> Made:
    return write_run(directory, STEPS, "none"), STEPS


def lz4(directory: Path) -> Made:
    return write_run(directory, STEPS, "lz4"), STEPS


def split_by_size(directory: Path) -> Made:
    writer = BagWriter(directory, "none", Splitting(size=180_000))
    sent = write_run(directory, STEPS, writer=writer)
    assert len(files(directory)) > 2
    return sent, STEPS


def split_by_duration(directory: Path) -> Made:
    writer = BagWriter(directory, splitting=Splitting(duration=0.6))
    sent = write_run(directory, STEPS, writer=writer)
    assert len(files(directory)) == 3
    return sent, STEPS


def killed(directory: Path) -> Made:
    """A bag whose recorder was killed after a flush."""
    writer = BagWriter(directory)
    return write_run(directory, STEPS, close=False, writer=writer), STEPS


def recovered_after_a_kill(directory: Path) -> Made:
    sent, least = killed(directory)
    repair(directory)
    return sent, least


def cut_off(directory: Path) -> Made:
    """A bag of a machine that lost power: the file ends within a record."""
    sent = write_run(directory, STEPS)
    path = directory / f"{directory.name}_0.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    return sent, STEPS * 2 // 5  # all but the chunk in which it ends


def recovered(directory: Path) -> Made:
    sent, least = cut_off(directory)
    repair(directory)
    return sent, least


def split_cut_off_and_recovered(directory: Path) -> Made:
    sent, _ = split_by_size(directory)
    last = files(directory)[-1]
    last.write_bytes(last.read_bytes()[:-100])
    repair(directory)
    return sent, STEPS // 2


KINDS = [
    clean, uncompressed, lz4, split_by_size, split_by_duration, killed, recovered_after_a_kill, cut_off, recovered,
    split_cut_off_and_recovered,
]  # fmt: skip
NEED_AN_END = {"rosbags", "mcap-ros2-support", "@mcap/core indexed"}

Bag = tuple[str, Path, Sent, int]
"""Kind, folder, the written messages by topic, and the least number of steps that must be readable."""


@pytest.fixture(scope="module", params=KINDS, ids=lambda kind: kind.__name__)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Bag:
    directory = tmp_path_factory.mktemp(request.param.__name__) / "bag"
    return (request.param.__name__, directory, *request.param(directory))


@pytest.mark.parametrize("name", rest_long(READERS, 7))
def test_every_reader_finds_the_bytes_that_were_written(bag: Bag, name: str) -> None:
    kind, directory, sent, least = bag
    if kind == "cut_off" and name in NEED_AN_END:
        pytest.skip(f"{name} cannot read a file without its end")
    check(READERS[name](directory), sent, least)


def check(found: Sent, sent: Sent, least: int) -> None:
    for topic, messages in sent.items():
        assert found[topic] == messages[: len(found[topic])], topic
    assert len(found["/odom"]) >= least
    if least == STEPS:
        assert {topic: len(messages) for topic, messages in found.items()} == {t: len(m) for t, m in sent.items()}


def test_open_bag_finds_the_bytes_that_were_written(bag: Bag) -> None:
    _, directory, sent, least = bag
    found: Sent = {topic: [] for topic in sent}
    opened = open_bag(directory)
    for raw in opened.raw_messages():
        found[raw.topic].append(raw.data)
    check(found, sent, least)
    assert {topic: series.count for topic, series in opened.topics.items()} == {t: len(m) for t, m in found.items()}


def test_metadata_lists_all_files_and_counts_all_messages(bag: Bag) -> None:
    kind, directory, _, _ = bag
    information = yaml.safe_load((directory / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    if kind not in ("killed", "cut_off"):
        assert is_complete(directory)
        opened = open_bag(directory)
        assert information["message_count"] == opened.count == sum(file["message_count"] for file in information["files"])
        counts = {t["topic_metadata"]["name"]: t["message_count"] for t in information["topics_with_message_count"]}
        assert counts == {name: series.count for name, series in opened.topics.items()}
        assert information["starting_time"]["nanoseconds_since_epoch"] == opened.start_time
        assert information["duration"]["nanoseconds"] == opened.end_time - opened.start_time
    assert information["relative_file_paths"] == [path.name for path in files(directory)]


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Sent, Repair]:
    """A repaired bag of which one chunk was damaged."""
    directory = tmp_path_factory.mktemp("damaged") / "bag"
    sent = write_run(directory, STEPS)
    path = directory / "bag_0.mcap"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    return directory, sent, repair(directory)


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_chunk_loses_only_its_own_messages(damaged: tuple[Path, Sent, Repair], name: str) -> None:
    directory, sent, _ = damaged
    found = READERS[name](directory)
    assert STEPS - 90 < len(found["/odom"]) < STEPS
    assert set(found["/odom"]) < set(sent["/odom"])


def test_a_damaged_chunk_is_repaired_once(damaged: tuple[Path, Sent, Repair]) -> None:
    directory, _, done = damaged
    assert (done.damaged, done.cut, done.files) == (1, 0, 1)
    assert repair(directory).files == 0
