"""The control loop and the observer."""
