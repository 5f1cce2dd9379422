"""Of several values that a node is given for a parameter the last one counts, wherever and in whatever type it is written."""

from itertools import permutations
from pathlib import Path

import pytest
from durations import rest_long
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters_file import given_parameters, sections

VALUES = {"2": 2, "0.3": 0.3, "true": True, "guided": "guided", "500,0": "500,0", "[1, 2]": [1, 2], "'5'": "5", "1e5": 1e5}
"""Texts of values with what ROS reads."""

NODES = ("/controller", "/alpha/controller", "/alpha/beta/controller")

REACHED = {
    "/**": NODES,
    "/*": NODES[:1],
    "controller": NODES[:1],
    "/controller": NODES[:1],
    "/**/controller": NODES,
    "/*/controller": NODES[1:2],
    "/alpha/controller": NODES[1:2],
    "alpha/controller": NODES[1:2],
    "/alpha/**": NODES[1:],
    "/**/beta/*": NODES[2:],
    "/**/vessel_sim": (),
    "/beta/controller": (),
}
"""The nodes that a section of a file is for."""

RULES = {"-p": NODES, "-p controller": NODES[:1], "-p vessel_sim": ()}
"""The nodes that a rule of the command line is for."""


class CommandLine:
    """A command line that is written rule by rule, with the value that a node takes from it."""

    def __init__(self, folder: Path, node: str) -> None:
        self.arguments = ["--ros-args"]
        self.expected: dict[str, object] = {}
        self._folder, self._node = folder, node

    def give(self, source: str, *texts: str) -> None:
        """Give values of x by one rule, or by as many sections of one file as there are sources between commas."""
        if source in RULES:
            of = source.partition(" ")[2]
            self.arguments += ["-p", f"{of}{':' if of else ''}x:={texts[0]}"]
            self._expect(RULES[source], texts[0])
            return
        file = self._folder / f"{len(self.arguments)}.yaml"
        names = source.split(", ")
        file.write_text("".join(f"{n}:\n  ros__parameters:\n    x: {t}\n" for n, t in zip(names, texts, strict=True)), "utf-8")
        self.arguments += ["--params-file", str(file)]
        for name, text in zip(names, texts, strict=True):
            self._expect(REACHED[name], text)

    def _expect(self, reached: tuple[str, ...], text: str) -> None:
        if self._node in reached:
            self.expected = {"x": VALUES[text]}

    def check(self) -> None:
        found = {name: rule.value for name, rule in given_parameters(self.arguments, self._node).items()}
        assert found == self.expected, self.arguments
        assert [type(value) for value in found.values()] == [type(value) for value in self.expected.values()]


@pytest.mark.parametrize("node", rest_long(NODES))
def test_the_last_of_two_values_counts_from_every_two_sources_and_of_every_two_types(tmp_path: Path, node: str) -> None:
    texts = list(permutations(VALUES, 2))
    for number, (first, second) in enumerate(permutations([*REACHED, *RULES], 2)):
        line = CommandLine(tmp_path, node)
        line.give(first, texts[number % len(texts)][0])
        line.give(second, texts[number % len(texts)][1])
        line.check()


@pytest.mark.parametrize("node", NODES)
def test_of_two_sections_of_a_file_the_lower_one_counts_and_a_rule_after_the_file_above_both(tmp_path: Path, node: str) -> None:
    for first, second in permutations(REACHED, 2):
        line = CommandLine(tmp_path, node)
        line.give(f"{first}, {second}", "2", "0.3")
        line.check()
        line.give("-p", "guided")
        line.check()


@given(data=st.data())
def test_the_last_value_counts_of_any_drawn_command_line(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    line = CommandLine(tmp_path_factory.mktemp("drawn"), data.draw(st.sampled_from(NODES)))
    for source in data.draw(
        st.lists(st.sampled_from([*REACHED, *RULES, "/**, /**/controller", "/**/controller, /*"]), max_size=6)
    ):
        line.give(source, *(data.draw(st.sampled_from(list(VALUES))) for _ in source.split(", ")))
    line.check()


def test_each_value_has_its_place_and_whether_it_is_for_this_node_alone(tmp_path: Path) -> None:
    file = tmp_path / "boat.yaml"
    text = "/**: {ros__parameters: {robot_name: x, vessel: {length: 4}}}\nalpha: {controller: {ros__parameters: {law: pd}}}\n"
    file.write_text(text, encoding="utf-8")
    found = given_parameters(["--ros-args", "--params-file", str(file), "-p", "rate_hz:=50"], "/alpha/controller")
    assert {name: rule.place for name, rule in found.items()} == {
        "robot_name": f"section /** of {file}",
        "vessel.length": f"section /** of {file}",
        "law": f"section /alpha/controller of {file}",
        "rate_hz": "-p rate_hz:=50",
    }
    assert [name for name, rule in found.items() if not rule.named] == ["robot_name", "vessel.length"]


def test_rules_count_between_the_marks_of_ros_arguments_only() -> None:
    arguments = ["-p", "x:=1", "--ros-args", "-p", "x:=2", "--", "-p", "x:=3", "--ros-args", "--param", "y:=4"]
    assert {name: rule.value for name, rule in given_parameters(arguments, "/node").items()} == {"x": 2, "y": 4}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("/**: {ros__parameters: {x: 1, x: 2}}", "x is given twice: once is enough"),
        ("/**: {ros__parameters: {a: {b: 1}, a.b: 2}}", "a.b is given twice: once is enough"),
        ("/**: [", "cannot be read: while parsing"),
    ],
)
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "file.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError, match=rf"{file}.*{reason}"):
        sections(str(file))
    with pytest.raises(ParameterError, match=r"none\.yaml cannot be read: No such file"):
        sections(str(tmp_path / "none.yaml"))
