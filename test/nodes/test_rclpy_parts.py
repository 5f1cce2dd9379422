"""One module names the parts of rclpy that are not documented."""

import re
from pathlib import Path

import vessel_hsmc_ros
import vessel_sim_node
from vessel_hsmc_ros.nodes import rclpy_parts

PARTS = re.compile(
    r"_rclpy_pybind11|implementation_singleton|\b_callback_type\b|\._guard\b|\b_parameter_overrides\b|\.(take_message|publish_raw)\b"
)


def test_no_other_module_uses_them() -> None:
    assert len(PARTS.findall(Path(rclpy_parts.__file__).read_text())) == 6
    sources = [
        path for package in (vessel_hsmc_ros, vessel_sim_node) for path in Path(package.__file__ or "").parent.rglob("*.py")
    ]
    assert len(sources) > 200
    assert [path.name for path in sources if PARTS.search(path.read_text())] == ["rclpy_parts.py"]
