"""What the command line of a node gives it is what it takes, whatever rcl makes of the same rules."""

import gc
import importlib
import signal
import sys
import textwrap
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

import pytest
import rclpy
import yaml
from durations import rest_long
from harness import Command
from hypothesis import given, settings
from hypothesis import strategies as st
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import parameter_dict_from_yaml_file, parameter_value_to_python

from vessel_hsmc_ros.bags.reader import recorded_parameters, recorded_scenario
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import LOOP, WATCHERS
from vessel_hsmc_ros.guidance.factory import REFERENCES
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.markers import MarkerNode
from vessel_hsmc_ros.nodes.process import run_node
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import given_parameters

SHARED = """\
/**:
  ros__parameters:
    frame_prefix: "of_the_file/"
    robot_name: x
/**/{node}:
  ros__parameters:
    frame_prefix: "of_the_section/"
"""
"""A file as `vessel-hsmc init` writes it: its first section is for all nodes."""


@contextmanager
def started(node_class: Any, command_line: Sequence[str], **options: Any) -> Iterator[Any]:
    """A node as its process would make it."""
    context = rclpy.Context()
    rclpy.init(context=context, args=list(command_line))
    try:
        node = node_class(command_line=command_line, context=context, **options)
        yield node
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)


def class_of(name: str) -> Any:
    program = (LOOP | WATCHERS)[name]
    for library in program.libraries:
        pytest.importorskip(library)
    return getattr(importlib.import_module(program.source), program.kind)


def written(folder: Path, text: str) -> str:
    path = folder / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


EVERY = [name for name in LOOP | WATCHERS if name not in ("live", "recorder", "mavlink", "px4")]
"""The nodes that can be made without a port, a bag, or another program's messages."""

NEEDED = {"thruster_allocation": ["-p", "vessel:=otter"]}
"""Rules without which a node does not start."""


@pytest.mark.parametrize("name", rest_long(EVERY, 3))
def test_a_rule_of_the_command_line_beats_each_section_of_the_file_before_it(tmp_path: Path, name: str) -> None:
    for remap in ([], ["-r", "__ns:=/alpha"]):
        file, needed = ["--params-file", written(tmp_path, SHARED.format(node=name))], NEEDED.get(name, [])
        with started(class_of(name), ["--ros-args", *remap, *needed, *file, "-p", "frame_prefix:=last/"]) as node:
            assert node.get_parameter("frame_prefix").value == node.parameters.frame_prefix == "last/"
        with started(class_of(name), ["--ros-args", *remap, *needed, "-p", "frame_prefix:=first/", *file]) as node:
            assert node.get_parameter("frame_prefix").value == node.parameters.frame_prefix == "of_the_section/"


@pytest.mark.parametrize("namespace", ["/", "/alpha"])
def test_a_second_file_for_any_node_beats_the_first_as_launch_writes_it(tmp_path: Path, namespace: str) -> None:
    boat, launched = tmp_path / "boat.yaml", tmp_path / "launch_params"
    boat.write_text("/**: {ros__parameters: {vessel: {length: 4}}}\n/**/controller: {ros__parameters: {input_timeout: 2}}\n")
    launched.write_text(yaml.dump({"/**": {"ros__parameters": {"input_timeout": 0.3, "start_enabled": True}}}))
    files = ["--params-file", str(boat), "--params-file", str(launched)]
    with started(ControllerNode, ["--ros-args", "-r", f"__ns:={namespace}", *files]) as node:
        assert (node.parameters.input_timeout, node.parameters.start_enabled) == (0.3, True)


def test_the_parameters_of_rclpy_itself_take_the_last_value_too(tmp_path: Path) -> None:
    file = written(tmp_path, "/**: {ros__parameters: {a: 1}}\n/**/markers: {ros__parameters: {use_sim_time: true}}\n")
    with started(MarkerNode, ["--ros-args", "--params-file", file, "-p", "use_sim_time:=false"]) as node:
        assert not node.get_parameter("use_sim_time").value
    override = "qos_overrides./odom.subscription.depth"
    text = f"/**: {{ros__parameters: {{a: 1}}}}\n/**/markers: {{ros__parameters: {{{override}: 2}}}}\n"
    with started(MarkerNode, ["--ros-args", "--params-file", written(tmp_path, text), "-p", f"{override}:=3"]) as node:
        assert node.get_parameter(override).value == 3


SCALARS = ["2", "2.0", "1e5", "1_000", "010", "0x1f", "08", "inf", ".inf", "-.inf", "y", "No", "on", "True"]
SCALARS += ["'5'", '"true"', "+5", "-0", "1.", ".5", "0b11", "2001-01-01", "500,0", "a b", "12:30", "x:y", "[1, 2]", "[1.0, 2.5]"]
SCALARS += ["[a, b]", "[true, off]", "!!str 5", "5 # five", "Infinity", "=", "a=b", "a:=b"]


@pytest.mark.parametrize("value", SCALARS)
def test_a_value_that_is_given_once_is_read_as_rcl_reads_it(value: str) -> None:
    line = ["--ros-args", "-p", f"x:={value}"]
    context = rclpy.Context()
    rclpy.init(context=context, args=line)
    try:
        node = rclpy.create_node("node", context=context, start_parameter_services=False)
        theirs = node._parameter_overrides["x"].value
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)
    ours = given_parameters(line, "/node")["x"].value
    assert (list(theirs) if isinstance(ours, list) else theirs) == ours
    assert type(ours) in (type(theirs), list)


@settings(max_examples=30)
@given(number=st.one_of(st.integers(-(2**62), 2**62).map(str), st.floats(allow_nan=False, allow_subnormal=False).map(repr)))
def test_a_drawn_number_is_read_as_rcl_reads_it(number: str) -> None:
    test_a_value_that_is_given_once_is_read_as_rcl_reads_it(number)


def test_a_name_in_a_section_for_any_node_is_of_another_node_unless_it_is_like_one_of_this_one(tmp_path: Path) -> None:
    file = written(tmp_path, "/**: {ros__parameters: {robot_name: x, duration: 5.0, battery: {limit: 11.0}}}\n")
    with started(ControllerNode, ["--ros-args", "--params-file", file]) as node:
        assert {"robot_name", "battery.limit"} <= node.given.keys()


@pytest.mark.parametrize("name", ["start_enable", "guided.lookahed", "law_name", "vessel.lenght"])
def test_a_name_in_a_section_for_any_node_that_is_like_one_of_this_node_is_refused(tmp_path: Path, name: str) -> None:
    refused = name != "law_name"
    line = ["--ros-args", "--params-file", written(tmp_path, f"/**: {{ros__parameters: {{{name}: 1.0}}}}\n")]
    if refused:
        with pytest.raises(ParameterError, match=rf"{name} is not a parameter.*section /\*\* of "), started(ControllerNode, line):
            pass
    line = ["--ros-args", "-p", f"{name}:=1.0"]
    with pytest.raises(ParameterError, match=rf"{name} is not a parameter.*\(-p {name}:=1"), started(ControllerNode, line):
        pass


# -- dump and load ----------------------------------------------------------------------------------------------------


def loaded(node: Any, text: str, folder: Path) -> list[Any]:
    """The results of `ros2 param load`, which sends each value as the type that its text has."""
    messages = parameter_dict_from_yaml_file(written(folder, text), target_nodes=[node.get_fully_qualified_name()])
    request = SetParameters.Request(parameters=list(messages.values()))
    return list(node._parameter_service._set_parameters_callback(request, SetParameters.Response()).results)


def dumped(node: Any) -> str:
    """What `ros2 param dump` writes."""
    values: dict[str, Any] = {}
    for name in node._parameters:
        *groups, leaf = name.split(".")
        branch = values
        for group in groups:
            branch = branch.setdefault(group, {})
        value = parameter_value_to_python(node.get_parameter(name).get_parameter_value())
        branch[leaf] = list(value) if hasattr(value, "__iter__") and not isinstance(value, str) else value
    return yaml.dump({node.get_fully_qualified_name(): {"ros__parameters": values}}, default_flow_style=False)


@pytest.mark.parametrize("name", rest_long(EVERY, 3))
def test_what_ros2_param_dumps_it_loads_again(tmp_path: Path, name: str) -> None:
    with started(class_of(name), ["--ros-args", *NEEDED.get(name, [])]) as node:
        text = dumped(node)
        assert [result.reason for result in loaded(node, text, tmp_path) if not result.successful] == []
        assert dumped(node) == text


def test_a_change_takes_a_number_however_ros2_param_writes_it_and_a_read_only_one_its_own_value_only(tmp_path: Path) -> None:
    with started(ControllerNode, ["--ros-args", "-p", "law:=guided"]) as node:
        head = "/controller:\n  ros__parameters:\n"
        for text, value in (("5", 5.0), (".inf", float("inf")), ("2.5", 2.5)):
            assert loaded(node, f"{head}    diagnostics.surface_limit: {text}\n", tmp_path)[0].successful
            assert node.parameters.diagnostics.surface_limit == value
        refused = loaded(node, f"{head}    input_timeout: 7.0\n    diagnostics.surface_limit: many\n", tmp_path)
        assert [result.successful for result in refused] == [False, False]


@pytest.mark.parametrize("at_start", [True, False])
def test_the_clock_of_a_node_stays_as_it_was_given(tmp_path: Path, at_start: bool) -> None:
    with started(ControllerNode, ["--ros-args", "-p", "lockstep:=false", "-p", f"use_sim_time:={at_start}".lower()]) as node:
        for asked in (at_start, not at_start):
            result = loaded(node, f"/controller:\n  ros__parameters:\n    use_sim_time: {asked}\n".lower(), tmp_path)[0]
            assert result.successful == (asked == at_start)
        assert result.reason == f"use_sim_time must be given at the start of the node: its clock stays (got {asked})"
        assert node.get_parameter("use_sim_time").value == at_start
        assert node.get_clock().ros_time_is_active == at_start


# -- laws and modes ----------------------------------------------------------------------------------------------------


def groups(node: Any, kinds: Collection[str]) -> set[str]:
    """The laws, or modes, whose parameters a node declares."""
    return {name.partition(".")[0] for name in node._parameters} & set(kinds)


@pytest.mark.parametrize("law", rest_long(LAWS, 3))
def test_a_controller_declares_its_own_law_alone_and_a_bag_with_these_parameters_has_the_same_scenario(
    tmp_path: Path, law: str
) -> None:
    other = "pd" if law != "pd" else "guided"
    entries = schema.entries(NODES["controller"])
    given = {name: entries[name].default for name in entries if name.startswith((f"{law}.", f"{other}."))}
    body = yaml.dump({key: list(value) if isinstance(value, tuple) else value for key, value in given.items()})
    text = f"/**/controller:\n  ros__parameters:\n{textwrap.indent(body, '    ')}"
    line = ["--ros-args", "--params-file", written(tmp_path, text), "-p", f"law:={law}"]
    with started(ControllerNode, line) as node:
        assert groups(node, LAWS) == {law}
        declared = recorded_parameters(dumped(node).encode())["/controller"]
        every = schema.flatten(node.parameters)
    fallback = [*line, "-p", "safety.action:=fallback", "-p", f"safety.fallback_law:={other}"]
    with started(ControllerNode, fallback) as node:
        assert groups(node, LAWS) == {law, other}
    loop = {f"/{name}": schema.flatten(NODES[name]()) for name in ("vessel_sim", "reference_ship", "recorder")}
    with_rate = {"lockstep": False, "rate_hz": 100.0}
    one, same = (
        recorded_scenario(tmp_path, "bag", "", loop | {"/controller": {**values, **with_rate}}, ["/"], None)
        for values in (declared, {key: list(value) if isinstance(value, tuple) else value for key, value in every.items()})
    )
    assert one == same
    assert one.controller.law == law


@pytest.mark.parametrize("mode", rest_long(REFERENCES, 3))
def test_a_reference_declares_its_own_mode_alone(mode: str) -> None:
    with started(ReferenceShipNode, ["--ros-args", "-p", f"mode:={mode}"]) as node:
        assert groups(node, REFERENCES) <= {mode}
        assert node.has_parameter("surge_force") == (mode == "virtual_ship")


def test_a_parameter_of_another_law_is_refused_by_name_and_a_misspelt_one_at_the_start(tmp_path: Path) -> None:
    with started(ControllerNode, ["--ros-args", "-p", "law:=guided"]) as node:
        (result,) = loaded(node, "/controller: {ros__parameters: {pd.heading_gain: 2.0}}\n", tmp_path)
        assert (result.successful, result.reason) == (False, "pd.heading_gain is not in use: law is not pd")
    line = ["--ros-args", "-p", "law:=guided", "-p", "pd.heading_gian:=2.0"]
    with pytest.raises(ParameterError, match=r"did you mean pd\.heading_gain"), started(ControllerNode, line):
        pass


def test_an_unconfigured_controller_that_is_given_another_law_has_the_parameters_of_that_law_with_their_given_values(
    tmp_path: Path,
) -> None:
    line = ["--ros-args", "-p", "autostart:=false", "-p", "law:=hierarchical", "-p", "pd.heading_gain:=3.0"]
    head = "/controller:\n  ros__parameters:\n"
    with started(ControllerNode, line) as node:
        assert groups(node, LAWS) == {"hierarchical"}
        assert loaded(node, f"{head}    law: pd\n", tmp_path)[0].successful
        assert groups(node, LAWS) == {"pd"}
        assert node.get_parameter("pd.heading_gain").value == 3.0
        text = f"{head}    pd.heading_gain: 4.0\n    safety.fallback_law: hierarchical\n    safety.action: fallback\n"
        assert all(result.successful for result in loaded(node, text, tmp_path))
        assert groups(node, LAWS) == {"pd", "hierarchical"}
        assert loaded(node, f"{head}    hierarchical.network.width: 2.0\n", tmp_path)[0].successful
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        assert node.describe_parameter("law").read_only
        assert node.describe_parameter("hierarchical.network.width").read_only
        assert node.parameters.pd.heading_gain == 4.0


# -- processes --------------------------------------------------------------------------------------------------------


def answered(bench: Any, node: str, names: list[str]) -> list[Any]:
    """The parameters of a node in another process, which may take a request before it has discovered the client."""
    client = bench.probe.create_client(GetParameters, f"{node}/get_parameters")
    bench.until(client.service_is_ready)
    requests = [client.call_async(GetParameters.Request(names=names))]

    def response() -> Any:
        if requests[-1].done():
            return requests[-1].result()
        if time.monotonic() > begun + 3.0 * len(requests):
            requests.append(client.call_async(GetParameters.Request(names=names)))
        return None

    begun = time.monotonic()
    return [parameter_value_to_python(value) for value in bench.until(response).values]


DRAWN: dict[str, dict[str, Any]] = {
    "law": {"guided": "guided", "pd": "pd", "'pd'": "pd"},
    "start_enabled": {"true": True, "no": False},
    "input_timeout": {"2": 2.0, "0.3": 0.3, "1e0": 1.0},
    "vessel.surge_inertia": {"525": 525.0, "777.5": 777.5},
    "safety.fresh_samples": {"5": 5, "0x10": 16},
    "odometry.frames": {"[a]": ["a"], "[odom, map]": ["odom", "map"]},
}
"""Texts of values of parameters of each type, with the values."""

SECTIONS = {
    "/**": True,
    "/**/controller": True,
    "/*": "",
    "/controller": "",
    "/alpha/controller": "/alpha",
    "/**/vessel_sim": None,
}
"""The namespaces in which a section is for the controller: True for all."""


def drawn(seed: int, namespace: str, folder: Path) -> tuple[list[object], dict[str, object]]:
    """A command line of drawn files and rules, with the values that the controller takes from it."""
    draw = Random(seed)  # noqa: S311 - no secret
    line: list[object] = ["--ros-args", *(["-r", f"__ns:={namespace}"] if namespace else [])]
    taken: dict[str, object] = {}
    for number in range(8):
        given = {name: draw.choice(list(texts)) for name, texts in DRAWN.items() if draw.random() < 0.6}
        values = {name: DRAWN[name][text] for name, text in given.items()}
        if draw.random() < 0.4:
            prefix = draw.choice(["", "controller:"]) if not namespace else ""
            line += [part for name, text in given.items() for part in ("-p", f"{prefix}{name}:={text}")]
            taken |= values
            continue
        file, section = folder / f"{number}.yaml", draw.choice(list(SECTIONS))
        body = "".join(f"    {name}: {text}\n" for name, text in given.items())
        file.write_text(f"{section}:\n  ros__parameters:\n    use_sim_time: false\n{body}", encoding="utf-8")
        line += ["--params-file", file]
        taken |= values if SECTIONS[section] in (True, namespace) else {}
    return line, taken


@pytest.mark.parametrize(("namespace", "seed"), rest_long([("/alpha", 1), ("", 5), ("/alpha", 5), ("", 1)]))
def test_a_process_has_the_parameters_that_its_command_line_gives_last(
    tmp_path: Path, bench: Any, seed: int, namespace: str
) -> None:
    line, taken = drawn(seed, namespace, tmp_path)
    assert len(taken) == len(DRAWN), "another seed gives each parameter a value"
    node = Command([sys.executable, "-m", "vessel_hsmc_ros.nodes", "controller", *line], tmp_path, {})
    try:
        assert dict(zip(taken, answered(bench, f"{namespace}/controller", list(taken)), strict=True)) == taken
    finally:
        node.popen.send_signal(signal.SIGINT)
        assert node.wait(60.0) == 0, node.text


@pytest.mark.parametrize(
    ("rules", "reason"),
    [
        (["vessel.surge_inertia:=500,0"], "vessel.surge_inertia must be a finite number"),
        (["rate_hz:=50", "rate_hz:=fast"], "(-p rate_hz:=fast)"),
        (["use_sim_time:=3"], "use_sim_time"),
    ],
)
def test_a_value_that_is_not_allowed_ends_the_start_with_the_place_that_gave_it(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, rules: list[str], reason: str
) -> None:
    monkeypatch.setattr("os.nice", lambda _: 0)  # of this process it would last
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        line = ["--ros-args", "-p", "vessel.surge_inertia:=525", *(part for rule in rules for part in ("-p", rule))]
        assert run_node(ControllerNode, line) == 2
    finally:
        gc.unfreeze()
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert reason in capfd.readouterr().err


def test_a_setting_without_effect_is_warned_of_at_the_start_as_the_command_line_names_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "given.yaml"
    file.write_text("/**/controller: {ros__parameters: {law: guided, observer: {position_noise: 2.0}, pd: {heading_gain: 2.0}}}")
    with started(ControllerNode, ["node", "--ros-args", "--params-file", str(file), "-p", "los_pid.lookahead_time:=9.0"]):
        pass
    printed = capfd.readouterr().err
    assert "observer.position_noise is given and has no effect: observer.enabled is false" in printed
    assert "los_pid.lookahead_time is given and has no effect: law is not los_pid" in printed
    assert "pd.heading_gain" not in printed
