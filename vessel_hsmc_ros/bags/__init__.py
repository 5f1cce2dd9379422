"""MCAP bags: writing, reading by columns, repairing. Needs no ROS."""
