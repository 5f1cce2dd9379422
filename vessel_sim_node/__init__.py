"""The plant side: an underactuated ship, its disturbances and actuators, and the node that publishes them."""
