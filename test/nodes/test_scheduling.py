"""How the process of a node is scheduled."""

import subprocess
import sys

PROGRAM = """
import gc, os, threading
from vessel_hsmc_ros.nodes.process import run_in_batches, spare_collections
threading.Thread(target=threading.Event().wait, daemon=True).start()
run_in_batches()
print(*{os.sched_getscheduler(int(thread)) == os.SCHED_BATCH for thread in os.listdir("/proc/self/task")})
spare_collections()
print(gc.get_freeze_count() > 1000)
"""


def test_all_threads_run_in_batches_and_what_the_start_created_is_not_collected() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "True"]
