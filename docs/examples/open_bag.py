"""Read a recorded run with NumPy: how large was the tracking error, and how large the surge force?

    python docs/examples/open_bag.py runs/<time>_case2_tracking/bag

It needs no ROS: `pip install .` in this folder is enough.
"""

import sys

import numpy as np

from vessel_hsmc_ros import open_bag
from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.core.exceptions import VesselHsmcError


def main(path: str) -> None:
    """Print what a bag contains and, if it is a run of a vessel, some metrics of it."""
    bag = open_bag(path)
    print(f"{bag.count} messages in {(bag.end_time - bag.start_time) / 1e9:g} s{'' if bag.complete else ', cut off'}")
    for name, series in sorted(bag.topics.items()):
        print(f"  {name}: {series.count} of {series.type}")
    try:
        describe_run(bag)
    except VesselHsmcError as error:  # a bag of another system: no odometry, reference or wrench
        sys.exit(f"no run in this bag: {error}")


def describe_run(bag: Bag) -> None:
    """Print metrics of the run in a bag."""
    # A vessel's run: all its topics, matched by their time stamps.
    run = bag.run()
    error = np.hypot(*(run.state - run.reference)[:, :2].T)
    print(f"position error: {error[0]:.2f} m at the start, {error.min():.2f} m at best, {error[-1]:.2f} m at the end")
    print(f"largest surge force: {np.abs(run.wrench[:, 0]).max():.3g} N")

    # Any field of any message is a column; times are integer nanoseconds.
    odom = bag["odom"]
    position = np.column_stack([odom["pose.pose.position.x"], odom["pose.pose.position.y"]])
    print(f"the ship went from {position[0].round(2)} to {position[-1].round(2)}")

    # The bag contains the parameters that it was recorded with.
    print(f"the law was {bag.scenario().controller.law}")


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except VesselHsmcError as error:
        sys.exit(str(error))
