"""Parameters that were renamed are read by their former names for one release, with a warning that has the present one."""

import warnings
from pathlib import Path

import pytest

from vessel_hsmc_ros import load_scenario, make_controller
from vessel_hsmc_ros.bags.recorded_scenario import former_names_accepted, recorded_scenario
from vessel_hsmc_ros.campaign.distributions import make_drawn
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import NODES, in_present_names
from vessel_hsmc_ros.scenario.scenario import dump_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.tuning.gains import parse_gains

RENAMED = {
    "controller.vessel.drift_decay": "controller.vessel.sway_damping_rate",
    "controller.vessel.drift_ratio": "controller.vessel.coriolis_ratio",
    "controller.observer.weather_walk": "controller.observer.current_walk",
    "controller.los_pid.drift_gain": "controller.los_pid.integral_gain",
    "controller.los_pid.resting_speed": "controller.los_pid.station_keeping_speed",
}
VALUE = 0.125


@pytest.mark.parametrize(("former", "present"), RENAMED.items())
def test_a_former_name_is_read_with_a_warning_that_has_the_present_one(former: str, present: str) -> None:
    with pytest.warns(FutureWarning, match=f"{former} is now called {present.rpartition('.')[2]}"):
        old = load_scenario("case2_tracking", {former: VALUE})
    assert old == load_scenario("case2_tracking", {present: VALUE})
    assert old.controller != load_scenario("case2_tracking").controller


def test_a_former_choice_is_read_with_a_warning_that_has_the_present_one() -> None:
    name = "controller.vessel.controlled_point"
    with pytest.warns(FutureWarning, match=r"controlled_point = pivot is now called percussion"):
        old = load_scenario("case2_tracking", {name: "pivot"})
    assert old.controller.vessel.controlled_point == "percussion"
    with pytest.raises(ParameterError, match="pivoting is not allowed: it takes one of ahead, percussion, origin"):
        load_scenario("case2_tracking", {name: "pivoting"})


def test_both_names_of_a_parameter_are_refused() -> None:
    both = {"controller.observer.weather_walk": 1.0, "controller.observer.current_walk": 1.0}
    with pytest.raises(ParameterError, match=r"weather_walk is the former name of .*current_walk, which is given too"):
        load_scenario("case2_tracking", {**both})
    with pytest.raises(ParameterError, match="one of them is enough"):
        make_controller("los_pid", 0.1, drift_gain=1.0, integral_gain=1.0)


def test_an_unknown_name_is_still_refused() -> None:
    with pytest.raises(ParameterError, match="drift_decoy is not a parameter"):
        load_scenario("case2_tracking", {"controller.vessel.drift_decoy": VALUE})


def test_a_recording_with_former_names_is_read_without_a_warning() -> None:
    now = load_scenario("case2_tracking", dict.fromkeys(RENAMED.values(), VALUE))
    text = dump_scenario(now)
    for former, present in RENAMED.items():
        text = text.replace(f"{present.rpartition('.')[2]}: {VALUE}", f"{former.rpartition('.')[2]}: {VALUE}")
    assert "sway_damping_rate" not in text
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with former_names_accepted():
            old = recorded_scenario(Path("bag"), now.name, text, {}, ("/",), None)
    assert old == parse_scenario(dump_scenario(now), now.name)


def test_names_of_every_node_are_present_ones_or_kept() -> None:
    values = dict.fromkeys(("vessel.drift_ratio", "controller.vessel.drift_ratio", "drift_ratio"), VALUE)
    with pytest.warns(FutureWarning, match="drift_ratio is now called coriolis_ratio"):
        assert list(in_present_names(values)) == ["vessel.coriolis_ratio", "controller.vessel.coriolis_ratio", "drift_ratio"]
    assert "controller" in NODES


def test_vessel_files_controllers_draws_and_tunings_take_former_names(tmp_path: Path) -> None:
    path = tmp_path / "boat.yaml"
    text = read_vessel("gunnerus").path.read_text().replace("sway_damping_rate", "drift_decay")
    path.write_text(text)
    with pytest.warns(FutureWarning, match="drift_decay is now called sway_damping_rate"):
        assert read_vessel(path).values == read_vessel("gunnerus").values
    with pytest.warns(FutureWarning, match="drift_gain"):
        made = make_controller("los_pid", 0.02, drift_gain=0.05)
    assert made.constants == make_controller("los_pid", 0.02, integral_gain=0.05).constants  # type: ignore[attr-defined]
    scenario = load_scenario("case2_tracking")
    with pytest.warns(FutureWarning, match=r"ship\.declared_drift_ratio"):
        assert (
            make_drawn("ship.declared_drift_ratio", {"uniform": [0.5, 1.5]}, scenario).parameter == "ship.declared_coriolis_ratio"
        )
    with pytest.warns(FutureWarning, match="drift_gain"):
        (gain,) = parse_gains(["controller.los_pid.drift_gain=0.1:0.5"], "los_pid", scenario)
    assert "integral_gain" in str(gain)
