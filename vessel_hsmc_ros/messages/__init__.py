"""ROS messages and topics to plain values and back."""
