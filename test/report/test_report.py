"""What a report tells of runs and bags of every kind, without a browser."""

import base64
import json
import re
import sys
import zlib

import bag_making
import numpy as np
import pytest
from pyarrow import parquet

from vessel_hsmc_ros import report
from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, ReportError
from vessel_hsmc_ros.core.metrics import evaluate
from vessel_hsmc_ros.report import Record, Signal, Signals, export, figures
from vessel_hsmc_ros.report.making import Wanted, make
from vessel_hsmc_ros.report.overlay import overlays
from vessel_hsmc_ros.report.panels import panels
from vessel_hsmc_ros.report.payload import Payload
from vessel_hsmc_ros.report.signals import of_run
from vessel_hsmc_ros.report.tables import key_figures, parameter_tables
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario

SAMPLES = 500


def motion(offset):
    """A ship on a circle, off its reference by a distance."""
    time = np.arange(SAMPLES) * 0.01
    reference = np.column_stack([50 * np.cos(time), 50 * np.sin(time), time, 0 * time + 2, 0 * time, 0 * time + 0.1])
    state = reference + np.array([offset, 0.0, 0.0, 0.0, 0.0, 0.0])
    return Signals(
        state=Signal(time, state),
        reference=Signal(time, reference),
        wrench=Signal(time, np.column_stack([1e5 * np.sin(time), 1e6 * np.cos(time)])),
        control={"surge_estimate": Signal(time[::2], np.sin(time[::2])), "yaw_weights": Signal(time[::2], np.ones((250, 3)))},
    )


def record(name, offset, **changes):
    signals = motion(offset)
    metrics = evaluate(signals.state.time, signals.state.values, signals.reference.values, signals.wrench.values)
    return Record(name, signals, metrics, {}, load_scenario("case2_tracking", changes), {"version": "9.9"})


def text_of(path):
    """What the page says, without the numbers and the library."""
    return re.sub(r'<script type="text/plain".*?</script>', "", path.read_text(), flags=re.DOTALL)


def numbers_of(path):
    """The page's content and its numbers, as the page itself unpacks them."""
    page = path.read_text()
    content = json.loads(re.search(r'id="content">(.*?)</script>', page, re.DOTALL)[1])
    data = zlib.decompress(base64.b64decode(re.search(r'id="numbers">(.*?)</script>', page, re.DOTALL)[1]))

    def array(where):
        size = int(where["kind"][1])
        raw = np.frombuffer(data, np.uint8, where["count"] * size, where["at"]).reshape(size, where["count"])
        return np.ascontiguousarray(raw.T).view("<" + where["kind"]).ravel()

    return content, array


def test_the_page_carries_the_numbers_and_asks_for_nothing_else(tmp_path):
    path = tmp_path / "report.html"
    report.write(path, [record("one", 3.0)], "One <b>run</b>")
    text = text_of(path)
    assert "One &lt;b&gt;run&lt;/b&gt;" in text
    assert not re.search(r"(?:src|href)=\"(?!data:)", text)
    assert "default-src 'none'" in text
    content, array = numbers_of(path)
    titles = [panel["title"] for panel in content["panels"]]
    assert titles[:2] == ["position error", "heading error"]
    distance = content["panels"][0]["lines"][0]
    np.testing.assert_array_equal(array(distance["time"]), motion(3.0).state.time)
    np.testing.assert_allclose(array(distance["values"]), 3.0, rtol=1e-6)
    track = content["tracks"][0]
    np.testing.assert_allclose(array(track["x"]) + track["middle"][0], motion(3.0).state.values[:, 0], atol=1e-5)


def test_a_long_series_is_thinned_and_keeps_its_peak():
    payload = Payload(limit=1000)
    time, values = np.arange(100_000) * 0.01, np.zeros(100_000)
    values[77_777] = 5.0
    where = payload.line(overlays([Record("x", Signals(Signal(time, np.tile(values[:, None], 6))))])[0].lines[0].line)
    assert where["bucket"] == 200
    assert where["values"]["count"] == where["time"]["count"] == 1000


def test_several_runs_are_compared_with_the_first(tmp_path):
    records = [record("near", 1.0), record("far", 4.0, **{"controller.hierarchical.sway_weight": 0.002})]
    row = key_figures(records)[0]
    assert [cell["text"] for cell in row["cells"]] == ["1 m", "4 m", "+3 m (+300 %)"]
    assert row["cells"][2]["sense"] == "worse"
    changed = [f"{node['name']}.{row['name']}" for node in parameter_tables(records) for row in node["rows"] if row["changed"]]
    assert changed == ["controller.hierarchical.sway_weight"]
    report.write(tmp_path / "two.html", records, "Two")
    content, _ = numbers_of(tmp_path / "two.html")
    velocity = next(panel for panel in content["panels"] if panel["title"] == "surge velocity")
    assert [line["label"] for line in velocity["lines"]] == ["near", "reference", "far"]
    assert [track["label"] for track in content["tracks"]] == ["near", "far", "reference"]


def test_one_run_marks_the_parameters_that_differ_from_their_defaults():
    tables = parameter_tables([record("one", 1.0, **{"vessel_sim.rate_hz": 200.0})])
    changed = {f"{node['name']}.{row['name']}" for node in tables for row in node["rows"] if row["changed"]}
    assert "vessel_sim.rate_hz" in changed
    assert "controller.rate_hz" not in changed


def test_the_tables_read_back_as_the_same_bits(tmp_path):
    signals = motion(1.0)
    paths = export.write_csv(signals, tmp_path / "csv")
    assert [path.name for path in paths] == ["motion.csv", "control.csv"]
    read = np.genfromtxt(paths[0], delimiter=",", names=True)
    np.testing.assert_array_equal(read["time"], signals.state.time)
    np.testing.assert_array_equal(read["reference_y"], signals.reference.values[:, 1])
    np.testing.assert_array_equal(read["yaw_moment"], signals.wrench.values[:, 1])
    assert np.genfromtxt(paths[1], delimiter=",", names=True).dtype.names == ("time", "surge_estimate")


def test_parquet_needs_pyarrow(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ReportError, match="Parquet needs pyarrow, which is not installed"):
        export.write_parquet(motion(1.0), tmp_path)


def test_parquet_has_the_same_columns(tmp_path):
    signals = motion(1.0)
    paths = export.write_parquet(signals, tmp_path)
    assert [path.name for path in paths] == ["motion.parquet", "control.parquet"]
    for path, table in zip(paths, export.tables(signals).values(), strict=True):
        read = parquet.read_table(path)
        assert read.column_names == list(table)
        for name, values in table.items():
            np.testing.assert_array_equal(read[name].to_numpy(), values)


@pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_figures_are_files_of_the_kind_asked_for(tmp_path, kind, start):
    paths = figures.draw([record("near", 1.0), record("far", 4.0)], tmp_path / "figures", kind)
    assert {path.name for path in paths} >= {f"track.{kind}", f"errors.{kind}", f"wrench.{kind}"}
    assert all(path.read_bytes().startswith(start) for path in paths)


# -- bags -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def recorded(tmp_path):
    """A bag with every topic, the parameters beside it."""
    bag_making.write_run(tmp_path / "run" / "bag", 300)
    (tmp_path / "run" / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    (tmp_path / "run" / "run.json").write_text('{"git_commit": "abc", "seed": null, "metrics": {}}')
    return tmp_path / "run" / "bag"


def test_a_bag_of_ours_becomes_a_page_with_everything(recorded):
    made = make([recorded], Wanted(csv=True, figures="svg"))
    run = open_bag(recorded).run(weights=False)
    assert made.records[0].metrics == evaluate(run.time, run.state, run.reference, run.wrench)
    assert made.records[0].provenance["git_commit"] == "abc"
    assert made.records[0].facts["messages_recorded"] == 3003
    assert made.files["page"] == recorded.parent / "report.html"
    content, _ = numbers_of(made.files["page"])
    panels = {panel["title"]: [line["label"] for line in panel["lines"]] for panel in content["panels"]}
    assert panels["surge force"] == ["applied", "commanded"]
    assert panels["surge dynamics f_u"] == ["estimate", "truth"]
    assert panels["sway velocity"] == ["measured", "ship", "reference"]
    assert panels["position off by"] == panels["heading off by"] == ["measured"]
    assert (recorded.parent / "csv" / "motion.csv").is_file()


def test_a_bag_with_odometry_alone_is_shown_as_far_as_it_goes(tmp_path):
    writer = BagWriter(tmp_path / "foreign")
    odom = bag_making.topic("/boat/odom", "nav_msgs/msg/Odometry")
    writer.add_topic(odom)
    for k in range(50):
        stamp = 10**18 + k * 10**7
        message = bag_making.message(odom.kind, stamp, np.random.default_rng(k))
        writer.write(odom, bag_making.serialized(message, odom.kind), stamp, stamp)
    writer.close()
    made = make([tmp_path / "foreign"], Wanted(page=tmp_path / "page.html", csv=True))
    assert made.records[0].metrics is None
    assert made.records[0].signals.duration == pytest.approx(0.49)
    assert "Velocities" in text_of(tmp_path / "page.html")


def test_a_bag_without_odometry_is_refused_in_one_line(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(bag_making.topic("/cmd_wrench", "geometry_msgs/msg/WrenchStamped"))
    writer.close()
    with pytest.raises(BagError, match="has no odometry: its topics are /cmd_wrench"):
        make([tmp_path / "bag"], Wanted())


def test_runs_of_one_name_are_told_apart(recorded, tmp_path):
    made = make([recorded, recorded], Wanted(page=tmp_path / "both.html"))
    assert [each.name for each in made.records] == ["run 1", "run 2"]


def test_a_page_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(ReportError, match=r"report .*nowhere/page.html cannot be written: No such file or directory"):
        report.write(tmp_path / "nowhere" / "page.html", [record("one", 1.0)], "One")


def test_sensors_and_observer_are_shown_against_the_truth():
    def lines(**changes):
        short = {"vessel_sim.duration": 2.0, **changes}
        run = simulate(load_scenario("realistic", short))
        return {panel.title: [line.name for line in panel.lines] for panel in panels(of_run(run))}

    shown = lines()
    assert shown["position off by"] == shown["heading off by"] == ["measured", "estimate"]
    assert shown["surge velocity"] == ["ship", "reference", "estimate"]  # it is not measured
    blind = {"controller.observer.enabled": False}
    assert lines(**blind)["position off by"] == ["measured"]


def test_uneven_control_steps_make_a_histogram_and_even_ones_none(tmp_path):
    random = np.random.default_rng(1)
    even = np.arange(300) * 0.01
    for name, time, shown in (("even", even, False), ("uneven", even + 1e-3 * random.random(300), True)):
        made = record(name, 1.0)
        made.signals.control["compute_time"] = Signal(time, np.full(300, 4e-5))
        path = tmp_path / f"{name}.html"
        report.write(path, [made], name)
        assert ('id="jitter"' in text_of(path)) == shown
        files = {file.stem for file in figures.draw([made], tmp_path / name)}
        assert ("jitter" in files) == shown
