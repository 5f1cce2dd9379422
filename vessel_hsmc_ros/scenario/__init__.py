"""Scenarios and suites, declared and validated, and the folders of their runs."""
