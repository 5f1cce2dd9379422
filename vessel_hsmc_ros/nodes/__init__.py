"""ROS 2 nodes, and what they are made of."""

import sys

if sys.argv[:1] == ["-m"]:  # `python -m vessel_hsmc_ros.nodes.NAME` imports this package before the node, and that ROS
    from vessel_hsmc_ros.nodes.entry_points import check_module, end_on_interrupt

    end_on_interrupt()
    check_module(sys.orig_argv)
