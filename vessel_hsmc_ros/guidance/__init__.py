"""References to track: virtual ship, course, goals and paths, with the motion filter that makes them feasible."""
