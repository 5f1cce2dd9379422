from functools import lru_cache

import pytest
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.margins import study

HASTY = ("controller.law=guided", "controller.guided.surge_gain=40")


@lru_cache
def gains(*changes: str) -> Result:
    """The result of the command, which takes seconds to linearise the guided law: a text that several tests look at."""
    shorter = "vessel_sim.duration=50"  # the reference circles at one speed from the start
    arguments = ["gains", "case2_tracking", *(part for change in (shorter, *changes) for part in ("--set", change))]
    return CliRunner(env={"COLUMNS": "200"}).invoke(cli, arguments, catch_exceptions=False, standalone_mode=False)


def line_of(text: str, name: str) -> str:
    (line,) = (line for line in text.splitlines() if line.split()[:1] == [name])
    return line


@pytest.mark.long
def test_every_gain_is_listed_with_its_unit_meaning_and_value() -> None:
    result = gains(*HASTY)
    assert result.exit_code == 0
    for name, entry in entries(GuidedParameters).items():
        if entry.type is float:
            assert entry.unit in line_of(result.output, name)
            assert entry.description[:20] in line_of(result.output, name)
    assert line_of(result.output, "surge_gain").split()[-1] == "40"
    assert line_of(result.output, "cross_track").split()[-1] == "0.04"


@pytest.mark.long
def test_margins_of_three_loops_are_printed_and_small_ones_warned_of() -> None:
    calm = gains("controller.law=guided")
    for name in ("surge force", "yaw moment", "position across"):
        assert any(line.strip().startswith(name) and "°" in line for line in calm.output.splitlines())
    assert "warning: the loop of the" in gains(*HASTY).output
    assert "warning: the loop of the" not in calm.output


def test_the_numbers_and_margins_of_another_law_are_printed() -> None:
    shown = gains("controller.law=los_pid", "controller.los_pid.yaw_bandwidth=0.3").output
    assert line_of(shown, "yaw_bandwidth").split()[-1] == "0.3"
    assert "position across" in shown


def test_the_units_are_those_of_the_ship_and_actuators_that_are_not_declared_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    margins = study(load_scenario("case2_tracking", {"controller.law": "los_pid", "vessel_sim.duration": 20.0}))
    monkeypatch.setattr("vessel_hsmc_ros.cli.gains.study", lambda _: margins)  # those of this law are looked at above
    printed = gains.__wrapped__
    declared = {f"controller.vessel.{axis}_{what}": 0.0 for axis in ("surge", "yaw") for what in ("lag", "dead_time")}
    rates = {"controller.vessel.surge_force_rate": ".inf", "controller.vessel.yaw_moment_rate": ".inf"}
    known = printed("controller.law=guided", *(f"{name}={value}" for name, value in {**declared, **rates}.items())).output
    # sqrt(636e5/3e6) s is 4.6 s.
    assert "L = 32 m, T = 4.6 s\n" in known
    assert "T = 4.6 s; not all of lag, rate and dead time is declared" in printed("controller.law=guided").output
