"""The check of the machine before the set-up names what is missing, and the command that provides it."""

import sys
import zipfile
from pathlib import Path

import install
import messages
import preflight
import pytest


def test_this_machine_passes() -> None:
    assert preflight.problems() == []


@pytest.mark.parametrize(("version", "free_threaded"), [((3, 9), False), ((3, 14), False), ((3, 13), True)])
def test_a_python_without_wheels_of_ros_is_refused_with_the_way_to_choose_another(
    version: tuple[int, int], free_threaded: bool
) -> None:
    reason = preflight.interpreter(version, free_threaded)
    assert f"Python {version[0]}.{version[1]} is not supported" in reason
    assert "make PYTHON=" in reason


@pytest.mark.parametrize("version", [(3, 10), (3, 11), (3, 12), (3, 13)])
def test_a_python_with_wheels_of_ros_is_accepted(version: tuple[int, int]) -> None:
    assert preflight.interpreter(version, free_threaded=False) == ""


@pytest.mark.parametrize(
    ("system", "processor", "libc", "named"),
    [
        ("Darwin", "arm64", ("", ""), "Darwin on arm64"),
        ("Linux", "aarch64", ("glibc", "2.39"), "Linux on aarch64"),
        ("Linux", "x86_64", ("", ""), "not glibc"),
        ("Linux", "x86_64", ("glibc", "2.27"), "glibc 2.27 is too old"),
        ("Linux", "x86_64", ("glibc", "2.36"), ""),
    ],
)
def test_a_machine_without_wheels_of_ros_is_named(system: str, processor: str, libc: tuple[str, str], named: str) -> None:
    reason = preflight.machine(system, processor, libc)
    assert named in reason
    assert bool(named) == bool(reason)


@pytest.mark.parametrize("path", ["/home/anna/my boats", "/home/änna/boats", "/home/anna/it's"])
def test_a_path_in_which_messages_cannot_be_compiled_is_named(path: str) -> None:
    assert path in preflight.folder(path)
    assert preflight.folder("/home/anna/boats-2.0_x") == ""


def test_without_a_compiler_or_headers_debians_packages_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert preflight.compiler().endswith("sudo apt install g++")
    monkeypatch.setattr("sysconfig.get_path", lambda _: str(tmp_path))
    assert f"python{sys.version_info[0]}.{sys.version_info[1]}-dev" in preflight.headers()


def message_wheel(folder: Path, tag: str, change: bytes = b"") -> Path:
    """A wheel with the definitions of the messages only."""
    path = folder / f"vessel_hsmc_msgs-{messages.version()}-{tag}.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        for definition in (*messages.SOURCE.glob("msg/*.msg"), *messages.SOURCE.glob("action/*.action")):
            wheel.writestr(f"share/{definition.name}", definition.read_bytes() + change)
    return path


def test_a_message_wheel_fits_if_it_is_for_this_python_this_linux_and_the_present_messages(tmp_path: Path) -> None:
    here = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    message_wheel(tmp_path, "cp39-cp39-manylinux_2_28_x86_64")
    message_wheel(tmp_path, f"{here}-{here}-manylinux_9_99_x86_64")
    other = message_wheel(tmp_path, f"{here}-{here}-manylinux_2_27_x86_64", change=b"float64 more\n")
    assert messages.fitting(tmp_path) is None
    other.unlink()
    fit = message_wheel(tmp_path, f"{here}-{here}-manylinux_2_28_x86_64")
    assert messages.fitting(tmp_path) == fit


@pytest.mark.long
def test_an_installation_without_network_names_the_cause(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    nowhere = "http://127.0.0.1:9/simple"  # the discard port, where nothing listens
    for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"):
        monkeypatch.setenv(name, nowhere)
    monkeypatch.setenv("PIP_RETRIES", "0")
    monkeypatch.setenv("UV_HTTP_RETRIES", "0")
    for name in ("PIP_EXTRA_INDEX_URL", "PIP_FIND_LINKS"):
        monkeypatch.delenv(name, raising=False)
    assert install.main("Installing", ["--no-deps", "--dry-run", "--no-cache-dir", "surely-not-installed"]) == 1
    assert capfd.readouterr().err.splitlines()[-1].startswith("error: the package index cannot be reached")


def test_the_lock_pins_uv_with_its_hashes() -> None:
    lines = install.pinned("uv").splitlines()
    assert lines[0].startswith("uv==")
    assert "--hash=sha256:" in lines[-1]
