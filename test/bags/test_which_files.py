"""Which files are a bag: those that metadata.yaml names, never hidden ones, and the differences are named."""

import shutil
import warnings
from pathlib import Path

import pytest
import yaml
from bag_making import CLOCK, clock, topic

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.bags.writer import BagWriter, Splitting
from vessel_hsmc_ros.core.exceptions import BagError, BagWarning

STEP = 1_000_000_000


def change(bag: Path, **values: object) -> None:
    document = yaml.safe_load((bag / "metadata.yaml").read_text())
    document["rosbag2_bagfile_information"] |= values
    (bag / "metadata.yaml").write_text(yaml.safe_dump(document))


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of three files with a message each."""
    writer, ticks = BagWriter(tmp_path / "bag", splitting=Splitting(duration=0.5)), topic("/clock", CLOCK)
    writer.add_topic(ticks)
    for k in range(3):
        writer.write(ticks, clock(k * STEP), k * STEP, k * STEP)
    writer.close()
    return tmp_path / "bag"


def stamps(bag: Path) -> list[int]:
    return [message.log_time // STEP for message in open_bag(bag).raw_messages()]


HIDDEN = {
    "of macOS": ("._bag_0.mcap", b"\x00\x05\x16\x07\x00\x02\x00\x00Mac OS X"),
    "empty": (".bag_0.mcap", b""),
    "being copied": (".bag_1.mcap.Xy12ab", b"part"),
    "compressed": ("._bag_0.mcap.zstd", b"part"),
}


@pytest.mark.parametrize("described", [True, False])
@pytest.mark.parametrize("name", HIDDEN)
def test_hidden_files_are_none_of_a_bag(bag: Path, name: str, described: bool) -> None:
    hidden, content = HIDDEN[name]
    (bag / hidden).write_bytes(content)
    if not described:
        (bag / "metadata.yaml").unlink()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert stamps(bag) == [0, 1, 2]
        assert repair(bag).messages == 3
        assert is_complete(bag)
    assert (bag / hidden).read_bytes() == content


def test_a_folder_of_hidden_files_alone_is_no_bag(tmp_path: Path) -> None:
    (tmp_path / "._bag_0.mcap").write_bytes(b"x")
    with pytest.raises(BagError, match="is not a bag: it holds no MCAP file"):
        open_bag(tmp_path)


@pytest.mark.parametrize("stray", ["bag_0 (copy).mcap", "a.mcap", "other_0.mcap", "bag_3.mcap"])
def test_a_file_that_metadata_does_not_name_is_left_out_and_named(bag: Path, stray: str) -> None:
    (bag / stray).write_bytes((bag / "bag_0.mcap").read_bytes()[:-30])
    for use in (stamps, repair):
        with pytest.warns(BagWarning) as found:
            use(bag)
        assert f"metadata.yaml does not name {stray}: left out" in str(found[0].message)
    with pytest.warns(BagWarning):
        assert stamps(bag) == [0, 1, 2]
    with pytest.warns(BagWarning):
        assert open_bag(bag).complete


@pytest.mark.parametrize("gone", [0, 1, 2])
def test_a_file_that_is_missing_is_named_and_the_bag_is_not_complete(bag: Path, gone: int) -> None:
    (bag / f"bag_{gone}.mcap").unlink()
    with pytest.warns(BagWarning, match=rf"metadata\.yaml names bag_{gone}\.mcap, which is missing"):
        opened = open_bag(bag)
    assert not opened.complete
    assert opened.missing == (f"bag_{gone}.mcap",)
    assert opened.count == 2
    with pytest.warns(BagWarning, match="which is missing"):
        assert not is_complete(bag)
    with pytest.warns(BagWarning, match="which is missing"):
        repair(bag)
    assert open_bag(bag).recording["missing_files"] == f"bag_{gone}.mcap"


def test_files_of_another_bag_alone_are_refused_with_the_cure(bag: Path) -> None:
    for k in range(3):
        (bag / f"bag_{k}.mcap").rename(bag / f"renamed_{k}.mcap")
    with pytest.raises(BagError, match=r"names bag_0\.mcap, .* are missing; .* \(without metadata\.yaml all files count"):
        open_bag(bag)
    (bag / "metadata.yaml").unlink()
    assert stamps(bag) == [0, 1, 2]


def test_two_bags_in_a_folder_without_metadata_are_not_one(bag: Path) -> None:
    shutil.copy(bag / "bag_0.mcap", bag / "other_0.mcap")
    (bag / "metadata.yaml").unlink()
    for use in (open_bag, repair):
        with pytest.raises(BagError, match=r"holds files of 2 bags, and no metadata\.yaml: choose one, such as .*bag_0\.mcap"):
            use(bag)
    assert stamps(bag / "other_0.mcap") == [0]


def test_files_are_read_in_the_order_of_metadata(bag: Path) -> None:
    change(bag, relative_file_paths=["bag_2.mcap", "folder/bag_0.mcap", "bag_1.mcap", "bag_2.mcap"])
    assert stamps(bag) == [2, 0, 1]


@pytest.mark.parametrize("identifier", ["", None, "mcap"])
def test_an_empty_storage_identifier_beside_mcap_files_is_mcap(bag: Path, identifier: str | None) -> None:
    change(bag, storage_identifier=identifier)
    assert stamps(bag) == [0, 1, 2]
    assert repair(bag).messages == 3


@pytest.mark.parametrize("names", [None, 3, [], [4, None], "bag_0.mcap"])
def test_a_metadata_without_names_is_one_of_all_files(bag: Path, names: object) -> None:
    change(bag, relative_file_paths=names)
    assert stamps(bag) == [0, 1, 2]
