"""The parameters that a node is given by its command line: of several values of a parameter the last one counts.

`-p NAME:=VALUE` and `--params-file FILE` count from left to right, the sections of a file that are for the node from top to
bottom. ROS reads the same rules and means the same, but it collects them by section, where a rule of the command line joins the
first `/**`, and by type, where an integer outlasts a later double: a value that came last may be lost there without a word.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.bounded_text import read_ros_yaml, read_text
from vessel_hsmc_ros.scenario.parameters_file import flat, in_one_line

PARAMETER, REMAPPING, FILE = ("-p", "--param"), ("-r", "--remap"), ("--params-file",)

OWN = "ros__parameters"


@dataclass(frozen=True)
class Given:
    """A value that a node is given.

    Attributes:
        value: As ROS reads its text.
        place: The rule that gives it, for messages.
        named: Whether the rule is for this node alone, not for whatever node reads the file.
    """

    value: Any
    place: str
    named: bool = True


@dataclass(frozen=True)
class Section:
    """A section of a parameters file.

    Attributes:
        name: For which nodes it is, such as `/**/controller`.
        parameters: Values by dotted names.
    """

    name: str
    parameters: Mapping[str, Any]
    file: str

    @property
    def named(self) -> bool:
        """Whether it names a node, in whatever namespace."""
        return "*" not in self.name.rpartition("/")[2]

    def reaches(self, node: str) -> bool:
        """Whether it is for a node of a fully qualified name: `*` stands for one part of it, `**` for any number."""
        parts = {"*": "/[^/]+", "**": "(/[^/]+)*"}
        pattern = "".join(parts.get(part, f"/{re.escape(part)}") for part in self.name.strip("/").split("/"))
        return re.fullmatch(pattern, node) is not None


def given_parameters(arguments: Sequence[str], node: str) -> dict[str, Given]:
    """The parameters that a command line gives to a node, by dotted names.

    Raises:
        ParameterError: a file or a value cannot be read.
    """
    found: dict[str, Given] = {}
    for option, rule in rules(arguments):
        if option in PARAMETER:
            target, _, value = rule.partition(":=")
            of, _, name = target.rpartition(":")
            if not of or f"/{of}" == node:
                found[name] = Given(_read(value, f"{option} {rule}"), f"{option} {rule}")
        elif option in FILE:
            for section in sections(rule):
                if section.reaches(node):
                    place = f"section {section.name} of {section.file}"
                    found |= {name: Given(value, place, section.named) for name, value in section.parameters.items()}
    return found


def missed_sections(arguments: Sequence[str], node: str) -> str:
    """That the files of a command line are for other nodes only; empty if a section names the node, or none names one.

    Raises:
        ParameterError: a file cannot be read.
    """
    named = [each for option, file in rules(arguments) if option in FILE for each in sections(file) if each.named]
    if not named or any(section.reaches(node) for section in named):
        return ""
    names = ", ".join(dict.fromkeys(section.name for section in named))
    files = ", ".join(dict.fromkeys(section.file for section in named))
    return f"no section for this node, {node}, in {files}, but for {names}: rename the node or the section"


def sections(file: str) -> list[Section]:
    """The sections of a parameters file from top to bottom.

    Raises:
        ParameterError: the file cannot be read.
    """
    try:
        text = read_text(Path(file))
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{file} cannot be read: {in_one_line(error)}") from None
    return [Section(name, dict(flat(parameters)), file) for name, parameters in _sections(_read(text, file), "")]


def _sections(document: object, above: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The sections of a document or of a namespace in it, whose nodes may stand below it."""
    for key, content in document.items() if isinstance(document, dict) else ():
        name = f"{above}/{str(key).strip('/')}"
        if isinstance(content, dict):
            if isinstance(parameters := content.get(OWN), dict):
                yield name, parameters
            yield from _sections({key: inner for key, inner in content.items() if key != OWN}, name)


def _read(text: str, place: str) -> Any:
    try:
        return read_ros_yaml(text)
    except yaml.YAMLError as error:
        raise ParameterError(f"{place} cannot be read: {in_one_line(error)}") from None


def check_rules(arguments: Sequence[str], name: str, namespace: str) -> None:
    """Check that each rule with a node's name is one of this node.

    In a rule of a parameter the name stands for the node in the root namespace, and no namespace can be written before it; in a
    rule of a topic or service it stands for the node in every namespace.

    Raises:
        ParameterError: a rule names another node; the message has the rule that would reach this one.
    """
    full = f"{namespace.rstrip('/')}/{name}"
    for option, rule in rules(arguments):
        target, _, value = rule.partition(":=")
        node, colon, key = target.partition(":")
        if option in FILE or not colon or key.startswith("__"):
            continue
        if f"/{node}" != full if option in PARAMETER else node != name:
            raise ParameterError(f"{option} {rule} reaches no node: this one is {full}; write {option} {key}:={value}")


def rules(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The options with their values between `--ros-args` and `--`."""
    within = False
    for argument, following in pairwise(arguments):
        within = argument == "--ros-args" or (within and argument != "--")
        if within and argument in PARAMETER + REMAPPING + FILE:
            yield argument, following
