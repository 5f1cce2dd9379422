"""The node that simulates the plant; the equations are in `vessel_hsmc_ros.plant`."""
