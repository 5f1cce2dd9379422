"""The tables of docs/safety.md, from the declarations of parameters, promises and reasons."""

import re
from collections.abc import Iterable

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.safety.reasons import Reason
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.promises import PROMISES, REMEDIES

BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def safety_page(text: str) -> str:
    """A Markdown page whose generated parts are those of the present declarations.

    A generated part stands between the lines `<!-- generated: NAME -->` and `<!-- end -->`, with the name of one of TABLES.

    Raises:
        ScenarioError: a generated part has an unknown name.
    """

    def block(match: re.Match[str]) -> str:
        if match[2] not in TABLES:
            raise ScenarioError(f"generated part {match[2]} is unknown: it takes one of {', '.join(TABLES)}")
        return f"{match[1]}\n{TABLES[match[2]]()}\n{match[3]}"

    return BLOCK.sub(block, text)


def _promises() -> str:
    rows = (
        (
            promise.signal,
            with_defaults(promise.timeout),
            promise.clock,
            with_defaults(promise.action),
            with_defaults(promise.recovery),
            ", ".join(f"`{reason.name}`" for reason in promise.reasons),
            ", ".join(f"[{number}](#tests)" for number in _numbers(promise.tests)),
        )
        for promise in PROMISES
    )
    return _table(("signal", "time or bound", "clock", "action", "recovery", "reason", "tests"), rows)


def _numbers(tests: Iterable[str]) -> list[int]:
    return [1 + list(held_by()).index(test) for test in tests]


def held_by() -> dict[str, None]:
    """The tests of all promises, each once, in the order of the table."""
    return dict.fromkeys(test for promise in PROMISES for test in promise.tests)


def _tests() -> str:
    return "".join(f"{number}. `test/{test}`\n" for number, test in enumerate(held_by(), 1))


def _reasons() -> str:
    rows = ((str(int(r)), f"`{r.name}`", r.level.upper(), r.text, REMEDIES[r]) for r in Reason)
    return _table(("code", "name", "level", "meaning", "remedy"), rows)


def with_defaults(text: str) -> str:
    """A text with the default and name of a parameter for each dotted name in braces."""
    return re.sub(r"\{(\w+)\.([\w.]+)\}", lambda match: _default(match[1], match[2]), text)


def _default(node: str, name: str) -> str:
    entry = schema.entries(NODES[node])[name]
    value = f"{entry.default:g}" if isinstance(entry.default, float) else str(entry.default)
    return f"{value} {entry.unit}".rstrip() + f" (`{node}.{name}`)"


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


TABLES = {"promises": _promises, "reasons": _reasons, "tests": _tests}
