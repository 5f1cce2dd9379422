"""Bags that cannot be read, missing topics and missing fields: an error of one clear line each."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from bag_making import TYPES, topic, write_run

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

VESSEL = VesselParameters().coefficients()


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("recorded") / "bag"
    write_run(made, 30)
    return made


def damaged(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[1000] ^= 0xFF
    path.write_bytes(content)


def newer(path: Path) -> None:
    document = yaml.safe_load((path.parent / "metadata.yaml").read_text())
    document["rosbag2_bagfile_information"]["version"] = 10
    (path.parent / "metadata.yaml").write_text(yaml.safe_dump(document))


def of_sqlite(path: Path) -> None:
    text = (path.parent / "metadata.yaml").read_text()
    (path.parent / "metadata.yaml").write_text(text.replace("storage_identifier: mcap", "storage_identifier: sqlite3"))


WRONG: dict[str, tuple[Callable[[Path], object], str]] = {
    "empty": (lambda path: path.write_bytes(b""), r"bag_0\.mcap is empty"),
    "truncated": (lambda path: path.write_bytes(path.read_bytes()[:12]), "not even the beginning of an MCAP file"),
    "another format": (lambda path: path.write_bytes(b"SQLite format 3\0" * 100), "is not an MCAP file"),
    "corrupt": (damaged, r"bag_0\.mcap is damaged at byte \d+: `vessel-hsmc recover` makes the rest of it readable"),
    "missing": (lambda path: path.unlink(), "is not a bag: it holds no MCAP file"),
    "newer": (newer, "has version 10, which is newer than 9, the last that this package reads"),
    "sqlite": (of_sqlite, "is stored as sqlite3: only mcap is read"),
    "metadata": (lambda path: (path.parent / "metadata.yaml").write_text("{"), "cannot be read as a bag's metadata"),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_unreadable_bag_is_reported_in_one_line(directory: Path, tmp_path: Path, case: str) -> None:
    shutil.copytree(directory, tmp_path / "bag")
    spoil, expected = WRONG[case]
    spoil(tmp_path / "bag" / "bag_0.mcap")
    with pytest.raises(BagError, match=expected) as error:
        open_bag(tmp_path / "bag").run(VESSEL)
    assert "\n" not in str(error.value)


def test_a_bag_without_odometry_is_refused_with_its_topics(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/reference", TYPES["reference"]))
    writer.close()
    with pytest.raises(BagError, match="has no odometry: its topics are /reference"):
        open_bag(tmp_path / "bag").run(VESSEL)


def test_a_missing_field_or_topic_is_reported_with_those_that_exist(directory: Path) -> None:
    bag = open_bag(directory)
    with pytest.raises(BagError, match=r"/odom has no field speed: it must be one of header\.stamp\.sec"):
        bag["odom"]["speed"]
    with pytest.raises(BagError, match="has 0 topics named wind: it has /odom"):
        bag["wind"]
    with pytest.raises(BagError, match="does not exist"):
        open_bag(directory / "nowhere")
