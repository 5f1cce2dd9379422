"""The closed loop without ROS, interpreted or compiled: preparation of a scenario, the loop as a kernel, what it records."""
