"""Fault scripts: what is read, and what is refused with a reason."""

from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.faults import KINDS, Fault, FaultScript
from vessel_hsmc_ros.scenario.fault_script import dump_script, load_script, parse_script
from vessel_hsmc_ros.scenario.scenario import check_script, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

LOCKSTEP = load_scenario("figure_eight")
REAL_TIME = load_scenario("figure_eight", {f"{n}.lockstep": False for n in ("vessel_sim", "reference_ship", "controller")})


def checked(entry: str, lockstep: bool = True) -> FaultScript:
    script = parse_script(f"faults: [{{{entry}}}]", "script")
    check_script(script, LOCKSTEP if lockstep else REAL_TIME)
    return script


def test_a_script_has_its_seed_and_its_faults_in_order() -> None:
    script = parse_script("seed: 5\nfaults:\n  - {at: 1, duration: 2, kind: drop, topic: odom}\n", "script")
    assert script == FaultScript((Fault(at=1.0, duration=2.0, kind="drop", topic="odom"),), 5)


@pytest.mark.parametrize("path", sorted((share_directory() / "config" / "faults").glob("*.yaml")), ids=lambda path: path.stem)
def test_a_script_of_the_package_is_read_and_written(path: Path) -> None:
    script = parse_script(path.read_text(encoding="utf-8"), path.name)
    check_script(script, REAL_TIME)
    assert parse_script(dump_script(script), "dump") == script


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[1]", "is not a fault script: it must have seed and a list named faults"),
        ("faults: {}", "is not a fault script: faults must be a list"),
        ("faults: [", "cannot be read"),
        ("faults: []\nspeed: 1", "speed is unknown: a fault script has seed and faults"),
        ("faults: []\nseed: x", "seed must be an integer from 0 to 4294967295.*got 'x'"),
        ("faults: [3]", r"faults\[0\] must be .*got 3"),
    ],
)
def test_what_is_no_script_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ScenarioError, match=reason):
        parse_script(text, "script")


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("at: -1, kind: drop, topic: odom", r"faults\[0\].at must be a finite number from 0 to 1e\+06 s.*got -1.0"),
        ("at: 1, kind: drp, topic: odom", r"faults\[0\].kind must be one of drop, delay.*got drp"),
        ("at: 1, kind: drop, tpoic: odom", r"faults\[0\].tpoic is not a parameter: did you mean topic\?"),
        ("at: 1, kind: drop", r"faults\[0\] has no topic: a fault of kind drop needs it"),
        ("kind: drop, topic: odom", r"faults\[0\] has no at: "),
        (
            "at: 1, duration: 2, kind: kill, node: controller",
            r"faults\[0\].duration does not apply to kind kill, which has at, kind",
        ),
        ("at: 1, kind: delay, topic: odom", r"faults\[0\] has no delay: "),
        (
            "at: 1, kind: drop, topic: odom, delay: 1",
            r"faults\[0\].delay does not apply to kind drop, which has at",
        ),
        (
            "at: 1, kind: drop, topic: clock",
            r"faults\[0\].topic must be one of odom, ref.*got clock",
        ),
        ("at: 1, kind: drop, topic: odom, probability: 2", "must be a finite number from 0 to 1"),
        ("at: 1, kind: corrupt, topic: odom, field: pose.x", "must be a floating-point number of nav_msgs/msg/Odometry"),
        ("at: 1, kind: corrupt, topic: odom, field: header.frame_id", "must be a floating-point number"),
        ("at: 1, kind: lose, topic: odom", r"faults\[0\].topic must be an actuator, one of cmd_wrench"),
        ("at: 1, kind: drop, topic: thrusters/port/thrust", "must be one of odom, reference, cmd_wrench"),
        ("at: 1e5, kind: drop, topic: odom", r"faults\[0\].at must be at most .* the end of the run .got 100000"),
        ("at: 1, kind: kill, node: controller", "is not possible in lockstep, where time waits for every node: --real-time"),
        ("at: 1, kind: clock_step, offset: 1", "is not possible in lockstep"),
    ],
)
def test_a_fault_that_cannot_be_carried_out_is_refused(entry: str, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        checked(entry)


@pytest.mark.parametrize(("duration", "at", "allowed"), [(50.0, 50.0, True), (50.0, 50.5, False), (0.0, 1e5, True)])
def test_a_fault_begins_before_the_end_of_a_run_that_has_one(duration: float, at: float, allowed: bool) -> None:
    script = parse_script(f"faults: [{{at: {at}, kind: drop, topic: odom}}]", "script")
    scenario = LOCKSTEP.changed({"vessel_sim.duration": duration})
    if allowed:
        check_script(script, scenario)
    else:
        with pytest.raises(ParameterError, match=r"at must be at most 50 s, the end of the run \(got 50\.5 s\)"):
            check_script(script, scenario)


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("at: 1, kind: stop, node: controller", r"faults\[0\] has no duration"),
        ("at: 1, kind: kill, node: pilot", r"faults\[0\].node must be one of recorder, controller.*got pilot"),
        ("at: 1, kind: kill, node: vessel_sim", "the plant ends the run; restart brings it back"),
        ("at: 1, duration: 1, kind: restart, node: recorder", "a second recorder would overwrite the bag"),
    ],
)
def test_a_fault_of_a_process_that_cannot_be_carried_out_is_refused(entry: str, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        checked(entry, lockstep=False)


def test_every_fault_is_described_in_one_line() -> None:
    assert Fault(at=1.0, kind="drop", topic="odom").describe() == "drop of odom"
    text = Fault(at=1.0, kind="delay", topic="odom", delay=0.5, jitter=0.25).describe()
    assert text == "delay of odom (delay = 0.5, jitter = 0.25)"
    assert Fault(at=1.0, kind="clock_step", offset=2.0).describe() == "clock_step of all nodes (offset = 2)"


def test_a_missing_script_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"fault script .*none.yaml cannot be read"):
        load_script(tmp_path / "none.yaml")


def test_every_kind_names_its_settings() -> None:
    known = set(Fault.__dataclass_fields__)
    assert all({*kind.takes, *kind.needs} <= known and {*kind.needs} <= {*kind.takes} for kind in KINDS.values())


def test_a_scenario_may_bring_its_faults(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text(
        "/**/vessel_sim:\n  ros__parameters: {seed: 4}\nfaults:\n  - {at: 1.0, kind: drop, topic: odom}\n", encoding="utf-8"
    )
    assert load_scenario(path).faults == FaultScript((Fault(at=1.0, kind="drop", topic="odom"),), 4)
    assert LOCKSTEP.faults is None


def test_a_scenario_with_faults_is_not_simulated_without_them(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text(
        "/**/vessel_sim:\n  ros__parameters: {duration: 1.0}\nfaults:\n  - {at: 0.5, kind: drop, topic: odom}\n", encoding="utf-8"
    )
    with pytest.raises(ScenarioError, match="own has faults, which only the nodes carry out: vessel-hsmc run"):
        simulate(load_scenario(path))


@pytest.mark.parametrize("real_time", [False, True])
def test_scripted_faults_and_late_odometry_need_real_time(tmp_path: Path, real_time: bool) -> None:
    """In lockstep a message that is lost looks like one that is on its way."""
    path = tmp_path / "own.yaml"
    faults = "faults:\n  - {at: 0.5, kind: drop, topic: odom}\n"
    mode = "/**:\n  ros__parameters: {lockstep: false}\n" if real_time else ""
    path.write_text(f"{mode}/**/vessel_sim:\n  ros__parameters: {{sensors: {{delay: 0.1}}}}\n{faults}", encoding="utf-8")
    if real_time:
        assert load_scenario(path).faults is not None
        return
    with pytest.raises(ScenarioError, match=r"vessel_sim.sensors.delay must be 0 s in lockstep with scripted faults .*got 0.1 s"):
        load_scenario(path)
