"""The plant: model of an underactuated ship with disturbances, actuators and sensors, and the node that simulates it."""
