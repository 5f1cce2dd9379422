"""What counts where a value is given in several places, and that 0 and an empty text are values: a table for all verbs."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from reaching import Reach, exit_code_of

from vessel_hsmc_ros.scenario.parameters import NODES as PARAMETERS

MINE = """
vessel_sim: {ros__parameters: {duration: 9.0, seed: 4, rate_hz: 100.0}}
controller: {ros__parameters: {law: pd, rate_hz: 100.0}}
reference_ship: {ros__parameters: {rate_hz: 100.0}}
faults: [{at: 1.0, duration: 0.5, kind: drop, topic: odom}]
"""

FILES = {
    "mine.yaml": MINE,
    "calm.yaml": MINE.replace("faults:", "#"),
    "more.yaml": "vessel_sim: {ros__parameters: {duration: 8.0, seed: 5}}\n",
    "other.yaml": "faults:\n  - {at: 2.0, duration: 0.5, kind: drop, topic: reference}\n",
    "none.yaml": "faults: []\n",
    "suite.yaml": "set: {vessel_sim.seed: 2}\nrows:\n  - {name: a, scenario: calm.yaml, set: {vessel_sim.seed: 3}}\n",
    "drawn.yaml": "scenario: calm.yaml\nruns: 2\nseed: 6\ndraw: {vessel_sim.sensors.position_noise: {uniform: [0.1, 0.2]}}\n",
    "one.csv": "",
}

OFFLINE, NODES = "vessel_hsmc_ros.studies.scenario_run.run_offline", "vessel_hsmc_ros.studies.scenario_run.run_nodes"
FLEET = "vessel_hsmc_ros.cli.run.run_vessels"
COMPARE, SWEEP = "vessel_hsmc_ros.studies.comparison.compare", "vessel_hsmc_ros.studies.campaign.execute.compute_rows"
TUNE, CAMPAIGN = "vessel_hsmc_ros.studies.tuning.result.tune", "vessel_hsmc_ros.studies.campaign.execute.run_campaign"
REPORT, INIT, GAINS = "vessel_hsmc_ros.report.page.make", "vessel_hsmc_ros.cli.boat._text", "vessel_hsmc_ros.cli.gains.study"
PHYSICS, ROW = "vessel_hsmc_ros.cli.boat.Physics", "vessel_hsmc_ros.studies.campaign.dataset.Row.read"


class Case(NamedTuple):
    """A command, the function that it leads to, what of its arguments counts, and the value that this has."""

    command: str
    target: str
    counts: Callable[[dict[str, Any]], Any]
    value: Any


def of_run(found: dict[str, Any]) -> tuple[object, ...]:
    """Duration, seed, and law of a scenario."""
    scenario = found.get("scenario") or found["base"]
    return scenario.vessel_sim.duration, scenario.vessel_sim.seed, scenario.controller.law


def rates(found: dict[str, Any]) -> tuple[float, float]:
    """Of the ship and of the law."""
    return found["scenario"].vessel_sim.rate_hz, found["scenario"].controller.rate_hz


def lockstep(found: dict[str, Any]) -> list[bool]:
    scenario = found["scenario"]
    return [getattr(scenario, node).lockstep for node in ("vessel_sim", "reference_ship", "controller", "recorder")]


def faults(found: dict[str, Any]) -> list[tuple[float, str]]:
    return [(fault.at, fault.topic) for fault in found["faults"].faults] if found["faults"] else []


def tasks(found: dict[str, Any]) -> list[tuple[str, object, float | None]]:
    """Law, seed and rate of each run of a comparison."""
    return [(task.law, task.row.changes.get("vessel_sim.seed"), task.rate_hz) for task in found["tasks"]]


def planned(found: dict[str, Any]) -> list[tuple[object, object]]:
    """Seed and law of each run of a sweep."""
    plan = found["campaign"]
    return [(plan.planned(run).seed, plan.planned(run).law) for run in found["runs"]]


def tuned(found: dict[str, Any]) -> tuple[object, ...]:
    """Law, seed of the search and of the run, and the runs that are held out with their seeds."""
    tuning, unseen = found["tuning"], [*found.values()][3]
    held_out = [(case.name, case.scenario.vessel_sim.seed) for case in unseen]
    return tuning.law, tuning.seed, tuning.cases[0].scenario.vessel_sim.seed, held_out


def named(*names: str) -> Callable[[dict[str, Any]], Any]:
    """Some arguments of the function."""
    return lambda found: tuple(found[name] for name in names)


SEED_9, SEED_0 = "--set vessel_sim.seed=9", "--set vessel_sim.seed=0"
GAIN = "--gain controller.pd.heading_gain=1e5:4e6"
STEPPED = [f"--set {node}.lockstep=true" for node in PARAMETERS]
CASES = [
    # a scenario file, its changes one by one, and the later one of two
    Case("simulate calm.yaml", OFFLINE, of_run, (9.0, 4, "pd")),
    Case(f"simulate calm.yaml {SEED_9}", OFFLINE, of_run, (9.0, 9, "pd")),
    Case(f"simulate calm.yaml {SEED_9} {SEED_0}", OFFLINE, of_run, (9.0, 0, "pd")),
    Case(f"simulate calm.yaml {SEED_0} --set @more.yaml", OFFLINE, of_run, (8.0, 5, "pd")),
    Case(f"simulate calm.yaml --set @more.yaml {SEED_0}", OFFLINE, of_run, (8.0, 0, "pd")),
    Case("simulate calm.yaml --set controller.law=los_pid", OFFLINE, of_run, (9.0, 4, "los_pid")),
    Case("simulate calm.yaml --no-bag", OFFLINE, named("with_bag"), (False,)),
    Case("simulate calm.yaml --no-page", OFFLINE, named("with_bag", "with_page"), (True, False)),
    Case("run mine.yaml --no-page", NODES, named("with_page"), (False,)),
    Case("simulate --campaign there --run 0", ROW, named("folder", "run"), (Path("there"), 0)),
    Case(f"run mine.yaml {SEED_0} --set @more.yaml", NODES, of_run, (8.0, 5, "pd")),
    Case("run mine.yaml --set vessel_sim.duration=0", NODES, of_run, (0.0, 4, "pd")),
    Case("run mine.yaml", NODES, faults, [(1.0, "odom")]),
    Case("run mine.yaml --faults other.yaml", NODES, faults, [(2.0, "reference")]),
    Case("run mine.yaml", NODES, lockstep, [True] * 4),
    Case("run mine.yaml --real-time", NODES, lockstep, [False] * 4),
    Case(f"run mine.yaml --real-time {' '.join(STEPPED)}", NODES, lockstep, [True] * 4),
    Case("run mine.yaml --real-time --set vessel_sim.rate_hz=50", NODES, rates, (50.0, 100.0)),
    Case("run mine.yaml", NODES, named("live_port"), (None,)),
    Case("run --campaign there --run 0", ROW, named("folder", "run"), (Path("there"), 0)),
    Case(f"run calm.yaml --vessels 2 --spacing 0 {SEED_0}", FLEET, named("count", "spacing"), (2, 0.0)),
    Case(f"run calm.yaml --vessels 1 {SEED_0}", FLEET, of_run, (9.0, 0, "pd")),
    Case("compare calm.yaml --laws pd --rate-hz 50", COMPARE, tasks, [("pd", None, 50.0)]),
    Case("compare calm.yaml --laws pd --rate-hz 0", COMPARE, tasks, [("pd", None, 0.0)]),
    Case("compare calm.yaml --laws los_pid --set controller.law=pd", COMPARE, tasks, [("los_pid", None, None)]),
    Case(f"compare --suite suite.yaml --laws pd {SEED_0}", COMPARE, tasks, [("pd", 0, None)]),
    Case("compare --suite suite.yaml --laws pd", COMPARE, tasks, [("pd", 3, None)]),
    Case("compare calm.yaml --workers 2", COMPARE, named("jobs"), (2,)),
    Case(f"sweep calm.yaml controller.rate_hz=50,100 {SEED_0}", SWEEP, planned, [(0, "pd")] * 2),
    Case(f"sweep calm.yaml vessel_sim.seed=0,1 {SEED_9}", SWEEP, planned, [(0, "pd"), (1, "pd")]),
    Case("sweep calm.yaml vessel_sim.seed=1 --laws los_pid --set controller.law=pd", SWEEP, planned, [(1, "los_pid")]),
    Case(f"tune calm.yaml {GAIN}", TUNE, tuned, ("pd", 1, 4, [("calm", 1_000_007)])),
    Case(f"tune calm.yaml {GAIN} --seed 0 {SEED_0}", TUNE, tuned, ("pd", 0, 0, [("calm", 1_000_003)])),
    Case(f"tune calm.yaml {GAIN} --law pd --set controller.law=los_pid", TUNE, tuned, ("pd", 1, 4, [("calm", 1_000_007)])),
    Case(f"tune calm.yaml {GAIN} --held-out mine.yaml {SEED_0}", TUNE, tuned, ("pd", 1, 0, [("mine", 0)])),
    Case(f"tune calm.yaml {GAIN} --held-out suite.yaml", TUNE, tuned, ("pd", 1, 4, [("a", 3)])),
    Case(f"tune calm.yaml {GAIN} --trials 1 --output there", TUNE, lambda found: [*found.values()][1:3], [Path("there"), 1]),
    Case("campaign drawn.yaml", CAMPAIGN, named("seed", "runs", "workers", "scheduler"), (None, None, None, "")),
    Case("campaign drawn.yaml --seed 0 --runs 1", CAMPAIGN, named("seed", "runs"), (0, 1)),
    Case("report bag --hull-length 0", REPORT, lambda found: found["options"].hull.length, 0.0),
    Case("gains calm.yaml --set controller.law=los_pid", GAINS, lambda found: found["scenario"].controller.law, "los_pid"),
    Case(f"ardupilot calm.yaml {SEED_0}", PHYSICS, lambda found: found["parameters"].seed, 0),
    Case(
        "init boat --length 5 --current 0 --gps-noise 0",
        INIT,
        named("given"),
        ({"length": 5.0, "current": 0.0, "gps_noise": 0.0},),
    ),
]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with the files of the commands, in which they run."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.command)
def test_what_counts_arrives(reach: Reach, files: Path, monkeypatch: pytest.MonkeyPatch, case: Case) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    assert case.counts(reach(case.target, *case.command.split())) == case.value


WRONG = {
    "simulate ''": "scenario  is unknown",
    "simulate calm.yaml --set ''": "must be node.param=value",
    "simulate calm.yaml --set @": "parameters file . cannot be read",
    "simulate calm.yaml --set vessel_sim.duration=0": "vessel_sim.duration must be above 0 s",
    "simulate calm.yaml --set vessel_sim.rate_hz=0": "vessel_sim.rate_hz must be",
    "simulate mine.yaml": "has faults, which only the nodes carry out",
    "simulate calm.yaml --campaign there --run 0": "without SCENARIO",
    f"simulate --campaign there --run 0 {SEED_0}": "without SCENARIO, --set",
    "simulate --run 0": "to repeat a run of a campaign give --campaign and --run",
    "simulate --campaign there": "to repeat a run of a campaign give --campaign and --run",
    "simulate calm.yaml --run 0": "without SCENARIO",
    "simulate --campaign there --run -1": "Invalid value for '--run'",
    "run ''": "scenario  is unknown",
    "run --campaign there --run 0 --real-time": "without SCENARIO",
    "run --campaign there --run 0 --faults other.yaml": "without SCENARIO",
    "run calm.yaml --faults ''": "cannot be read",
    "run calm.yaml --vessels 0": "Invalid value for '--vessels'",
    "run mine.yaml --vessels 2": "cannot be given with a scenario that has faults",
    "run calm.yaml --vessels 2 --faults other.yaml": "cannot be given with --campaign, --faults",
    "run calm.yaml --vessels 2 --live": "cannot be given with --campaign, --faults, --live",
    "run calm.yaml --vessels 2 --composed": "cannot be given with --campaign, --faults, --live, --composed or --processes",
    "run calm.yaml --vessels 2 --processes": "cannot be given with --campaign, --faults, --live, --composed or --processes",
    "run calm.yaml --real-time --composed": "--composed must be in lockstep and without faults",
    "run calm.yaml --faults other.yaml --composed": "--composed must be in lockstep and without faults",
    "run mine.yaml --composed": "--composed must be in lockstep and without faults",
    "compare calm.yaml --laws pd --rate-hz 0": "controller.rate_hz must be",
    "compare calm.yaml --laws ''": "--laws must be",
    "compare calm.yaml --laws ,": "--laws must be",
    "compare --suite ''": "suite  is unknown",
    "compare . --rate-hz 0": "recorded runs cannot be compared with scenarios",
    "compare . --laws ''": "recorded runs cannot be compared with scenarios",
    "compare . --suite ''": "recorded runs cannot be compared with scenarios",
    "compare . calm.yaml": "recorded runs cannot be compared with scenarios",
    "compare calm.yaml --workers 0": "Invalid value for '--workers'",
    "sweep calm.yaml vessel_sim.seed=1,2 --laws ''": "--laws must be",
    "sweep calm.yaml vessel_sim.seed=": "(got [])",
    "sweep calm.yaml vessel_sim.seed=1:2:0": "count from 2",
    "sweep calm.yaml vessel_sim.seed=1 --metric ''": "metrics must be",
    "sweep calm.yaml": "Missing argument",
    f"tune calm.yaml {GAIN} --law ''": "controller.law must be one of",
    f"tune calm.yaml {GAIN} --held-out ''": "scenario  is unknown",
    f"tune calm.yaml {GAIN} --second-metric ''": "--second-metric must be",
    f"tune calm.yaml {GAIN} --trials 0": "Invalid value for '--trials'",
    "tune calm.yaml --gain controller.pd.heading_gain=0:0": "controller.pd.heading_gain=0:0",
    "campaign drawn.yaml --runs 0": "Invalid value for '--runs'",
    "campaign drawn.yaml --seed -1": "Invalid value for '--seed'",
    "campaign drawn.yaml --workers 1 --scheduler tcp://host:1": "not both",
    "identify one.csv --vessel ''": "vessel  is unknown",
    "identify one.csv --held-out one.csv": "--held-out",
    "identify one.csv --column ''": "--column must be",
    "init boat --vessel ''": "vessel  is unknown",
    "init boat --length 0": "--length must be",
    "init boat --length 5 --interface ''": "--interface  is not known",
    "check --interface ''": "--interface  is not known",
    "check --pulse ''": "--pulse must be",
    "check . --pulse 0,0": "--pulse cannot be given with a bag",
    "ardupilot calm.yaml --pulses 1500,1500,1500": "must be three increasing widths",
    "ardupilot calm.yaml --servos ''": "--servos must be",
    "gains ''": "scenario  is unknown",
    "replay . --rate 0": "Invalid value for '--rate'",
    "replay . --set a.b=1": "--set goes with --verify",
    "replay . --verify --loop": "exclude each other",
    "replay . --verify --with a.b=1": "exclude each other",
    "replay . --with a.b=1 --topic /odom": "exclude each other",
    "replay . --output there": "--output goes with --with",
    "replay . --verify --output there": "--output goes with --with",
    "replay . --namespace alpha": "--namespace goes with --verify or --with",
    "replay . --loop --namespace ''": "--namespace goes with --verify or --with",
    "run mine.yaml --live-port 9000": "--live-port goes with --live",
    "run mine.yaml --live-port 8765": "--live-port goes with --live",
    "run mine.yaml --spacing 0": "--spacing goes with --vessels",
    "compare . --workers 2": "--workers goes with scenarios",
    "compare . --interpreted": "--interpreted goes with scenarios",
    "check . --seconds 8": "--seconds goes with running nodes",
    "check . --namespace alpha": "--namespace goes with running nodes",
    "goto 1 2 0 --heading-deg 0": "either as HEADING",
    "goto 1 nan 0": "must be finite numbers",
    "watch --json": "give --once too",
    "set controller.rate_hz": "must be node.param=value",
}


@pytest.mark.parametrize("command", WRONG)
def test_what_is_wrong_ends_with_2_before_anything_is_written(
    files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    arguments = ["" if part == "''" else part for part in command.split()]
    assert exit_code_of(monkeypatch, *arguments) == 2
    shown = capsys.readouterr()
    assert WRONG[command] in shown.err
    assert shown.out == ""
    assert sorted(path.name for path in files.iterdir()) == sorted(FILES)
