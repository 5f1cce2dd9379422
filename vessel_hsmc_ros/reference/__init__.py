"""References to track: the virtual ship, a course, goals, paths."""
