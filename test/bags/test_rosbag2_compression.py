"""Bags that rosbag2 compressed itself, file by file or message by message, are read like any other."""

import gc
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
import zstandard
from bag_making import Recorded, made_run, write_run

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

STEPS = 60
SKIPPED = b"\x50\x2a\x4d\x18\x04\x00\x00\x00size"
"""A frame without data, as parallel compressors write one before each frame."""

HUGE_FRAME = b"\x28\xb5\x2f\xfd\xe0" + (1 << 40).to_bytes(8, "little")
"""The header of a zstd frame that claims a terabyte."""


def declare(directory: Path, kind: str, mode: str) -> None:
    """State a compression in metadata.yaml, as rosbag2 does."""
    path = directory / "metadata.yaml"
    document = yaml.safe_load(path.read_text())
    information = document["rosbag2_bagfile_information"]
    information |= {"compression_format": kind, "compression_mode": mode}
    if mode == "FILE":
        information["relative_file_paths"] = [f"{name}.zstd" for name in information["relative_file_paths"]]
        for entry in information["files"]:
            entry["path"] += ".zstd"
    path.write_text(yaml.safe_dump(document))


def by_file(directory: Path, splitting: Splitting | None = None, steps: int = STEPS) -> dict[str, list[bytes]]:
    """Write a bag with --compression-mode file; returns the messages by topic."""
    sent = write_run(directory, steps, writer=BagWriter(directory, "none", splitting))
    for path in directory.glob("*.mcap"):
        path.with_suffix(".mcap.zstd").write_bytes(zstandard.compress(path.read_bytes()))
        path.unlink()
    declare(directory, "zstd", "FILE")
    return sent


class CompressingWriter(BagWriter):
    """Compresses each message, as rosbag2 does before it stores it."""

    def write(self, topic: Any, data: bytes, log_time: int, publish_time: int) -> None:
        super().write(topic, zstandard.compress(data), log_time, publish_time)


def by_message(directory: Path) -> dict[str, list[bytes]]:
    """Write a bag with --compression-mode message; returns the messages by topic, uncompressed."""
    sent = write_run(directory, STEPS, writer=CompressingWriter(directory, "none"))
    declare(directory, "zstd", "MESSAGE")
    return sent


def raw_messages(bag: Bag) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {name: [] for name in bag.topics}
    for raw in bag.raw_messages():
        found[raw.topic].append(raw.data)
    return found


@pytest.fixture(params=[by_file, by_message])
def compressed(request: pytest.FixtureRequest, tmp_path: Path) -> Recorded:
    return tmp_path / "bag", request.param(tmp_path / "bag")


def test_a_compressed_bag_reads_like_an_uncompressed_one(compressed: Recorded, tmp_path: Path) -> None:
    write_run(tmp_path / "plain", STEPS)
    bag, plain = open_bag(compressed[0]), open_bag(tmp_path / "plain")
    assert raw_messages(bag) == compressed[1]
    assert bag.complete
    assert (bag.count, bag.start_time, bag.end_time) == (plain.count, plain.start_time, plain.end_time)
    for name, series in plain.topics.items():
        for field in (*series.fields, "log_time", "publish_time"):
            if field != "status":
                np.testing.assert_array_equal(bag[name][field], series[field], err_msg=f"{name} {field}")
    vessel = VesselParameters().coefficients()
    np.testing.assert_array_equal(bag.run(vessel).state, plain.run(vessel).state)


def test_several_compressed_files_are_read_in_order(tmp_path: Path) -> None:
    sent = by_file(tmp_path / "bag", Splitting(duration=0.05))
    assert len([*(tmp_path / "bag").glob("*.mcap.zstd")]) == 12  # _10 comes after _9
    bag = open_bag(tmp_path / "bag")
    assert raw_messages(bag) == sent
    assert bag["odom"].log_time.tolist() == sorted({stamp for stamp, *_ in made_run(STEPS)})


def test_a_compressed_file_can_be_opened_without_its_folder(tmp_path: Path) -> None:
    sent = by_file(tmp_path / "bag")
    assert raw_messages(open_bag(tmp_path / "bag" / "bag_0.mcap.zstd")) == sent


def test_a_file_that_rosbag2_decompressed_beside_the_compressed_one_is_read_once(tmp_path: Path) -> None:
    sent = by_file(tmp_path / "bag")
    packed = tmp_path / "bag" / "bag_0.mcap.zstd"
    packed.with_suffix("").write_bytes(zstandard.decompress(packed.read_bytes()))
    assert raw_messages(open_bag(tmp_path / "bag")) == sent


@pytest.mark.parametrize("before", [b"", SKIPPED], ids=["frames", "skippable frames"])
def test_a_file_of_several_zstd_frames_is_read_to_its_end(tmp_path: Path, before: bytes) -> None:
    sent = by_file(tmp_path / "bag")
    packed = tmp_path / "bag" / "bag_0.mcap.zstd"
    data = zstandard.decompress(packed.read_bytes())
    third = len(data) // 3
    parts = data[:third], data[third : 2 * third], data[2 * third :]
    packed.write_bytes(b"".join(before + zstandard.compress(part) for part in parts))
    bag = open_bag(tmp_path / "bag")
    assert bag.complete
    assert raw_messages(bag) == sent


def test_decompressed_files_are_removed_with_the_bag(tmp_path: Path) -> None:
    by_file(tmp_path / "bag")
    bag = open_bag(tmp_path / "bag")
    decompressed = bag.files[0].path
    assert decompressed.is_file()
    assert not decompressed.is_relative_to(tmp_path)
    del bag
    gc.collect()
    assert not decompressed.parent.exists()


def test_a_compressed_file_that_was_cut_off_is_read_up_to_where_it_breaks_off(tmp_path: Path) -> None:
    sent = by_file(tmp_path / "bag", steps=300)  # several chunks
    path = tmp_path / "bag" / "bag_0.mcap.zstd"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4])
    bag = open_bag(tmp_path / "bag")
    assert not bag.complete
    assert 0 < bag["odom"].count < 300
    assert raw_messages(bag)["/odom"] == sent["/odom"][: bag["odom"].count]


@pytest.mark.parametrize(
    ("kind", "mode", "expected"),
    [
        ("lz4", "FILE", "must be compressed as zstd by FILE or MESSAGE (got format lz4, mode FILE)"),
        ("zstd", "CHUNK", "(got format zstd, mode CHUNK)"),
        ("", "MESSAGE", "(got format none, mode MESSAGE)"),
    ],
)
def test_an_unknown_compression_is_refused_by_name(tmp_path: Path, kind: str, mode: str, expected: str) -> None:
    write_run(tmp_path / "bag", 2)
    declare(tmp_path / "bag", kind, mode)
    with pytest.raises(BagError, match=re.escape(expected)):
        open_bag(tmp_path / "bag")


def test_a_damaged_compressed_file_is_refused(tmp_path: Path) -> None:
    by_file(tmp_path / "bag")
    path = tmp_path / "bag" / "bag_0.mcap.zstd"
    path.write_bytes(b"no zstd frame" * 100)
    with pytest.raises(BagError, match=r"bag_0\.mcap\.zstd is damaged: it cannot be decompressed as zstd"):
        open_bag(tmp_path / "bag")


def test_a_damaged_compressed_message_is_refused(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", 2)
    declare(tmp_path / "bag", "zstd", "MESSAGE")
    with pytest.raises(BagError, match=r"bag_0\.mcap is damaged: a compressed message cannot be decompressed"):
        open_bag(tmp_path / "bag")["odom"].stamp.max()


def test_a_message_that_claims_a_terabyte_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zstandard, "compress", lambda _: HUGE_FRAME)
    by_message(tmp_path / "bag")
    with pytest.raises(BagError, match="is damaged: a compressed message cannot be decompressed"):
        open_bag(tmp_path / "bag")["odom"].stamp.max()


def test_recover_keeps_the_declared_compression_of_messages(tmp_path: Path) -> None:
    sent = by_message(tmp_path / "bag")
    path = tmp_path / "bag" / "bag_0.mcap"
    path.write_bytes(path.read_bytes()[:-100])
    assert repair(tmp_path / "bag").files == 1
    assert raw_messages(open_bag(tmp_path / "bag")) == sent


def test_recover_does_not_touch_a_compressed_file(tmp_path: Path) -> None:
    by_file(tmp_path / "bag")
    before = {path: path.read_bytes() for path in (tmp_path / "bag").iterdir()}
    with pytest.raises(BagError, match=r"bag_0\.mcap\.zstd is compressed with zstd: `zstd -d bag_0\.mcap\.zstd`"):
        repair(tmp_path / "bag")
    assert {path: path.read_bytes() for path in (tmp_path / "bag").iterdir()} == before
