"""Pages from bags: which signals they contain, and where their files go."""

import re
from pathlib import Path
from typing import Any

import bag_making
import numpy as np
import pytest
from boat_bags import EPOCH, sailed, write_boat
from unrendered import leave_unrendered

from vessel_hsmc_ros.bags.reader import Bag, Event, open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, BagWarning
from vessel_hsmc_ros.core.metrics import evaluate
from vessel_hsmc_ros.report.page import Options, make, page_of, read
from vessel_hsmc_ros.report.panels import panels
from vessel_hsmc_ros.report.record import Mark
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """A bag with every topic, in a run folder."""
    bag_making.write_run(tmp_path / "run" / "bag", 300)
    (tmp_path / "run" / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    (tmp_path / "run" / "run.json").write_text('{"git_commit": "abc", "seed": null, "metrics": {}}')
    return tmp_path / "run" / "bag"


def write_odometry(path: Path, topics: dict[str, str], count: int = 50, commands_from: int = 0) -> None:
    """Write a bag of another recorder: odometry, and wrench commands from some message on."""
    writer = BagWriter(path)
    made = {name: bag_making.topic(name, kind) for name, kind in topics.items()}
    for topic in made.values():
        writer.add_topic(topic)
    for k in range(count):
        stamp = 10**18 + k * 10**7
        for name, topic in made.items():
            if "wrench" not in name or k >= commands_from:
                message = bag_making.message(topic.kind, stamp, np.random.default_rng(k))
                writer.write(topic, bag_making.serialized(message, topic.kind), stamp, stamp)
    writer.close()


ODOMETRY = {"/boat/odom": "nav_msgs/msg/Odometry"}


def test_metrics_of_a_bag_are_those_of_its_run(recorded: Path) -> None:
    found = read([recorded])[0]
    run = open_bag(recorded).run(weights=False)
    assert found.metrics == evaluate(run.time, run.state, run.reference, run.wrench)
    assert found.provenance["git_commit"] == "abc"
    assert found.facts["messages_recorded"] == 3003


def test_panels_of_a_bag_show_commands_measurements_and_truth(recorded: Path) -> None:
    shown = {panel.title: [line.name for line in panel.lines] for panel in panels(read([recorded])[0])}
    assert shown["surge force"] == ["applied", "commanded"]
    assert shown["surge dynamics f_u and disturbance"] == ["estimate", "truth"]
    assert shown["sway velocity"] == ["measured", "ship", "reference"]
    assert shown["position, deviation from the truth"] == ["measured"]


def test_events_of_a_bag_are_the_marks_of_its_record(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    change = "controller.guided.position_gain: 0.3 -> 0.5"
    events = [
        Event(1.0, "vessel_sim", "pause", "paused"),
        Event(1.1, "reference_ship", "pause", "paused"),
        Event(2.0, "controller", "parameter", change),
        Event(2.0, "controller", "parameter", change),
        Event(3.0, "vessel_sim", "resume", "running"),
        Event(9.0, "vessel_sim", "pause", "paused"),
    ]
    monkeypatch.setattr(Bag, "events", lambda *_: events)
    assert read([recorded])[0].marks == (
        Mark(1.0, "pause", "vessel_sim, reference_ship"),
        Mark(2.0, "parameter", change),
        Mark(2.0, "parameter", change),
        Mark(3.0, "resume", "vessel_sim"),
        Mark(9.0, "pause", "vessel_sim"),
    )


def test_a_failure_in_the_summary_of_a_run_is_in_the_verdict(recorded: Path) -> None:
    (recorded.parent / "run.json").write_text('{"failure": "vessel_sim died with exit code 1", "exit_code": 1}')
    assert read([recorded])[0].verdict.startswith("The run failed after 2.99 s: vessel_sim died with exit code 1.")


def test_files_of_a_run_folder_are_beside_its_bag(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    made = make([recorded], Options(csv=True, figures="svg"))
    folder = recorded.parent
    assert made.files == {"page": folder / "report.html", "figures": folder / "figures", "csv": folder / "csv"}
    assert (folder / "csv" / "motion.csv").is_file()
    assert (folder / "figures" / "track.svg").is_file()


def test_a_bag_with_odometry_alone_has_a_page_without_metrics(tmp_path: Path) -> None:
    write_odometry(tmp_path / "foreign", ODOMETRY)
    made = make([tmp_path / "foreign"], Options(page=tmp_path / "page.html"))
    assert made.records[0].name == "foreign"
    assert made.records[0].metrics is None
    assert made.records[0].duration == pytest.approx(0.49)
    assert "<h2>Velocities</h2>" in (tmp_path / "page.html").read_text()


def test_commands_of_a_bag_without_control_state_keep_their_times(tmp_path: Path) -> None:
    write_odometry(tmp_path / "foreign", {**ODOMETRY, "/boat/cmd_wrench": "geometry_msgs/msg/WrenchStamped"}, commands_from=20)
    force = next(panel for panel in panels(read([tmp_path / "foreign"])[0]) if panel.title == "surge force")
    assert [line.name for line in force.lines] == ["commanded"]
    assert force.lines[0].time == pytest.approx(np.arange(20, 50) * 0.01)


def test_pages_of_bags_in_one_folder_do_not_overwrite_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    for name in ("first", "second"):
        write_odometry(tmp_path / name, ODOMETRY)
    made = [make([tmp_path / name], Options(csv=True, figures="png")).files for name in ("first", "second")]
    assert [files["page"].name for files in made] == ["first_report.html", "second_report.html"]
    paths = [path for files in made for path in files.values()]
    assert len(set(paths)) == 6
    assert all(path.exists() for path in paths)


def test_the_page_of_one_file_of_a_bag_carries_its_name(recorded: Path) -> None:
    file = next(recorded.glob("*.mcap"))
    assert page_of([file]) == recorded / f"{file.stem}_report.html"


def test_tables_of_several_runs_are_in_folders_of_their_names(tmp_path: Path) -> None:
    for name in ("first", "second"):
        write_odometry(tmp_path / name, ODOMETRY)
    make([tmp_path / "first", tmp_path / "second"], Options(page=tmp_path / "report.html", csv=True))
    assert (tmp_path / "csv" / "first" / "motion.csv").is_file()
    assert (tmp_path / "csv" / "second" / "motion.csv").is_file()


def test_a_bag_without_odometry_is_refused_with_the_topics_it_has(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(bag_making.topic("/cmd_wrench", "geometry_msgs/msg/WrenchStamped"))
    writer.close()
    with pytest.raises(BagError, match="has no odometry: its topics are /cmd_wrench"):
        make([tmp_path / "bag"], Options())


LATE: dict[str, Any] = {"stamps": lambda time: (EPOCH + time, EPOCH + time + 3.0)}
UNSTAMPED: dict[str, Any] = {"stamps": lambda time: (0.0, EPOCH + time)}


@pytest.mark.parametrize(
    ("fault", "reason"), [(LATE, "are 3 s ahead of those of /odom"), (UNSTAMPED, r"/odom has no stamps \(0\)")]
)
def test_a_fault_of_a_recording_is_named_and_stands_on_its_page(tmp_path: Path, fault: dict[str, Any], reason: str) -> None:
    path = write_boat(tmp_path / "bag_0.mcap", sailed(duration=20.0), **fault)
    with pytest.warns(BagWarning, match=reason):
        (found,) = read([path])
    assert re.search(reason, str(found.provenance["faults"]))


def test_a_faultless_recording_has_none(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    (found,) = read([write_boat(tmp_path / "bag_0.mcap", sailed(duration=20.0))])
    assert "faults" not in found.provenance
    assert not [each for each in recwarn if issubclass(each.category, BagWarning)]
