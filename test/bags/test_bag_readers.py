"""Every kind of bag, by every reader: the bytes that were written, all of them or up to where the bag breaks off."""

import pytest
import yaml
from bag_making import write_run
from readers import READERS, files

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting

STEPS = 150


def clean(directory):
    return write_run(directory, STEPS), STEPS


def uncompressed(directory):
    return write_run(directory, STEPS, "none"), STEPS


def lz4(directory):
    return write_run(directory, STEPS, "lz4"), STEPS


def split_by_size(directory):
    writer = BagWriter(directory, "none", Splitting(size=180_000))
    sent = write_run(directory, STEPS, writer=writer)
    assert len(files(directory)) > 2
    return sent, STEPS


def split_by_duration(directory):
    writer = BagWriter(directory, splitting=Splitting(duration=0.6))
    sent = write_run(directory, STEPS, writer=writer)
    assert len(files(directory)) == 3
    return sent, STEPS


def killed(directory):
    """Its recorder was killed between two flushes: what it had in memory is lost."""
    writer = BagWriter(directory)
    return write_run(directory, STEPS, close=False, writer=writer), STEPS


def recovered_after_a_kill(directory):
    sent, least = killed(directory)
    repair(directory)
    return sent, least


def cut_off(directory):
    """The machine lost power: the file ends anywhere."""
    sent = write_run(directory, STEPS)
    path = directory / f"{directory.name}_0.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    return sent, STEPS // 2


def recovered(directory):
    sent, least = cut_off(directory)
    repair(directory)
    return sent, least


def split_cut_off_and_recovered(directory):
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


@pytest.fixture(scope="module", params=KINDS, ids=lambda kind: kind.__name__)
def bag(request, tmp_path_factory):
    directory = tmp_path_factory.mktemp(request.param.__name__) / "bag"
    return (request.param.__name__, directory, *request.param(directory))


@pytest.mark.parametrize("name", READERS)
def test_every_reader_finds_the_bytes_that_were_written(bag, name):
    kind, directory, sent, least = bag
    if kind == "cut_off" and name in NEED_AN_END:
        pytest.skip(f"{name} insists on the end of a file")
    check(READERS[name](directory), sent, least)


def check(found, sent, least):
    for topic, messages in sent.items():
        assert found[topic] == messages[: len(found[topic])], topic
    assert len(found["/odom"]) >= least
    if least == STEPS:
        assert {topic: len(messages) for topic, messages in found.items()} == {t: len(m) for t, m in sent.items()}


def test_our_own_reader_finds_them_too(bag):
    _, directory, sent, least = bag
    found = {topic: [] for topic in sent}
    opened = open_bag(directory)
    for raw in opened.raw_messages():
        found[raw.topic].append(raw.data)
    check(found, sent, least)
    assert {topic: series.count for topic, series in opened.topics.items()} == {t: len(m) for t, m in found.items()}


def test_metadata_lists_all_files_and_counts_all_messages(bag):
    kind, directory, _, _ = bag
    told = yaml.safe_load((directory / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    if kind not in ("killed", "cut_off"):
        assert is_complete(directory)
        opened = open_bag(directory)
        assert told["message_count"] == opened.count == sum(file["message_count"] for file in told["files"])
        counts = {t["topic_metadata"]["name"]: t["message_count"] for t in told["topics_with_message_count"]}
        assert counts == {name: series.count for name, series in opened.topics.items()}
        assert told["starting_time"]["nanoseconds_since_epoch"] == opened.start_time
        assert told["duration"]["nanoseconds"] == opened.end_time - opened.start_time
    assert told["relative_file_paths"] == [path.name for path in files(directory)]


def test_a_damaged_chunk_costs_that_chunk_and_no_more(tmp_path):
    sent = write_run(tmp_path / "bag", STEPS)
    path = tmp_path / "bag" / "bag_0.mcap"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    done = repair(tmp_path / "bag")
    assert (done.damaged, done.cut, done.files) == (1, 0, 1)
    for name in READERS:
        found = READERS[name](tmp_path / "bag")
        assert STEPS - 90 < len(found["/odom"]) < STEPS
        assert set(found["/odom"]) < set(sent["/odom"])
    assert repair(tmp_path / "bag").files == 0
