"""Studies of laws and ships: comparisons, campaigns, tuning, identification, manoeuvres, the paper."""
