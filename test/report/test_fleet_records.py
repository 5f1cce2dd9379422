"""Records of a bag with several vessels, commands between control steps, and paths that were set by messages."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import bag_making
import numpy as np
import pytest
from records import make_run

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.metrics import evaluate
from vessel_hsmc_ros.messages.conversions import path_event
from vessel_hsmc_ros.report import from_bag, page
from vessel_hsmc_ros.report.record import Mark, Record, planned
from vessel_hsmc_ros.scenario.scenario import load_scenario

STEPS = {"/vessel_10/": 6, "/vessel_2/": 4, "/vessel_1/": 3}


def test_every_vessel_of_a_fleet_has_its_own_record_in_the_order_of_the_numbers(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", notes={"messages_dropped": "7"})
    own = len(bag_making.TYPES) - 1  # /clock is that of all
    for namespace, steps in STEPS.items():
        bag_making.write_run(None, steps, namespace=namespace, writer=writer, close=False)
    writer.close()
    found = from_bag.of_fleet(open_bag(tmp_path / "bag"), {"seed": 5})
    assert [record.name for record in found] == ["vessel_1", "vessel_2", "vessel_10"]
    for record in found:
        assert record.facts["messages_recorded"] == own * STEPS[f"/{record.name}/"]
        assert record.facts["messages_dropped"] == 7
        assert (record.provenance["namespace"], record.provenance["seed"]) == (record.name, 5)
        assert len(record.run.time) == STEPS[f"/{record.name}/"]


def test_the_command_at_a_control_step_is_the_latest_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_from_bag, "forces", lambda series: series.forces)
    commands = SimpleNamespace(
        stamp=np.array([30, 10, 40, 20]) * 10**9, forces=np.array([[3.0, -3.0], [1.0, -1.0], [4.0, -4.0], [2.0, -2.0]])
    )
    run = make_run(np.arange(3.0), np.zeros((3, 6)), control={"time": np.arange(3.0), "a": np.arange(3.0)})
    steps = SimpleNamespace(stamp=np.array([10, 25, 45]) * 10**9)
    topics: Any = {"cmd_wrench": commands, "controller/state": steps}
    found = from_bag._with_commands(run, topics, 0).control
    assert found["commanded"].tolist() == [[1.0, -1.0], [2.0, -2.0], [4.0, -4.0]]
    assert found["a"].tolist() == [0.0, 1.0, 2.0]
    alone: Any = {"cmd_wrench": commands}
    found = from_bag._with_commands(run, alone, 5 * 10**9).control
    assert found["time"].tolist() == pytest.approx([5.0, 15.0, 25.0, 35.0])
    assert found["commanded"][:, 0].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_of_the_paths_that_were_sent_those_that_were_taken_are_planned_from_their_times_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken, refused = [(0.0, 0.0), (50.0, 0.0)], [(0.0, 0.0), (0.0, 70.0)]
    last = [(50.0, 0.0), (50.0, 90.0)]

    def sent(points: list[tuple[float, float]]) -> Any:
        return [SimpleNamespace(pose=SimpleNamespace(position=SimpleNamespace(x=x, y=y))) for x, y in points]

    class Sent:
        """A bag with three paths, whose reference begins at 12 s."""

        topics: ClassVar[Any] = {
            "/path": {"poses": [sent(points) for points in (refused, taken, last)]},
            "/reference": SimpleNamespace(stamp=np.array([13, 12]) * 10**9),
        }

        def readable(self, topic: str) -> bool:
            return topic in self.topics

    given: list[Any] = []
    scenario = load_scenario("waypoints")
    plan = planned(scenario)
    assert plan is not None

    def noted(_: Any, paths: Any) -> Any:
        given.extend(paths)
        return plan

    monkeypatch.setattr(from_bag, "planned", noted)
    marks = [Mark(2.0, "path", path_event(taken)), Mark(3.0, "goal", "x 1"), Mark(4.0, "path", path_event(last))]
    bag: Any = Sent()
    found = from_bag._track(bag, "/", scenario, marks, 10 * 10**9)
    assert given == [(2.0, taken), (4.0, last)]
    assert found is not None
    assert found.stretches[0].begin == pytest.approx(plan.stretches[0].begin + 2.0)


@pytest.mark.parametrize(
    ("provenance", "compared"),
    [
        ([{"bag": "a", "namespace": "vessel_1"}, {"bag": "a", "namespace": "vessel_2"}], False),
        ([{"bag": "a", "namespace": "alpha"}, {"bag": "b", "namespace": "beta"}], True),
        ([{"bag": "a"}, {"bag": "b"}], True),
        ([{"bag": "a"}, {"bag": "a"}], True),
    ],
)
def test_runs_are_compared_with_the_first_one_but_the_vessels_of_a_fleet_are_not(
    provenance: list[dict[str, str]], compared: bool
) -> None:
    time = np.arange(50.0)
    records = []
    for number, origin in enumerate(provenance):
        run = make_run(time, np.full((50, 6), 1.0 + number))
        metrics = evaluate(run.time, run.state, run.reference, run.wrench)
        records.append(Record(f"run {number}", run, metrics, provenance=origin))
    text = page.render(records, "title", page.hull_of(records))
    assert ("its difference from run 0" in text) == compared
    assert ('<small class="worse">' in text) == compared
