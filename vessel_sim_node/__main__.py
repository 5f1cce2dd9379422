"""`python -m vessel_sim_node` runs the plant-simulator node."""

import sys

from vessel_sim_node.node import main

sys.exit(main())
