"""ROS parameters files: YAML text to flat parameters by node, and back; and which of them a command line gives to a node.

There the last of several values of a parameter counts: `-p NAME:=VALUE` and `--params-file FILE` from left to right, the sections
of a file that are for the node from top to bottom. ROS reads the same rules and means the same, but it collects them by section,
where a rule of the command line joins the first `/**`, and by type, where an integer outlasts a later double: a value that came
last may be lost there without a word.
"""

import functools
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import yaml

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError

_TAG = "tag:yaml.org,2002:"
_SCALARS = {
    "bool": r"[yYnN]|yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF",
    "int": r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)",
    "float": r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)|[-+]?(?i:inf|infinity|nan)",
}
"""What ROS reads as other than a text, in the order in which it tries."""

_Safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where PyYAML is built with libyaml


class _Loader(_Safe):  # type: ignore[misc] # chosen while running
    """Reads scalars as ROS does: 1e5 and inf are numbers, 1_000, 12:30 and 2001-01-01 are texts, y is a flag; keys stay texts."""

    bool_values: ClassVar = {"y": True, "n": False, **_Safe.bool_values}
    yaml_implicit_resolvers: ClassVar = {
        first: [(tag, pattern) for tag, pattern in known if tag in (f"{_TAG}null", f"{_TAG}merge")]
        for first, known in _Safe.yaml_implicit_resolvers.items()
    }

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Keep keys such as `y` and `on` as texts, and refuse a second value of a key, which would replace the first."""
        for key, _ in node.value:
            if key.tag == f"{_TAG}bool":
                key.tag = f"{_TAG}str"
        counts = Counter(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        if twice := [key for key, count in counts.items() if count > 1]:
            raise yaml.constructor.ConstructorError(None, None, f"{twice[0]} is given twice: once is enough", node.start_mark)
        return super().construct_mapping(node, deep)


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc] # chosen while running
    """Quotes a text that ROS would read as a number or a flag, and writes an object in full wherever it occurs.

    rcl and rosbag2 read no anchors and aliases (`&id001`, `*id001`). LibYAML, where it is installed, writes ten times as fast:
    the parameters of a fleet are thousands of lines.
    """

    def ignore_aliases(self, _: Any) -> bool:
        """Of any object: written in full."""
        return True


for _kind, _pattern in _SCALARS.items():
    for _side in (_Loader, _Dumper):
        _side.add_implicit_resolver(f"{_TAG}{_kind}", re.compile(f"^({_pattern})$"), list("-+.0123456789yYnNtTfFoOiI"))


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, with or without a byte order mark."""
    return path.read_text(encoding="utf-8-sig")


def read_file(path: Path, kind: str) -> str:
    """The text of a file; `kind`: what it is. Raises ScenarioError if it cannot be read."""
    try:
        return read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{kind} {path} cannot be read: {in_one_line(error)}") from None


def parsed(text: str, source: str) -> Any:
    """What a text in YAML holds; `source`: where it is from. Raises ScenarioError if it is not YAML."""
    try:
        return read_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source} cannot be read: {in_one_line(error)}") from None


def read_yaml(text: str) -> Any:
    """Parse a YAML text with the scalars of ROS parameters files.

    Raises yaml.YAMLError if the text is not YAML, or has a key twice or a value that its tag does not allow.
    """
    try:
        return yaml.load(text, _Loader)  # noqa: S506 - a safe loader
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        # What the library raises for numbers and tags that do not fit, such as `!!int x`.
        raise yaml.YAMLError(f"a value cannot be read: {error}") from None


def yaml_text(document: Any, **layout: Any) -> str:
    """YAML with the keys in their given order, which ROS and rosbag2 read as it was; `layout`: as of yaml.dump."""
    text: str = yaml.dump(document, Dumper=_Dumper, sort_keys=False, **layout)
    return text


USE_SIM_TIME = "use_sim_time"  # a parameter that every ROS node has; it is not one of a scenario
FAULTS = "faults"  # the section of a scenario with scripted faults, which is not of a node
VESSEL = "vessel."  # prefix of the hull data, which the nodes share
VESSEL_NAME = f"{VESSEL}name"


def in_long_form(values: Mapping[str, object]) -> dict[str, object]:
    """The values with `vessel.name` for its short form `vessel`."""
    if "vessel" not in values:
        return dict(values)
    name = values["vessel"]
    if values.get(VESSEL_NAME, name) != name:
        raise ParameterError(f"vessel = {name} and {VESSEL_NAME} = {values[VESSEL_NAME]} differ: one of them is enough")
    return {VESSEL_NAME: name, **{key: value for key, value in values.items() if key != "vessel"}}


def dump_parameters(values: Mapping[str, Mapping[str, object]], namespace: str = "/**") -> str:
    """Write the flat parameters of nodes as a ROS parameters file, valid in every namespace unless one is given."""
    # The wildcard matches the node in every namespace, so that the file can be used for a second vessel too.
    document = {f"{namespace}/{node}": {"ros__parameters": tree(parameters)} for node, parameters in values.items()}
    return yaml_text(document) if document else ""


def tree(values: Mapping[str, object]) -> dict[str, Any]:
    """Nest values by dotted names as a ROS parameters file does."""
    nested: dict[str, Any] = {}
    for name, value in values.items():
        *groups, leaf = name.split(".")
        branch = nested
        for part in groups:
            branch = branch.setdefault(part, {})
        branch[leaf] = list(value) if isinstance(value, tuple) else value
    return nested


def flat(nested: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values of nested parameters by dotted names. Raises ParameterError if one has two forms, a: {b: 1} and a.b: 2."""
    found: dict[str, Any] = {}
    for key, value in nested.items():
        own = flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
        if twice := found.keys() & own:
            raise ParameterError(f"{min(twice)} is given twice: once is enough")
        found |= own
    return found


def in_one_line(error: Exception) -> str:
    """The message of an error without its line breaks, its number and file, and PyYAML's name for a text in memory."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return re.sub(r' in "<[a-z]+ string>",', ",", " ".join(str(error).split()))


PARAMETER, REMAPPING, FILE = ("-p", "--param"), ("-r", "--remap"), ("--params-file",)
OWN = "ros__parameters"


@dataclass(frozen=True)
class Given:
    """A value that a node is given."""

    value: Any  # as ROS reads its text
    place: str  # the rule that gives it, for messages
    named: bool = True  # whether the rule is for this node alone, not for whatever node reads the file


@dataclass(frozen=True)
class Section:
    """A section of a parameters file."""

    name: str  # for which nodes it is, such as `/**/controller`
    parameters: Mapping[str, Any]  # values by dotted names
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
    """The parameters that a command line gives to a node, by dotted names."""
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
    """That the files of a command line are for other nodes only; empty if a section names the node, or none names one."""
    named = [each for option, file in rules(arguments) if option in FILE for each in sections(file) if each.named]
    if not named or any(section.reaches(node) for section in named):
        return ""
    names = ", ".join(dict.fromkeys(section.name for section in named))
    files = ", ".join(dict.fromkeys(section.file for section in named))
    return f"no section for this node, {node}, in {files}, but for {names}: rename the node or the section"


def sections(file: str) -> list[Section]:
    """The sections of a parameters file from top to bottom. Raises ParameterError if the file cannot be read."""
    try:
        text = read_text(Path(file))
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{file} cannot be read: {in_one_line(error)}") from None
    return _parsed(text, file)


@functools.lru_cache(maxsize=1)  # the nodes of a process read one file
def _parsed(text: str, file: str) -> list[Section]:
    try:
        return [Section(name, flat(parameters), file) for name, parameters in _sections(_read(text, file), "")]
    except ParameterError as error:
        raise ParameterError(f"{file} cannot be read: {error}") from None


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
        return read_yaml(text)
    except yaml.YAMLError as error:
        raise ParameterError(f"{place} cannot be read: {in_one_line(error)}") from None


def check_rules(arguments: Sequence[str], name: str, namespace: str) -> None:
    """Check that each rule with a node's name is one of this node.

    In a rule of a parameter the name stands for the node in the root namespace, and no namespace can be written before it; in
    a rule of a topic or service it stands for the node in every namespace.
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
