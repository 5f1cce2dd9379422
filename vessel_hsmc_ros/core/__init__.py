"""Foundations of all other packages: exceptions, parameter declarations, kinematics, timing, metrics."""
