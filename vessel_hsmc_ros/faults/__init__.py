"""Scripted faults as pure functions: what a fault does to the messages of a topic, and when."""
