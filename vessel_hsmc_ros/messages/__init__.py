"""ROS messages and topics: conversions, definitions, checks. Needs no running ROS."""
