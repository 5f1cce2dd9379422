"""The declared parameters as a page of the docs."""

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

HEAD = """# Parameters

Written by `make docs` from the declarations in the code; `ros2 param describe` shows the same.
In a parameters file a dot is a level: `hierarchical.sway_weight` stands below `hierarchical:`.
Those marked * may be changed while the node runs.
"""


def parameter_page() -> str:
    """A Markdown page with a table for each node."""
    return HEAD + "".join(f"\n## {node}\n\n{_table(cls)}" for node, cls in (NODES | WATCHERS).items())


def _table(cls: type) -> str:
    rows = ["| parameter | default | allowed | symbol | meaning |", "|---|---|---|---|---|"]
    for name, entry in schema.entries(cls).items():
        default = list(entry.default) if isinstance(entry.default, tuple) else entry.default
        shown = f"{default:g}" if isinstance(default, float) else str(default)
        mark = " *" if entry.tunable else ""
        symbol = f"`{entry.symbol}`" if entry.symbol else ""
        meaning = entry.description.replace("|", "&#124;")
        rows.append(f"| `{name}`{mark} | {shown} | {entry.allowed} | {symbol} | {meaning} |")
    return "\n".join(rows) + "\n"
