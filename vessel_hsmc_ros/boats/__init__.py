"""Boats: nodes that connect them by their stacks and autopilots, with messages, parameters and interfaces."""
