"""MCAP bags: writing, reading by columns, repair. Needs no ROS installation."""
