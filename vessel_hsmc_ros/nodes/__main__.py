"""`python -m vessel_hsmc_ros.nodes NAME` runs a node by its name, with the arguments that follow; or several nodes."""

import sys

from vessel_hsmc_ros.core.node_list import GROUP, PROGRAMS
from vessel_hsmc_ros.nodes.entry_points import end_on_interrupt, entry_point


def main() -> int:
    """Run what the arguments of the process name; returns the exit code."""
    end_on_interrupt()
    name = sys.argv.pop(1) if len(sys.argv) > 1 else ""
    if name == GROUP:
        from vessel_hsmc_ros.nodes import node_group

        return node_group.main()
    if name not in PROGRAMS:
        sys.exit(f"NAME must be one of {', '.join(PROGRAMS)} (got {name or 'none'})")
    return entry_point(PROGRAMS[name])()


if __name__ == "__main__":
    sys.exit(main())
