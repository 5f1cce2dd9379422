"""Where compiled kernels are kept, and what happens to stored code that cannot be used."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.simulation import cache, compilation
from vessel_hsmc_ros.simulation.compilation import Compiled

Array = NDArray[np.float64]


@kernel
def twice(x: float) -> float:
    return 2.0 * x


@kernel
def doubled(values: Array) -> float:
    total = 0.0
    for i in range(len(values)):
        total += twice(values[i])
    return total


@kernel
def thrice(x: float) -> float:
    return 3.0 * x


VALUES = np.arange(4.0)


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path


def stored(place: Path) -> list[Path]:
    return sorted(place.rglob("*.nb[ic]"))


def test_machine_code_is_stored_and_loaded_again(place: Path) -> None:
    first = Compiled(doubled, "", {})
    assert not first.stored
    assert first(VALUES) == 12.0
    files = {path: path.stat().st_mtime_ns for path in stored(place)}
    again = Compiled(doubled, "", {})
    assert again.stored
    assert again(VALUES) == 12.0
    assert {path: path.stat().st_mtime_ns for path in stored(place)} == files


def test_a_kernel_with_another_one_in_the_place_of_a_name_is_stored_apart(place: Path) -> None:
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert Compiled(doubled, "", {"twice": thrice})(VALUES) == 18.0
    assert len(stored(place)) == 4


@pytest.mark.parametrize("damage", [b"", b"not a pickle", None])
def test_stored_code_that_is_damaged_is_compiled_anew(place: Path, damage: bytes | None) -> None:
    Compiled(doubled, "", {})(VALUES)
    for path in stored(place):
        path.write_bytes(path.read_bytes()[:-100] if damage is None else damage)
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert Compiled(doubled, "", {})(VALUES) == 12.0


def test_an_edit_in_any_room_with_kernels_leads_to_another_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room = tmp_path / "room"
    shutil.copytree(cache.PACKAGE / "core", room, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(cache, "ROOMS", (room,))
    before = cache.key.__wrapped__()
    assert cache.key.__wrapped__() == before
    with (room / "limits.py").open("a") as file:
        file.write("# an edit\n")
    assert cache.key.__wrapped__() != before


def test_only_the_latest_folders_of_earlier_sources_are_kept(place: Path) -> None:
    earlier = [place / "vessel_hsmc_ros" / f"old{i}" for i in range(6)]
    for folder in earlier:
        folder.mkdir(parents=True)
    Compiled(doubled, "", {})(VALUES)
    assert len([*(place / "vessel_hsmc_ros").iterdir()]) == cache.KEPT


def test_without_a_writable_folder_a_kernel_is_compiled_and_not_stored(
    place: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (place / "vessel_hsmc_ros").write_text("a file where the folder should be")
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert "cannot be kept" in caplog.text


def test_an_installation_that_is_not_writable_uses_the_users_cache_folder(monkeypatch: pytest.MonkeyPatch, place: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(place))
    assert cache.places()[-1] == place / "vessel_hsmc_ros" / "kernels"


def test_compilation_can_be_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(compilation.DISABLED, "0")
    assert compilation.available()
    compilation.disable()
    assert not compilation.available()
