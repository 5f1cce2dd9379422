"""The plant: the equations of ship, actuators, thrusters, sensors and environment, which share only the core with the laws."""
