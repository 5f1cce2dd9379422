"""Text files up to a size, and YAML with the scalars of ROS."""

import errno
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import yaml

LARGEST_TEXT = 8 << 20  # bytes of the largest text file that is read
LARGEST_TABLE = 128 << 20  # bytes of the largest CSV file of measurements
MAX_VALUES = 1_000_000  # values that a YAML text may stand for, with every alias expanded
_Safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where PyYAML is built with libyaml


class _Loader(_Safe):  # type: ignore[misc] # chosen while running
    """Reads numbers as ROS does.

    1e5 is a number, although YAML 1.1 requires a decimal point and a sign; 1_0 and 1:30 are texts.
    """

    def construct_yaml_int(self, node: Any) -> Any:
        """An integer, or the text of one that only YAML 1.1 writes so."""
        return node.value if set(node.value) & set("_:") else super().construct_yaml_int(node)

    def construct_yaml_float(self, node: Any) -> Any:
        """A number, or the text of one that only YAML 1.1 writes so."""
        return node.value if set(node.value) & set("_:") else super().construct_yaml_float(node)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Refuse a second value of a key, which would take the place of the first without a word."""
        counts = Counter(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        if twice := [key for key, count in counts.items() if count > 1]:
            raise yaml.constructor.ConstructorError(None, None, f"{twice[0]} is given twice: once is enough", node.start_mark)
        return super().construct_mapping(node, deep)


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _Loader.construct_yaml_float)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


class _RosLoader(_Loader):
    """Reads all scalars as ROS does: inf is a number, 1_000 and 12:30 are texts, y is a flag; keys stay texts."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Keep keys such as `y` and `on` as texts."""
        for key, _ in node.value:
            if key.tag == f"{_TAG}bool":
                key.tag = f"{_TAG}str"
        return super().construct_mapping(node, deep)

    def construct_yaml_float(self, node: Any) -> float | str:
        """The number, or its text where a double cannot hold it: ROS takes that for a text, and no parameter for a number."""
        text: str = self.construct_scalar(node)
        plain = text.lower().lstrip("+")
        number = float.fromhex(plain) if "x" in plain else float(plain.replace(".inf", "inf").replace(".nan", "nan"))
        digits = re.search("[1-9]", plain.partition("e")[0])
        return text if digits and (math.isinf(number) or not number) else number


_TAG = "tag:yaml.org,2002:"

_ROS_SCALARS = {
    "bool": r"[yYnN]|yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF",
    "int": r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)",
    "float": r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?0[xX][0-9a-fA-F]+(\.[0-9a-fA-F]*)?([pP][-+]?\d+)?"
    r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)|[-+]?(?i:inf|infinity|nan)",
}
"""What ROS reads as other than a text, in the order in which it tries."""

_RosLoader.bool_values = {"y": True, "n": False, **_Safe.bool_values}
_RosLoader.yaml_implicit_resolvers = {
    first: [(tag, regexp) for tag, regexp in known if tag in (f"{_TAG}null", f"{_TAG}merge")]
    for first, known in _Safe.yaml_implicit_resolvers.items()
}
for _kind, _regexp in _ROS_SCALARS.items():
    _RosLoader.add_implicit_resolver(f"{_TAG}{_kind}", re.compile(f"^({_regexp})$"), list("-+.0123456789yYnNtTfFoOiI"))
_RosLoader.add_constructor(f"{_TAG}float", _RosLoader.construct_yaml_float)


def read_text(path: Path, limit: int = LARGEST_TEXT) -> str:
    """The text of a file in UTF-8, with or without a byte order mark.

    Raises OSError if the file cannot be read, or is larger than the limit in bytes; UnicodeDecodeError if it is not UTF-8.
    """
    return read_bytes(path, limit).decode("utf-8-sig")


def read_bytes(path: Path, limit: int) -> bytes:
    """The content of a file. Raises OSError if the file cannot be read, or is larger than the limit in bytes."""
    with path.open("rb") as stream:
        content = stream.read(limit + 1)
    if len(content) > limit:
        raise OSError(errno.EFBIG, f"it has more than {limit >> 20} MiB")
    return content


def read_yaml(text: str) -> Any:
    """Parse a YAML text with the number format of ROS parameters files.

    Raises yaml.YAMLError if the text is not YAML, or has a key twice or a value that its tag does not allow.
    """
    return _loaded(text, _Loader)


def read_ros_yaml(text: str) -> Any:
    """Parse a YAML text with the scalars of ROS parameters files; the errors are those of `read_yaml`."""
    return _loaded(text, _RosLoader)


def read_plain_yaml(text: str) -> Any:
    """Parse a YAML text with YAML's own number format; the errors are those of `read_yaml`."""
    return _loaded(text, _Safe)


def _loaded(text: str, loader: Any) -> Any:
    try:
        reader = loader(text)
        try:
            node = reader.get_single_node()
            _count(node, {})
            return None if node is None else reader.construct_document(node)
        finally:
            reader.dispose()
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        # What the library raises for dates, numbers and tags that do not fit, such as 2001-99-99 or `!!int x`.
        raise yaml.YAMLError(f"a value cannot be read: {error}") from None


def _count(node: Any, known: dict[int, int]) -> int:
    """The number of values that a node stands for; the counts of lists and mappings are kept by their id, 0 until they are known.

    Raises yaml.YAMLError if a list or mapping contains itself, or the number is larger than `MAX_VALUES`.
    """
    if not isinstance(node, yaml.CollectionNode):
        return 1
    if id(node) not in known:
        known[id(node)] = 0
        inner = node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
        known[id(node)] = 1 + sum(_count(part, known) for part in inner)
    if not 0 < known[id(node)] <= MAX_VALUES:
        why = f"stands for more than {MAX_VALUES} values" if known[id(node)] else "contains itself"
        raise yaml.composer.ComposerError(None, None, f"a list or mapping {why}", node.start_mark)
    return known[id(node)]
