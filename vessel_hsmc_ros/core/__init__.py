"""What everything stands on: exceptions, declarations, kinematics, time, metrics."""
