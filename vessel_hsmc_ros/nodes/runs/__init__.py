"""Nodes of a run as processes: start, supervision, end."""
