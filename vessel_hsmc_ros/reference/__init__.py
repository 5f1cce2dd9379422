"""What the vessel follows: the virtual ship, a course, goals, paths."""
