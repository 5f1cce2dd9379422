"""Text files, and YAML with the scalars of ROS."""

import re
from collections import Counter
from pathlib import Path
from typing import Any, ClassVar

import yaml

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


for _kind, _pattern in _SCALARS.items():
    _Loader.add_implicit_resolver(f"{_TAG}{_kind}", re.compile(f"^({_pattern})$"), list("-+.0123456789yYnNtTfFoOiI"))


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, with or without a byte order mark."""
    return path.read_text(encoding="utf-8-sig")


def read_yaml(text: str) -> Any:
    """Parse a YAML text with the scalars of ROS parameters files.

    Raises yaml.YAMLError if the text is not YAML, or has a key twice or a value that its tag does not allow.
    """
    try:
        return yaml.load(text, _Loader)  # noqa: S506 - a safe loader
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        # What the library raises for numbers and tags that do not fit, such as `!!int x`.
        raise yaml.YAMLError(f"a value cannot be read: {error}") from None
