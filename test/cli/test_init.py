import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.options import parse_changes
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory, shell_command
from vessel_hsmc_ros.guidance.curve_motion import Demand
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.forecast.feasibility import ShipCheck, verdict

DATA = ["--length", "4", "--mass", "500", "--surge-force-limit", "300", "--yaw-moment-limit", "250", "--wind", "5"]


def call(*arguments: str) -> str:
    return CliRunner().invoke(cli, arguments, standalone_mode=False, catch_exceptions=False).output


def test_init_writes_a_scenario_that_loads_and_names_the_next_command(tmp_path: Path) -> None:
    (tmp_path / "boats").mkdir()
    output = call("init", str(tmp_path / "boats" / "my_boat"), *DATA)
    path = tmp_path / "boats" / "my_boat.yaml"
    *checked, last = output.strip().splitlines()
    assert last == f"scenario: {path}; next: {shell_command()} simulate {path}"
    assert checked[0].startswith("full surge force: 2.51 m/s; with the full yaw moment a turning circle of ")
    assert checked[1].startswith("the circle needs 34 % of the surge force, ")
    assert checked[2].startswith("follows its circle: position error ")
    assert "hierarchical" not in output  # the scenario is steered by guided
    assert load_scenario(path).controller.vessel.surge_force_limit == 300.0


def test_the_next_command_of_a_path_with_a_space_can_be_pasted(tmp_path: Path) -> None:
    output = call("init", str(tmp_path / "my boat"), *DATA, "--no-check")
    assert output.strip().endswith(f"next: {shell_command()} simulate '{tmp_path / 'my boat.yaml'}'")


@pytest.mark.parametrize(
    ("workspace", "on_path", "expected"),
    [
        ("", True, "vessel-hsmc"),
        ("", False, "vessel-hsmc"),
        ("/ws", True, "vessel-hsmc"),
        ("/ws", False, "ros2 run vessel_hsmc_ros vessel-hsmc"),
    ],
)
def test_the_next_command_is_one_that_the_shell_finds(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, workspace: str, on_path: bool, expected: str
) -> None:
    program = tmp_path / "vessel-hsmc"
    program.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path) if on_path else "/nowhere")
    monkeypatch.setenv("AMENT_PREFIX_PATH", workspace)
    assert shell_command() == expected


def test_the_check_states_no_digits_that_mean_nothing() -> None:
    check = ShipCheck(2.5, 1.97431, 0.5, 10.0, Demand(0.01, 1.0, 1.0), 0.3, 0.2, 4.91e-9, 2e-9, 300.0)
    first, _, last = verdict(check)
    assert first.startswith("full surge force: 2.5 m/s, beyond 1.97 m/s, up to which its hull data hold; with")
    assert last == "follows its circle: position error below 0.01 % of the ship's length in the last quarter of 300 s"
    *_, last = verdict(check._replace(error=0.1234, error_lengths=0.05))
    assert last.endswith("position error at most 0.123 m, 5 % of the ship's length, in the last quarter of 300 s")


def test_init_takes_a_vessel_of_the_library_and_changes_of_single_data(tmp_path: Path) -> None:
    output = call("init", str(tmp_path / "mine"), "--vessel", "otter", "--surge-force-limit", "150")
    assert "follows its circle" in output
    known = load_scenario(tmp_path / "mine.yaml").controller.vessel
    assert (known.name, known.surge_force_limit, known.yaw_inertia) == ("otter", 150.0, 39.325)


def test_init_refers_to_a_vessel_file_from_the_folder_of_the_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ships").mkdir()
    (tmp_path / "runs").mkdir()
    (tmp_path / "ships" / "tug.yaml").write_text((share_directory() / "config" / "vessels" / "otter.yaml").read_text())
    monkeypatch.chdir(tmp_path)
    call("init", "runs/mine", "--vessel", "ships/tug.yaml", "--no-check")
    assert 'vessel: "../ships/tug.yaml"' in (tmp_path / "runs" / "mine.yaml").read_text()
    monkeypatch.chdir("/")
    assert load_scenario(tmp_path / "runs" / "mine.yaml").vessel_sim.vessel.surge_inertia == 60.28


def test_main_data_that_are_no_hull_data_cannot_be_given_with_a_vessel(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="--mass cannot be given with --vessel: its hull data are those of otter"):
        call("init", str(tmp_path / "mine"), "--vessel", "otter", "--mass", "60")
    with pytest.raises(ScenarioError, match="vessel yacht is unknown"):
        call("init", str(tmp_path / "mine"), "--vessel", "yacht")


def test_thrusters_without_a_layout_are_refused_and_write_nothing(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="--thrusters needs --vessel"):
        call("init", str(tmp_path / "mine"), "--thrusters")
    with pytest.raises(ParameterError, match="thrusters"):
        call("init", str(tmp_path / "mine"), "--vessel", "paper_ship", "--thrusters")
    assert not [*tmp_path.iterdir()]


def test_a_ship_that_leaves_its_circle_is_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ["init", str(tmp_path / "mine"), "--wind", "40"], standalone_mode=False)
    assert "warning: does NOT follow its circle: position error" in result.stderr


def test_init_overwrites_no_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("precious")
    with pytest.raises(ScenarioError, match=r"mine\.yaml exists and is not overwritten"):
        call("init", str(path))
    assert path.read_text() == "precious"


def test_init_into_a_folder_that_does_not_exist_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"nowhere/mine\.yaml cannot be written: No such file or directory"):
        call("init", str(tmp_path / "nowhere" / "mine"))


def test_init_rejects_data_out_of_range_and_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"--mass must be .*got -5\.0"):
        call("init", str(tmp_path / "mine"), "--mass", "-5")
    assert list(tmp_path.iterdir()) == []


def test_simulate_warns_of_a_part_of_a_hull_on_standard_error(tmp_path: Path) -> None:
    path = tmp_path / "part.yaml"
    path.write_text("/**: {ros__parameters: {vessel: {surge_inertia: 5e3}}}\nvessel_sim: {ros__parameters: {duration: 1e9}}\n")
    result = CliRunner().invoke(cli, ["simulate", str(path)], standalone_mode=False)
    assert isinstance(result.exception, ParameterError)
    path.write_text("/**: {ros__parameters: {vessel: {surge_inertia: 5e3}}}\n")
    result = CliRunner().invoke(cli, ["simulate", str(path), "--output", str(tmp_path)], standalone_mode=False)
    assert "duration must be above 0 s" in str(result.exception)
    assert result.stderr.count("warning: ") == 3


def test_the_commands_of_the_page_on_ones_own_vessel_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[2] / "docs" / "own_vessel.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (arguments,) = re.findall(r"^vessel-hsmc (init my_boat .*)$", page, re.MULTILINE)
    call(*arguments.split())
    scenario = "./my_boat.yaml"
    for change in re.findall(r"`--set (\S+=\d+)`", page):
        load_scenario(scenario, parse_changes([change]))
    assert load_scenario(scenario).reference_ship.circle.radius == 20.0
    for mode in re.findall(r"`(?:reference_ship\.mode=)?(figure_eight|square|straight|lawnmower|goal)`", page):
        load_scenario(scenario, {"reference_ship.mode": mode})


def test_init_writes_the_connection_to_a_stack_beside_the_scenario(tmp_path: Path) -> None:
    output = call("init", str(tmp_path / "boat"), *DATA, "--interface", "otter", "--no-check")
    assert f"connection: {tmp_path / 'boat_otter.yaml'}, with the commands" in output
    assert "surge_force_limit: 300.0" in (tmp_path / "boat_otter.yaml").read_text()


def test_init_with_an_unknown_stack_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="did you mean mavros"):
        call("init", str(tmp_path / "boat"), *DATA, "--interface", "mavos")
    assert not list(tmp_path.iterdir())


TWIN = ("--thruster", "-0.8,0.4,60,40", "--thruster", "-0.8,-0.4,60,40")


def test_init_takes_thrusters_lag_current_and_noise_into_the_scenario(tmp_path: Path) -> None:
    known = ("--length", "2", "--mass", "60", "--lag", "0.2", "--current", "0.1", "--gps-noise", "0.3", "--top-speed", "1.8")
    call("init", str(tmp_path / "boat"), *known, *TWIN, "--no-check")
    scenario = load_scenario(tmp_path / "boat.yaml")
    plant, controller = scenario.vessel_sim, scenario.controller
    assert (plant.actuators.kind, plant.vessel.thrusters.names) == ("thrusters", ("port", "starboard"))
    assert [t.lag for t in plant.vessel.thrusters.thrusters()] == [0.2, 0.2]
    assert (plant.vessel.surge_force_limit, plant.vessel.yaw_moment_limit) == (120.0, 48.0)
    assert (controller.vessel.surge_lag, controller.vessel.yaw_lag) == (0.2, 0.2)
    assert plant.disturbance.current.east == scenario.reference_ship.motion.current == 0.1
    assert plant.sensors.position_noise == controller.observer.position_noise == 0.3
    assert plant.sensors.position_rate_hz == 5.0
    assert controller.observer.enabled
    assert "top speed 1.8 m/s" in (tmp_path / "boat.yaml").read_text()


def test_the_rate_of_the_positions_counts_where_they_have_noise(tmp_path: Path) -> None:
    for name, noise in (("with", ("--gps-noise", "0.3")), ("without", ())):
        call("init", str(tmp_path / name), "--vessel", "otter", "--gps-rate", "2", *noise, "--no-check")
    rates = [load_scenario(tmp_path / f"{name}.yaml").vessel_sim.sensors.position_rate_hz for name in ("with", "without")]
    assert rates == [2.0, 0.0]


def test_init_declares_a_lag_of_a_vessel_of_the_library_to_plant_and_law(tmp_path: Path) -> None:
    call("init", str(tmp_path / "mine"), "--vessel", "otter", "--lag", "0.3", "--no-check")
    scenario = load_scenario(tmp_path / "mine.yaml")
    assert scenario.vessel_sim.actuators.surge_lag == scenario.controller.vessel.surge_lag == 0.3


@pytest.mark.parametrize(
    ("given", "allowed"),
    [
        (("--thruster", "1,2"), "--thruster must be x,y,ahead,astern: x and y from -4 to 4 m"),
        (("--thruster", "1,9,10,10"), "x and y from -4 to 4 m"),
        (("--thruster", "1,0,0,10"), "thrust ahead above 0"),
        (("--thruster", "1,0,10,10"), "cannot give a surge force and a yaw moment independently"),
        (("--thruster", "-1,0,1_0,10"), "--thruster must be"),
        (("--thruster", "nan,0,10,10"), "such as -1.5,0.5,100,60"),
        ((*TWIN, "--vessel", "otter"), "--thruster cannot be given with --vessel"),
        (("--interface", "vrx"), "--interface vrx needs thrusters: give each with --thruster"),
        (("--current", "5"), "--current must be less than the top speed, 2.51 m/s"),
        (("--lag", "-1"), "--lag must be a finite number from 0 to 60 s"),
        (("--gps-noise", "1e3"), "from 0 to 100 m"),
        (("--gps-rate", "0"), "from 0.1 to 100 Hz"),
        (("--top-speed", "200"), "--speed must be"),
    ],
)
def test_what_is_known_of_a_boat_is_checked_and_nothing_is_written(tmp_path: Path, given: tuple[str, ...], allowed: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(allowed)):
        call("init", str(tmp_path / "boat"), *given)
    assert not [*tmp_path.iterdir()]


def test_noise_of_the_positions_is_no_failure_to_follow_the_circle() -> None:
    check = ShipCheck(2.5, 3.0, 0.5, 10.0, Demand(0.01, 1.0, 1.0), 0.3, 0.2, 0.2, 0.05, 300.0)
    assert not check.tracked
    assert check._replace(noise=0.04).tracked
    assert "of noise of its positions" in verdict(check._replace(noise=0.04))[-1]
