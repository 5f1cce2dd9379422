"""Campaigns: many runs with drawn parameters, kept as a dataset that any number of processes can add to."""
