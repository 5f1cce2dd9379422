"""Tuning of a law's gains: a search over their ranges whose cost is a metric over many runs."""
