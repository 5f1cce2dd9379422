"""A boat of your own, steered by this package: 30 lines of plain rclpy that integrate a 4 m boat in real time.

    python examples/my_boat.py                  # starts the boat, the reference and the controller; Ctrl-C ends them

or each node in a terminal of its own:

    python examples/my_boat.py --boat
    reference_ship_node --ros-args --params-file examples/my_boat.yaml
    controller_node     --ros-args --params-file examples/my_boat.yaml

A real boat takes the place of the class: it subscribes to `cmd_wrench` (surge force N, yaw moment N·m) and publishes `odom` (pose
in the frame `odom`, velocity in the frame of the boat). `ros2 topic echo /odom` or `recorder_node` watch it.
"""

import math
import subprocess
import sys
from pathlib import Path

import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

PERIOD = 0.02
MASS, INERTIA = (550.0, 700.0), 700.0  # with added mass: surge, sway [kg]; yaw [kg·m²]
DRAG = (70.0, 300.0, 400.0)  # surge, sway [N·s/m]; yaw [N·m·s]


class Boat(Node):
    """Integrates the boat's motion: pose x, y, psi and body velocity u, v, r."""

    def __init__(self) -> None:
        super().__init__("my_boat")
        self.x = self.y = self.psi = self.u = self.v = self.r = 0.0
        self.wrench, self.reference = WrenchStamped().wrench, PoseStamped().pose.position
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.create_subscription(WrenchStamped, "cmd_wrench", self._on_command, 10)
        self.create_subscription(PoseStamped, "reference/pose", self._on_reference, 10)
        self.create_timer(PERIOD, self._step)
        self.create_timer(1.0, self._report)

    def _on_command(self, message: WrenchStamped) -> None:
        self.wrench = message.wrench

    def _on_reference(self, message: PoseStamped) -> None:
        self.reference = message.pose.position

    def _step(self) -> None:
        (m1, m2), (d1, d2, d3), (u, v, r) = MASS, DRAG, (self.u, self.v, self.r)
        self.u += PERIOD * (m2 * v * r - d1 * u + self.wrench.force.x) / m1
        self.v += PERIOD * (-m1 * u * r - d2 * v) / m2
        self.r += PERIOD * ((m1 - m2) * u * v - d3 * r + self.wrench.torque.z) / INERTIA
        self.psi += PERIOD * self.r
        self.x += PERIOD * (self.u * math.cos(self.psi) - self.v * math.sin(self.psi))
        self.y += PERIOD * (self.u * math.sin(self.psi) + self.v * math.cos(self.psi))
        self._publish()

    def _publish(self) -> None:
        message = Odometry(child_frame_id="base_link")
        message.header.stamp, message.header.frame_id = self.get_clock().now().to_msg(), "odom"
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y = self.x, self.y
        pose.orientation.w, pose.orientation.z = math.cos(0.5 * self.psi), math.sin(0.5 * self.psi)
        twist.linear.x, twist.linear.y, twist.angular.z = self.u, self.v, self.r
        self.odometry.publish(message)

    def _report(self) -> None:
        error = math.hypot(self.x - self.reference.x, self.y - self.reference.y)
        print(f"boat at {self.x:.2f} {self.y:.2f}, {error:.3f} m from the reference", flush=True)


def main() -> None:
    """Run the boat, and unless `--boat` is given, the reference and the controller as processes of their own."""
    nodes = [] if "--boat" in sys.argv else ["reference_ship", "controller"]
    settings = ["--ros-args", "--params-file", str(Path(__file__).with_suffix(".yaml"))]
    commands = [[sys.executable, "-m", "vessel_hsmc_ros.nodes", node, *settings] for node in nodes]
    processes = [subprocess.Popen(command) for command in commands]  # noqa: S603 - our own modules
    rclpy.init()
    try:
        rclpy.spin(Boat())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(30.0)  # a node whose middleware hangs ends by itself after 20 s


if __name__ == "__main__":
    main()
