"""A valid input for each target of the fuzzing."""

import io
import tempfile
from functools import cache
from pathlib import Path

from bag_making import write_run
from mcap.writer import CompressionType, Writer

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.install_paths import share_directory

CHANGES = """controller.law=guided
vessel_sim.duration=10.0
reference_ship.circle.speed=1
vessel_sim.vessel.surge_inertia=1.3e6
controller.guided.position_gain=0.3
"""


@cache
def _kept() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="fuzz_")


def folder() -> Path:
    """A folder for files, which ends with this process."""
    return Path(_kept().name)


@cache
def seeds() -> dict[str, bytes]:
    """A valid input for each target."""
    config = share_directory() / "config"
    made = folder() / "seed"
    write_run(made, 30)
    opened = open_bag(made)
    rows = "".join(f"{0.1 * i},{0.2 * i},0.0,0.0,2.0,0.0,0.0,{100.0 * (i % 7)},0.0\n" for i in range(60))
    return {
        "message": next(opened.raw_messages("odom")).data,
        "scenario": (config / "case2_tracking.yaml").read_bytes(),
        "parameters": CHANGES.encode(),
        "ranges": bytes(8),
        "faults": (config / "faults" / "example.yaml").read_bytes(),
        "suite": (config / "suites" / "guided.yaml").read_bytes(),
        "campaign": (config / "campaigns" / "environment.yaml").read_bytes(),
        "vessel": (config / "vessels" / "otter.yaml").read_bytes(),
        "csv": ("time,x,y,heading,u,v,r,surge_force,yaw_moment\n" + rows).encode(),
        "waypoints": b"x,y,heading\n0,0,0\n10.5,2,0.1\n20,3,0.2\n",
        "bag": next(made.glob("*.mcap")).read_bytes(),
        "unchecked_bag": without_checksums(made),
        "metadata": (made / "metadata.yaml").read_bytes(),
    }


def without_checksums(path: Path) -> bytes:
    """The messages of a bag in a file without compression and checksums."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE, enable_crcs=False)
    writer.start("ros2")
    opened, channels = open_bag(path), {}
    for name, series in opened.topics.items():
        described = writer.register_schema(series.type, "ros2msg", series.definition.encode())
        channels[name] = writer.register_channel(name, "cdr", described, {"offered_qos_profiles": "[]"})
    writer.add_metadata("rosbag2", {"serialized_metadata": "{}"})
    writer.add_attachment(0, 0, "parameters.yaml", "text/yaml", b"{}")
    for number, raw in enumerate(opened.raw_messages()):
        writer.add_message(channels[raw.topic], raw.log_time, raw.data, raw.publish_time, number)
    writer.finish()
    return stream.getvalue()
