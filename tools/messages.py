"""The message package as a wheel: found in dist/, or compiled from msg_defs.

    .venv/bin/python tools/messages.py           install the wheel that fits this Python and msg_defs; compile one if none does
    .venv/bin/python tools/messages.py --wheel   compile one into dist/, tagged for the oldest Linux that can run it
    .venv/bin/python tools/messages.py --compile compile and install one whatever is in dist/, which is for Jazzy

Compiled where CMake finds ROS: in the prefix of the environment, like in a sourced workspace.
"""

import os
import platform
import re
import shutil
import sys
import sysconfig
import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import install

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "msg_defs"
BUILD = ROOT / "build" / "messages"
DIST = ROOT / "dist"
NAME = "vessel_hsmc_msgs"

REQUIREMENTS = (
    "ros-action-msgs~=2.0.3",
    "ros-geometry-msgs~=5.3",
    "ros-nav-msgs~=5.3",
    "ros-std-msgs~=5.3",
    "ros-rosidl-default-runtime~=1.6.0",
    "numpy>=1.23",
)
"""Of the wheel: the packages of Jazzy whose libraries it is linked with, and what its Python code imports."""

LOCAL = "linux_x86_64"
"""The tag of a wheel that was compiled for this machine only."""


def main(arguments: list[str]) -> int:
    """Find or make the wheel, and install it or keep it in dist/."""
    try:
        if "--wheel" in arguments:
            print(portable(compiled_wheel()).relative_to(ROOT))
            return 0
        wheel = (None if "--compile" in arguments else fitting()) or compiled_wheel()
    except BuildError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return install.main("Installing the messages", ["--no-deps", "--force-reinstall", str(wheel)])


class BuildError(Exception):
    """The messages did not compile, or their wheel could not be made; the text is the end of what the tools wrote."""


def fitting(folder: Path = DIST) -> Path | None:
    """The wheel in a folder that is for this Python and this C library and has the messages of msg_defs; None if none is."""
    tag = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    glibc = tuple(map(int, (platform.libc_ver()[1] or "0").split(".")[:2]))
    for wheel in sorted(folder.glob(f"{NAME}-{version()}-{tag}-{tag}-*x86_64.whl")):
        least = re.search(r"manylinux_(\d+)_(\d+)_", wheel.name)
        if (least is None or (int(least[1]), int(least[2])) <= glibc) and has_our_messages(wheel):
            return wheel
    return None


def has_our_messages(wheel: Path) -> bool:
    """Whether a wheel was made from the present messages."""
    with zipfile.ZipFile(wheel) as content:
        names = {Path(name).name: name for name in content.namelist() if name.endswith((".msg", ".action"))}
        sources = [*SOURCE.glob("msg/*.msg"), *SOURCE.glob("action/*.action")]
        return set(names) == {path.name for path in sources} and all(
            content.read(names[p.name]) == p.read_bytes() for p in sources
        )


def version() -> str:
    """The version of the package."""
    return described("version")


def compiled_wheel() -> Path:
    """Compile the messages, and pack what is needed to run.

    Raises:
        BuildError: CMake or the compiler failed.
    """
    shutil.rmtree(BUILD, ignore_errors=True)  # CMake keeps what it has found, also that there was no compiler
    BUILD.mkdir(parents=True)
    staging, cmake = BUILD / "staging", str(BUILD / "cmake")
    options = [f"-DCMAKE_PREFIX_PATH={sys.prefix}", f"-DCMAKE_INSTALL_PREFIX={staging}", f"-DPython3_EXECUTABLE={sys.executable}"]
    run("Configuring the messages", ["cmake", "-S", str(SOURCE), "-B", cmake, "-G", "Ninja", "-DBUILD_TESTING=OFF", *options])
    run("Compiling the messages", ["sh", "-c", f"cmake --build {cmake} && cmake --install {cmake} --strip"])
    return packed(staging, BUILD)


def run(title: str, command: list[str]) -> None:
    """Run a program of the environment, whose prefix serves as the underlay like a sourced ROS installation.

    Raises:
        BuildError: it failed.
    """
    path = os.pathsep.join((f"{sys.prefix}/bin", os.environ.get("PATH", "")))
    code, output = install.run(title, command, {**os.environ, "AMENT_PREFIX_PATH": sys.prefix, "PATH": path})
    if code:
        log = BUILD / "log.txt"
        log.write_text(output, encoding="utf-8")
        raise BuildError("\n".join([*output.splitlines()[-30:], f"error: {title} failed; the complete log is in {log}"]))


def packed(staging: Path, target: Path) -> Path:
    """Write the wheel of an installed message package."""
    from wheel.wheelfile import WheelFile

    tag = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    distribution = f"{NAME}-{version()}"
    path = target / f"{distribution}-{tag}-{tag}-{LOCAL}.whl"
    with WheelFile(str(path), "w") as wheel:
        for file, name in contents(staging, distribution):
            wheel.write(str(file), name)
        wheel.writestr(f"{distribution}.dist-info/METADATA", metadata())
        wheel.writestr(
            f"{distribution}.dist-info/WHEEL",
            f"Wheel-Version: 1.0\nGenerator: {NAME}\nRoot-Is-Purelib: false\nTag: {tag}-{tag}-{LOCAL}\n",
        )
    return path


def contents(staging: Path, distribution: str) -> Iterator[tuple[Path, str]]:
    """The files that are needed to run, with their names in the wheel: code, libraries, and the definitions of the messages."""
    packages = staging / Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    for path in sorted(staging.rglob("*")):
        relative = path.relative_to(staging)
        if path.is_relative_to(packages / NAME) and path.suffix in (".py", ".so"):
            yield path, path.relative_to(packages).as_posix()
        elif path.is_file() and (relative.match("lib/*.so") or is_shared(relative)):
            yield path, f"{distribution}.data/data/{relative.as_posix()}"


def is_shared(relative: Path) -> bool:
    """Whether a file is an entry of the index of packages, or a definition; the rest is for compilers and shells."""
    index = relative.match("share/ament_index/resource_index/*/*") and relative.parent.name != "parent_prefix_path"
    return (
        index
        or relative.match(f"share/{NAME}/msg/*")
        or relative.match(f"share/{NAME}/action/*.action")
        or relative.match(f"share/{NAME}/package.xml")
    )


def metadata() -> str:
    """The metadata of the wheel."""
    description = described("description")
    lines = ["Metadata-Version: 2.1", f"Name: {NAME}", f"Version: {version()}", f"Summary: {description}", "License: Apache-2.0"]
    only = f"{sys.version_info[0]}.{sys.version_info[1]}"
    return "\n".join([*lines, f"Requires-Python: =={only}.*", *(f"Requires-Dist: {each}" for each in REQUIREMENTS)]) + "\n"


def described(name: str) -> str:
    """An element of the message package's package.xml."""
    text = ElementTree.parse(SOURCE / "package.xml").findtext(name)  # noqa: S314 - our own file
    return " ".join(str(text).split())


def portable(wheel: Path) -> Path:
    """Write a wheel into dist/ with the tag of the oldest Linux that can run it; it brings no libraries of ROS."""
    DIST.mkdir(exist_ok=True)
    for old in DIST.glob(wheel.name.replace(LOCAL, "*")):
        old.unlink()
    run("Tagging the wheel", ["auditwheel", "repair", "--exclude", "lib*", "--wheel-dir", str(DIST), str(wheel)])
    return next(DIST.glob(wheel.name.replace(LOCAL, "*")))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
