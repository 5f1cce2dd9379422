"""Where compiled kernels are kept, and what happens to stored code that cannot be used."""

import ast
import functools
import importlib
import inspect
import os
import re
import shutil
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from compiling import only_compiled
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import KernelLaw
from vessel_hsmc_ros.core.kernel import KERNELS, bound, kernel
from vessel_hsmc_ros.scenario.scenario import load_scenario, make_law
from vessel_hsmc_ros.simulation import compilation, compiled_loop
from vessel_hsmc_ros.simulation.compilation import Compiled
from vessel_hsmc_ros.simulation.compile import THRUSTERS
from vessel_hsmc_ros.simulation.compiled_loop import Kept

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


@only_compiled
def test_machine_code_is_stored_and_loaded_again(place: Path) -> None:
    first = Compiled(doubled, "", {})
    assert not first.stored
    assert first(VALUES) == 12.0
    files = {path: path.stat().st_mtime_ns for path in stored(place)}
    again = Compiled(doubled, "", {})
    assert again.stored
    assert again(VALUES) == 12.0
    assert {path: path.stat().st_mtime_ns for path in stored(place)} == files


@only_compiled
def test_a_kernel_with_another_one_in_the_place_of_a_name_is_stored_apart(place: Path) -> None:
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert Compiled(doubled, "", {"twice": thrice})(VALUES) == 18.0
    assert len(stored(place)) == 4


@only_compiled
@pytest.mark.parametrize("damage", [b"", b"not a pickle", None])
def test_stored_code_that_is_damaged_is_compiled_anew(place: Path, damage: bytes | None) -> None:
    Compiled(doubled, "", {})(VALUES)
    for path in stored(place):
        path.write_bytes(path.read_bytes()[:-100] if damage is None else damage)
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert Compiled(doubled, "", {})(VALUES) == 12.0


def imported_from(module: types.ModuleType) -> dict[str, str]:
    """The modules that a module imports names from, by name."""
    tree = ast.parse(inspect.getsource(module))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    return {alias.asname or alias.name: str(node.module) for node in found for alias in node.names}


def types_in(value: object) -> set[type]:
    """The types of a tuple and of all that is in it, with their bases."""
    inner = set().union(*map(types_in, value)) if isinstance(value, tuple) else set()
    return inner | set(type(value).__mro__)


@functools.cache
def modules_of_kernels() -> set[Path]:
    """The files that machine code is made of: kernels, the names that they use, and the types of the loop's arguments."""
    for path in compilation.PACKAGE.rglob("*.py"):
        if "@kernel" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(compilation.PACKAGE.parent).with_suffix("").parts))
    ours = {each for each in KERNELS if each.__module__.startswith("vessel_hsmc_ros.")}
    names = {each.__module__ for each in ours}
    for each in ours:
        imported = imported_from(sys.modules[each.__module__])
        annotated = " ".join(str(note) for note in inspect.get_annotations(each).values())
        used = {*each.__code__.co_names, *each.__code__.co_freevars, *re.findall(r"\w+", annotated)}
        names |= {imported[name] for name in used & set(imported)}
    for name, source, observed in (("guided", "case2_tracking", True), ("open_loop", THRUSTERS, False)):
        scenario = load_scenario(source, {"controller.law": name, "controller.observer.enabled": observed})
        law = make_law(scenario.controller)
        assert isinstance(law, KernelLaw)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(compiled_loop, "compiled", bound)  # two samples: faster than to compile
            names |= {each.__module__ for each in types_in(compiled_loop.prepare(scenario, 2, law))}
    names |= {Kept.__module__}
    files = {inspect.getsourcefile(sys.modules[name]) for name in names if name.startswith("vessel_hsmc_ros.")}
    return {Path(str(file)) for file in files}


@pytest.mark.long
def test_all_that_machine_code_is_made_of_is_in_the_key() -> None:
    assert len(modules_of_kernels()) > 40
    assert modules_of_kernels() - set(compilation.kernel_sources()) == set()
    assert set(Path(compilation.__file__).parent.glob("*.py")) <= set(compilation.kernel_sources())


def test_an_edit_of_one_of_these_modules_leads_to_another_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(compilation.PACKAGE, copy / compilation.PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__"))
    edited = [copy / path.relative_to(compilation.PACKAGE.parent) for path in sorted(modules_of_kernels())[::6]]
    monkeypatch.setattr(compilation, "PACKAGE", copy / compilation.PACKAGE.name)
    keys = [compilation.cache_key.__wrapped__(), compilation.cache_key.__wrapped__()]
    for path in edited:
        with path.open("a") as file:
            file.write("# an edit\n")
        keys.append(compilation.cache_key.__wrapped__())
    assert keys[0] == keys[1]
    assert len(set(keys)) == len(edited) + 1


def test_another_processor_or_another_version_of_what_compiles_leads_to_another_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "kernel_sources", list)
    keys = [compilation.cache_key.__wrapped__()]
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")
    keys.append(compilation.cache_key.__wrapped__())
    for changed in ("numba", "llvmlite", "numpy"):
        monkeypatch.setattr(compilation, "version", lambda name, changed=changed: "9" if name == changed else "1")
        keys.append(compilation.cache_key.__wrapped__())
    monkeypatch.setattr("platform.python_version", lambda: "3.99")
    keys.append(compilation.cache_key.__wrapped__())
    assert len(set(keys)) == len(keys)


def test_only_the_latest_folders_of_earlier_sources_are_kept(place: Path) -> None:
    kernels = place / "vessel_hsmc_ros"
    for age in range(6):
        (kernels / f"old{age}").mkdir(parents=True)
        os.utime(kernels / f"old{age}", (1e9 - age, 1e9 - age))
    with compilation.cached("a_kernel"):
        pass
    assert {path.name for path in kernels.iterdir()} == {
        compilation.cache_key(),
        *(f"old{age}" for age in range(compilation.KEPT_VERSIONS - 1)),
    }


@only_compiled
def test_without_a_writable_folder_a_kernel_is_compiled_and_not_stored(
    place: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (place / "vessel_hsmc_ros").write_text("a file where the folder should be")
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert "cannot be kept" in caplog.text


def test_an_installation_that_is_not_writable_uses_the_users_cache_folder(monkeypatch: pytest.MonkeyPatch, place: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(place))
    assert compilation.cache_places()[-1] == place / "vessel_hsmc_ros" / "kernels"


@only_compiled
def test_compilation_can_be_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(compilation.DISABLED, "0")
    assert compilation.available()
    compilation.disable()
    assert not compilation.available()


@pytest.mark.parametrize("variable", [compilation.DISABLED, "NUMBA_DISABLE_JIT"])
def test_kernels_are_interpreted_where_compilation_is_switched_off(
    monkeypatch: pytest.MonkeyPatch, place: Path, variable: str
) -> None:
    monkeypatch.setenv(variable, "1")
    assert Compiled(doubled, "", {})(VALUES) == 12.0
    assert Compiled(doubled, "", {"twice": thrice})(VALUES) == 18.0
    assert not stored(place)
