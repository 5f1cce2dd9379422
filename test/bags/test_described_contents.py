"""What describes a bag is what its messages are: as it was written, as a scan finds it, and after any repair."""

import itertools
import shutil
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bag_making import CLOCK, STATUS, STORE, clock, serialized, status, topic
from mcap.reader import make_reader

from vessel_hsmc_ros.bags import mcap_writer
from vessel_hsmc_ros.bags.mcap_contents import FOOTER, MAGIC, Contents, read_contents, scan
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import Repair, is_complete, repair
from vessel_hsmc_ros.bags.rosbag2_metadata import qos_entry, write_metadata
from vessel_hsmc_ros.bags.writer import SCENARIO, BagWriter, Splitting

TIMES = [[700, 500, 1_900, 600], [2_100, 1_950, 0, 5_000, 2_000], [300, 100, 4_200, 3_000]]
"""Log times in each file, ms, of a clock that was set back: none begins with its earliest or ends with its latest, and neither
the first nor the last file has the earliest or the latest of all."""

EVERY = list(itertools.chain(*TIMES))
STEPS = len(EVERY)

UNIT = 1_000_000


@pytest.fixture(params=["none", "lz4", "zstd"])
def bag(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag of files with several chunks, with three topics of two types and unlike qualities of service."""
    monkeypatch.setattr(mcap_writer, "CHUNK_SIZE", 400)
    writer = BagWriter(tmp_path / "bag", request.param, notes={"mode": "real time"})
    topics = [topic("/clock", CLOCK), topic("/diagnostics", STATUS), topic("/other/clock", CLOCK)]
    topics[2].qos = [qos_entry(False, True), qos_entry(True, False, deadline=(1, 5))]
    for each in topics:
        writer.add_topic(each)
    writer.attach(SCENARIO, "given: 1")
    for time in EVERY:
        writer._splitting = Splitting(size=int(time in (TIMES[1][0], TIMES[2][0])))
        for at in (0, 2, 1):
            data = serialized(status(time, np.random.default_rng(time), "x" * 30), STATUS) if at == 1 else clock(time)
            writer.write(topics[at], data, time * UNIT + at, time * UNIT + 10 + at)
            writer._splitting = Splitting()
    writer.close()
    return tmp_path / "bag"


def files(bag: Path) -> list[Path]:
    return sorted(bag.glob("*.mcap"))


def information(bag: Path) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    return found


def times_in(path: Path) -> list[int]:
    """Log times in a file, by a reader of others."""
    with path.open("rb") as stream:
        return [message.log_time for _, _, message in make_reader(stream).iter_messages(log_time_order=False)]


def test_times_and_counts_of_a_bag_and_of_each_of_its_files_are_those_of_its_messages(bag: Path) -> None:
    found = [times_in(path) for path in files(bag)]
    assert len(found) == 3
    every = list(itertools.chain(*found))
    earliest, latest = min(every), max(every)
    assert min(found[0]) > earliest
    shown = information(bag)
    assert shown["starting_time"]["nanoseconds_since_epoch"] == earliest == 0
    assert shown["duration"]["nanoseconds"] == latest - earliest
    assert [(f["starting_time"]["nanoseconds_since_epoch"], f["duration"]["nanoseconds"]) for f in shown["files"]] == [
        (min(times), max(times) - min(times)) for times in found
    ]
    assert [f["message_count"] for f in shown["files"]] == [len(times) for times in found]
    assert shown["message_count"] == len(every) == 3 * STEPS
    opened = open_bag(bag)
    assert (opened.start_time, opened.end_time, opened.count) == (earliest, latest, len(every))


def comparable(contents: Contents) -> dict[str, Any]:
    """All that is known of the data of a file."""
    known = asdict(contents)
    for name in ("complete", "end", "unindexed"):
        del known[name]
    known["chunks"] = [vars(chunk) for chunk in contents.chunks]
    return known


def test_a_scan_finds_what_the_summary_has(bag: Path) -> None:
    for path in files(bag):
        scanned, summarised = scan(path), read_contents(path)
        assert summarised.complete
        assert not scanned.complete
        assert len(scanned.chunks) > 1
        assert repr(comparable(scanned)) == repr(comparable(summarised))


def without_notes(shown: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in shown.items() if name != "custom_data"}


@pytest.mark.parametrize("lost", ["metadata.yaml", "0", "1", "2"])
def test_a_bag_is_complete_only_if_all_of_it_is_and_a_repair_describes_it_as_before(bag: Path, lost: str) -> None:
    before, data = information(bag), {path.name: path.read_bytes() for path in files(bag)}
    assert is_complete(bag)
    if lost == "metadata.yaml":
        (bag / lost).unlink()
    else:
        path = files(bag)[int(lost)]
        path.write_bytes(data[path.name][: -len(MAGIC) - FOOTER.size])
    assert not is_complete(bag)
    assert open_bag(bag).complete == (lost == "metadata.yaml")
    repair(bag)
    assert is_complete(bag)
    assert open_bag(bag).complete
    assert without_notes(information(bag)) == without_notes(before)
    assert information(bag)["custom_data"] == {**before["custom_data"], "recovered": "true"}
    assert {path.name: path.read_bytes() for path in files(bag)} == data


def test_a_file_of_another_name_is_described_under_it(bag: Path) -> None:
    path = files(bag)[-1]
    path.rename(path.with_name("bag_7.mcap"))
    (bag / "metadata.yaml").unlink()  # which has the former name
    assert not is_complete(bag)
    assert repair(bag).described
    shown = information(bag)
    assert shown["relative_file_paths"][-1] == shown["files"][-1]["path"] == "bag_7.mcap"
    assert is_complete(bag)


def test_what_is_cut_off_is_counted_over_all_files(bag: Path) -> None:
    cut = 0
    for path, rest in zip(files(bag), (3, 0, 8), strict=False):
        end, content = scan(path).end, path.read_bytes()
        path.write_bytes(content[: end + rest])
        cut += rest
    done = repair(bag)
    assert (done.cut, done.files, done.damaged) == (cut, 3, 0)


def test_a_file_whose_recorder_had_only_begun_it_counts_for_nothing(bag: Path) -> None:
    (bag / "bag_8.mcap").write_bytes(b"")
    before = information(bag)
    assert is_complete(bag)
    assert not repair(bag).described
    assert information(bag) == before
    assert open_bag(bag).count == 3 * STEPS


def test_a_file_without_messages_has_no_part_in_the_time_of_its_bag(tmp_path: Path) -> None:
    writer, ticks = BagWriter(tmp_path / "bag", splitting=Splitting(duration=1.0)), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for time in (5_000, 7_000):
        writer.write(ticks, clock(time), time * UNIT, time * UNIT)
    writer.close()
    empty = BagWriter(tmp_path / "empty")
    empty.add_topic(topic("/clock", CLOCK))
    empty.close()
    shutil.copy(tmp_path / "empty" / "empty_0.mcap", tmp_path / "bag" / "bag_2.mcap")
    (tmp_path / "bag" / "metadata.yaml").unlink()  # which does not name it
    assert repair(tmp_path / "bag").messages == 2
    shown = information(tmp_path / "bag")
    assert (shown["starting_time"]["nanoseconds_since_epoch"], shown["duration"]["nanoseconds"]) == (5_000 * UNIT, 2_000 * UNIT)
    assert [entry["message_count"] for entry in shown["files"]] == [1, 1, 0]
    opened = open_bag(tmp_path / "bag")
    assert (opened.start_time, opened.end_time) == (5_000 * UNIT, 7_000 * UNIT)


def test_each_topic_keeps_type_hash_and_qualities_of_service_through_a_repair(bag: Path) -> None:
    before = {name: (each.type, each.type_hash, each.qos, each.definition) for name, each in open_bag(bag).topics.items()}
    assert before["/clock"][1] == STORE.hash_rihs01(CLOCK) != before["/diagnostics"][1]
    assert [entry["durability"] for entry in before["/other/clock"][2]] == ["transient_local", "volatile"]
    for path in files(bag):
        path.write_bytes(path.read_bytes()[:-20])
    repair(bag)
    assert {name: (e.type, e.type_hash, e.qos, e.definition) for name, e in open_bag(bag).topics.items()} == before
    listed = {each["topic_metadata"]["name"]: each for each in information(bag)["topics_with_message_count"]}
    assert {name: each["topic_metadata"]["type_description_hash"] for name, each in listed.items()} == {
        name: each[1] for name, each in before.items()
    }
    assert {name: each["topic_metadata"]["offered_qos_profiles"] for name, each in listed.items()} == {
        name: each[2] for name, each in before.items()
    }
    assert Counter({name: each["message_count"] for name, each in listed.items()}) == Counter(dict.fromkeys(before, STEPS))


def test_a_channel_of_a_damaged_file_has_its_own_definition_and_not_that_of_another_file(tmp_path: Path) -> None:
    """Files of other recorders give the same numbers to other channels and schemas."""
    names = {"a": ("/clock", CLOCK), "b": ("/diagnostics", STATUS)}
    for folder, (name, kind) in names.items():
        writer, one = BagWriter(tmp_path / folder), topic(name, kind)
        writer.add_topic(one)
        data = clock(1) if kind == CLOCK else serialized(status(1, np.random.default_rng(1), "x"), STATUS)
        writer.write(one, data, 1, 1)
        writer.close()
    (tmp_path / "bag").mkdir()
    for number, folder in enumerate(names):
        shutil.copy(tmp_path / folder / f"{folder}_0.mcap", tmp_path / "bag" / f"bag_{number}.mcap")
    done = repair(tmp_path / "bag")
    assert (done.messages, done.described) == (2, True)
    listed = information(tmp_path / "bag")["topics_with_message_count"]
    assert [(each["topic_metadata"]["name"], each["topic_metadata"]["type"]) for each in listed] == [*names.values()]


def test_each_message_keeps_its_times_of_receipt_and_of_publication_and_its_place(bag: Path) -> None:
    expected = [(time * UNIT + at, time * UNIT + 10 + at) for time in EVERY for at in (0, 2, 1)]
    assert [(each.log_time, each.publish_time) for each in open_bag(bag).raw_messages()] == expected
    found = []
    for path in files(bag):
        with path.open("rb") as stream:
            found += [(m.log_time, m.publish_time) for _, _, m in make_reader(stream).iter_messages(log_time_order=False)]
    assert found == expected


def test_a_description_that_cannot_be_written_leaves_the_one_before(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, write = (bag / "metadata.yaml").read_bytes(), Path.write_text

    def full(path: Path, text: str, **options: Any) -> int:
        write(path, text[:100], **options)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space left"):
        write_metadata(bag, information(bag) | {"message_count": 0})
    assert (bag / "metadata.yaml").read_bytes() == before


@pytest.mark.parametrize(
    "content", ["", "half: [", "rosbag2_bagfile_information: 3", "rosbag2_bagfile_information: {version: x}"]
)
def test_a_description_that_cannot_be_read_is_made_anew(bag: Path, content: str) -> None:
    before = information(bag)
    (bag / "metadata.yaml").write_text(content)
    assert not is_complete(bag)
    assert repair(bag) == Repair(3 * STEPS, 0, 0, 0, described=True)
    assert without_notes(information(bag)) == without_notes(before)
    assert information(bag)["custom_data"]["mode"] == "real time"
