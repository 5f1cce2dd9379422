"""`python -m vessel_sim_node` runs the plant-simulator node."""

import sys

from vessel_hsmc_ros.nodes.entry_points import vessel_sim_node

sys.exit(vessel_sim_node())
