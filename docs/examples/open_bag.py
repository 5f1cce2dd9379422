"""Read a recorded run with NumPy alone: how far off was the ship, and how hard did it work?

    python docs/examples/open_bag.py runs/<time>_case2_tracking/bag

It needs no ROS: `pip install .` in this folder is enough.
"""

import sys

import numpy as np

from vessel_hsmc_ros.bags.reader import open_bag


def main(path: str) -> None:
    """Print what a bag holds and how the run in it went."""
    bag = open_bag(path)
    print(f"{bag.count} messages in {(bag.end_time - bag.start_time) / 1e9:g} s{'' if bag.complete else ', cut off'}")
    for name, series in sorted(bag.topics.items()):
        print(f"  {name}: {series.count} of {series.type}")

    # Any field of any message is a column; the times are whole nanoseconds.
    odom = bag["odom"]
    position = np.column_stack([odom["pose.pose.position.x"], odom["pose.pose.position.y"]])
    print(f"the ship went from {position[0].round(2)} to {position[-1].round(2)}")

    # A vessel's run, all its topics matched by their stamps.
    run = bag.run()
    error = np.hypot(*(run.state - run.reference)[:, :2].T)
    print(f"position error: {error[0]:.2f} m at the start, {error.min():.2f} m at best, {error[-1]:.2f} m at the end")
    print(f"largest surge force: {np.abs(run.wrench[:, 0]).max():.3g} N")

    # What it was recorded with travels inside.
    print(f"the law was {bag.scenario().controller.law}")


if __name__ == "__main__":
    main(sys.argv[1])
