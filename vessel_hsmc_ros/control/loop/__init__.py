"""The control loop, which runs a law at a fixed rate, and the state observer."""
