"""A bench for tests of nodes."""

from node_bench import bench, plant, simulated_time

__all__ = ["bench", "plant", "simulated_time"]
