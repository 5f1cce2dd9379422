"""The registry of control laws: laws are checked when they are added, and those of installed packages are found."""

import dataclasses
import logging
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros import Law, Motion, Terms, make_controller, parameter
from vessel_hsmc_ros.control.guided.controller import GuidedController
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import LAWS, RESERVED, Origin, Registry
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import ControllerParameters

HERE = Origin("this test")
REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Gains:
    gain: float = parameter(2.0, "A gain.", low=0.0, high=10.0, tunable=True)


@dataclass(frozen=True)
class Undeclared:
    gain: float = 2.0


@dataclass(frozen=True)
class DefaultOutOfRange:
    gain: float = parameter(20.0, "A gain.", low=0.0, high=10.0)


@dataclass(frozen=True)
class IntegerDefault:
    gain: float = parameter(2, "A gain.")


class Constant(Law[Gains]):
    name = "constant"

    def step(self, *_: object) -> tuple[tuple[float, float], Terms]:
        return (self.parameters.gain, 0.0), Terms()


def law(**attributes: object) -> type:
    return type("Changed", (Constant,), {"name": "changed", **attributes})


def with_parameters(declared: type) -> type:
    def step(self: Any, *_: Any) -> Any: ...

    base: Any = Law[declared]  # type: ignore[valid-type]
    return type("Other", (Law,), {"__orig_bases__": (base,), "name": "other", "step": step})


class Incomplete(Law[Gains]):
    name = "incomplete"


class Bare(Law):  # type: ignore[type-arg]
    name = "bare"

    def step(self, *_: Any) -> Any: ...


def test_the_laws_of_this_package_are_named_by_their_classes() -> None:
    assert list(LAWS.built_in) == [
        "hierarchical",
        "hierarchical_printed",
        "guided",
        "course",
        "pd",
        "los_pid",
        "manoeuvre",
        "open_loop",
        "ashrafiuon",
        "backstepping",
        "hand_position",
        "nmpc",
    ]
    assert LAWS["guided"] == (GuidedController, GuidedParameters, None)


def test_the_reserved_names_are_the_parameters_of_the_controller_that_belong_to_no_law() -> None:
    assert set(RESERVED) == {field.name for field in dataclasses.fields(ControllerParameters)} - set(LAWS.built_in)


def test_an_added_law_is_made_by_its_name_with_its_parameters(laws: Registry) -> None:
    laws.add(Constant, origin=HERE)
    assert "constant" in laws
    assert list(laws)[-1] == "constant"
    made = make_controller("constant", 0.01, gain=3.0, surge_inertia=5.0)
    assert made.vessel.surge_inertia == 5.0
    assert made.step(REST, REST, (0.0, 0.0, 0.0))[0] == (3.0, 0.0)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"controller\.constant\.gian is not a parameter: did you mean gain\?"):
        make_controller("constant", 0.01, gian=3.0)


def test_a_law_alone_refuses_a_centre_of_percussion_ahead_that_only_the_control_loop_controls() -> None:
    with pytest.raises(
        ParameterError, match=r"sway_yaw_inertia = 600000 puts the centre of percussion 3.37 m ahead.*controlled_point"
    ):
        make_controller("guided", 0.02, sway_yaw_inertia=6e5)
    made = make_controller("guided", 0.02, sway_yaw_inertia=6e5, controlled_point="origin")
    assert made.vessel.yaw_inertia < 636e5
    assert make_controller("guided", 0.02, sway_yaw_inertia=-1e5).vessel == KnownVessel(sway_yaw_inertia=-1e5).as_controlled()


def test_a_variant_of_a_law_of_this_package_inherits_its_parameters(laws: Registry) -> None:
    laws.add(type("Variant", (GuidedController,), {"name": "variant"}), origin=HERE)
    assert laws["variant"].parameters is GuidedParameters


def test_laws_of_the_same_origin_are_replaced(laws: Registry) -> None:
    laws.add(Constant, law(), origin=HERE)
    laws.add(Constant, origin=HERE)
    assert list(laws.others) == ["constant"]


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (Gains, "Gains is not a subclass of vessel_hsmc_ros.Law"),
        (3.0, "3.0 is not a subclass of vessel_hsmc_ros.Law"),
        (Incomplete, "law incomplete lacks the method step"),
        (Bare, r"law bare declares no parameters: write `class Bare\(Law\[P\]\)` with a dataclass P"),
        (law(name=""), "Changed.name must be lower-case letters"),
        (law(name="My Law"), "Changed.name must be lower-case letters"),
        (law(name="vessel"), "the name vessel is used by the parameter controller.vessel"),
        (law(name="guided"), "the name guided is used by a law of vessel_hsmc_ros"),
        (law(name="taken"), "the name taken is used by another law of elsewhere"),
        (with_parameters(Undeclared), r"other.gain is not declared: write `gain: float = parameter\(...\)`"),
        (with_parameters(DefaultOutOfRange), "other.gain must be a finite number from 0 to 10.*got 20.0"),
        (with_parameters(IntegerDefault), "other.gain must have a default of its declared type .got 2"),
    ],
)
def test_an_incomplete_law_is_refused_with_the_reason_and_none_is_added(laws: Registry, wrong: object, reason: str) -> None:
    laws.add(law(name="taken"), origin=Origin("elsewhere"))
    before = dict(laws)
    with pytest.raises(ParameterError, match=reason):
        laws.add(Constant, wrong, origin=HERE)
    assert dict(laws) == before


def install(folder: Path, name: str, code: str, *entries: str) -> None:
    """Lay out a package as pip installs it: a module, and the metadata with its entry points."""
    (folder / f"{name}.py").write_text(code)
    metadata = folder / f"{name}-1.5.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.5\n")
    (metadata / "entry_points.txt").write_text("[vessel_hsmc_ros.laws]\n" + "\n".join(entries) + "\n")


RIVALS = ("ashrafiuon", "backstepping", "hand_position", "nmpc")
"""Laws of the package that are registered by entry points."""

EXAMPLE = (Path(__file__).parents[3] / "docs" / "examples" / "my_law.py").read_text(encoding="utf-8")


def test_the_law_of_an_installed_package_is_found_and_a_broken_one_is_left_out_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    install(tmp_path, "my_vessel_laws", EXAMPLE, "my_law = my_vessel_laws:MyLaw", "renamed = my_vessel_laws:MyLaw")
    install(tmp_path, "broken_laws", "import not_anywhere\n", "broken = broken_laws:Law")
    registry = Registry(GuidedController)
    assert registry["guided"].controller is GuidedController
    assert "my_vessel_laws" not in sys.modules  # a law of this package needs no other
    with caplog.at_level(logging.WARNING):
        assert list(registry) == ["guided", *RIVALS, "my_law"]
    assert registry["my_law"].origin == Origin("package my_vessel_laws 1.5 (my_vessel_laws:MyLaw)")
    assert sorted(caplog.messages) == [
        "warning: law broken of package broken_laws 1.5 is left out: ModuleNotFoundError: No module named 'not_anywhere'",
        "warning: law renamed of package my_vessel_laws 1.5 is left out: my_vessel_laws:MyLaw has another name, 'my_law'",
    ]
    with pytest.raises(ParameterError, match=r"the name my_law is used by another law of package my_vessel_laws 1\.5"):
        registry.add(law(name="my_law"), origin=HERE)
