"""Messages of other packages that tests speak: compiled from test/definitions where the packages are not installed.

    .venv/bin/python test/support/definitions.py    compile them all beforehand, about a minute; `make test` does

They are kept in build until a definition or the version of Python changes.
"""

import ctypes
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core.install_paths import KILTED

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "test" / "definitions"
BUILD = ROOT / "build" / ("definitions_kilted" if KILTED else "definitions")
NEEDED = {"px4_msgs": (), "geographic_msgs": (), "robot_localization": ("geographic_msgs", "geometry_msgs", "service_msgs")}
"""The packages in an order in which they can be compiled, with those that they need."""

PROJECT = """\
cmake_minimum_required(VERSION 3.20)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{found}
include({drop})
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} {dependencies})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""

PACKAGE = """\
<package format="3"><name>{name}</name><version>0.0.0</version><description>For tests</description>
<maintainer email="maintainers@example.org">maintainers</maintainer><license>none</license>
<buildtool_depend>ament_cmake</buildtool_depend>{depends}
<member_of_group>rosidl_interface_packages</member_of_group><export><build_type>ament_cmake</build_type></export></package>
"""


def main() -> int:
    """Compile all packages that are not installed."""
    for name in NEEDED:
        built(name)
    return 0


def module(name: str) -> Any:
    """Import a module of a package, such as px4_msgs.msg, compiled before if need be; None where it cannot be compiled."""
    package = name.partition(".")[0]
    if find_spec(package) is None:
        for each in (part for part in (*NEEDED[package], package) if part in NEEDED):
            if (prefix := built(each)) is None:
                return None
            load(prefix)
    return import_module(name)


def environment(package: str) -> dict[str, str] | None:
    """The variables with which a process finds a package without others of ours; None where it cannot be compiled."""
    if find_spec(package) is not None and str(BUILD) not in str(find_spec(package)):
        return {}
    if (prefix := built(package)) is None:
        return None
    paths = {"PYTHONPATH": site(prefix), "LD_LIBRARY_PATH": prefix / "lib"}
    return {name: os.pathsep.join(filter(None, (str(path), os.environ.get(name)))) for name, path in paths.items()}


def site(prefix: Path) -> Path:
    """The folder of the Python packages below a prefix."""
    return next(prefix.glob("lib/python3*/site-packages"))


def load(prefix: Path) -> None:
    """Make a package importable in this process, whose search path for libraries is fixed: by loading its libraries."""
    if str(site(prefix)) not in sys.path:
        sys.path.append(str(site(prefix)))
        libraries = sorted(prefix.glob("lib/*.so"), key=lambda path: "generator_c" not in path.name)
        for _ in libraries:  # those that need others load after these
            for path in libraries:
                try:
                    ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
                except OSError:
                    continue


def built(name: str) -> Path | None:
    """The prefix of a compiled package; None where CMake or the generators of messages are not installed."""
    files = sorted(SOURCES.glob(f"{name}/*/*"))
    digest = hashlib.sha256(sys.version.encode() + b"".join(path.read_bytes() for path in files)).hexdigest()[:12]
    prefix = BUILD / f"{name}-{digest}"
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:  # two processes share the tests
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not prefix.exists():
            if shutil.which("cmake", path=f"{sys.prefix}/bin") is None or find_spec("rosidl_cmake") is None:
                return None
            compile_package(name, files, prefix)
    return prefix


def compile_package(name: str, files: list[Path], prefix: Path) -> None:
    """Compile a package and install it below a prefix."""
    source = BUILD / name
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(SOURCES / name, source)
    names = " ".join(f'"{path.relative_to(SOURCES / name)}"' for path in files)
    needed = NEEDED[name]
    dependencies = f"DEPENDENCIES {' '.join(needed)}" if needed else ""
    found = "\n".join(f"find_package({each} REQUIRED)" for each in needed)
    drop = ROOT / "msg_defs" / "cmake" / "drop_missing_include_directories.cmake"
    text = PROJECT.format(name=name, found=found, drop=drop, files=names, dependencies=dependencies)
    (source / "CMakeLists.txt").write_text(text)
    depends = "".join(f"<depend>{each}</depend>" for each in needed)
    (source / "package.xml").write_text(PACKAGE.format(name=name, depends=depends))
    prefixes = [sys.prefix, *(str(built_before(each)) for each in needed if each in NEEDED)]
    staging = source / "staging"
    options = [f"-DCMAKE_PREFIX_PATH={';'.join(prefixes)}", f"-DCMAKE_INSTALL_PREFIX={staging}", "-DBUILD_TESTING=OFF"]
    python = f"-DPython3_EXECUTABLE={sys.executable}"
    run("cmake", "-S", str(source), "-B", str(source / "cmake"), "-G", "Ninja", python, *options, prefixes=prefixes)
    run("cmake", "--build", str(source / "cmake"), "--target", "install", prefixes=prefixes)
    staging.rename(prefix)


def built_before(name: str) -> Path:
    """The prefix of a package that another one needs, which has been compiled before."""
    return next(BUILD.glob(f"{name}-*"))


def run(*command: str, prefixes: list[str]) -> None:
    """Run a program of the environment, whose prefix and those of packages before are the underlay.

    Raises:
        RuntimeError: it failed.
    """
    path = os.pathsep.join((f"{sys.prefix}/bin", os.environ.get("PATH", "")))
    variables = {**os.environ, "AMENT_PREFIX_PATH": os.pathsep.join(prefixes), "PATH": path}
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=300.0, check=False)
    if done.returncode:
        raise RuntimeError("\n".join(["messages did not compile:", *(done.stdout + done.stderr).splitlines()[-30:]]))


if __name__ == "__main__":
    sys.exit(main())
