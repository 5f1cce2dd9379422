"""Runs of scenarios: offline or by the nodes, their verification, repetition and comparison."""
