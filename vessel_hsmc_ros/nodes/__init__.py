"""The ROS nodes and what they share."""
