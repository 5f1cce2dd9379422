"""Delete a node just after its peer has been killed, again and again: does the middleware survive it?

`python benchmarks/killed_peers.py [--profiles FILE] [--repeats N]` ends with `N of N`, or with the segmentation fault or the hang
that it looks for. Without `--profiles` it uses config/fastdds.xml; a file with the transport SHM shows what shared memory does.
"""

import argparse
import faulthandler
import os
import subprocess
import sys
import time
from pathlib import Path

TOPICS = 8
HUNG = 60.0
"""Time after which one repeat has hung, s."""

PEER = f"""
import rclpy
from std_msgs.msg import Float64
rclpy.init()
node = rclpy.create_node("peer")
for number in range({TOPICS}):
    node.create_subscription(Float64, f"to_peer_{{number}}", lambda message: None, 100)
publishers = [node.create_publisher(Float64, f"from_peer_{{number}}", 100) for number in range({TOPICS})]
node.create_timer(0.005, lambda: [publisher.publish(Float64()) for publisher in publishers])
rclpy.spin(node)
"""


def repeat(turn: int) -> None:
    """Exchange messages with a peer, kill it, and delete the own node before or after the system has noticed."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from std_msgs.msg import Float64

    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    node = rclpy.create_node("survivor", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    received: list[Float64] = []
    publishers = [node.create_publisher(Float64, f"to_peer_{number}", 100) for number in range(TOPICS)]
    for number in range(TOPICS):
        node.create_subscription(Float64, f"from_peer_{number}", received.append, 100)
    peer = subprocess.Popen([sys.executable, "-c", PEER])
    end = time.monotonic() + 20.0
    while len(received) < 50 and time.monotonic() < end:
        for publisher in publishers:
            publisher.publish(Float64())
        executor.spin_once(timeout_sec=0.01)
    peer.kill()
    if turn % 3 == 0:
        peer.wait()
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
    peer.wait()


def main() -> None:
    """Print how many repeats were survived."""
    own = Path(__file__).resolve().parents[1] / "config" / "fastdds.xml"
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--profiles", type=Path, default=own, help="profiles of Fast DDS")
    parser.add_argument("--repeats", type=int, default=150)
    given = parser.parse_args()
    os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(given.profiles.resolve())
    faulthandler.enable()
    for turn in range(given.repeats):
        faulthandler.dump_traceback_later(HUNG, exit=True)
        repeat(turn)
        faulthandler.cancel_dump_traceback_later()
        print(f"\r{turn + 1} of {given.repeats}", end="", flush=True)
    print()


if __name__ == "__main__":
    main()
