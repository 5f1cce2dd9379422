"""Scenarios, suites and run folders: what runs, declared and checked."""
