"""How the process of a node is scheduled."""

import subprocess
import sys

PROGRAM = """
import gc, os, threading
from vessel_hsmc_ros.nodes import scheduling
threading.Thread(target=threading.Event().wait, daemon=True).start()
threads = scheduling._threads()
scheduling.run_promptly()
print({os.sched_getscheduler(thread) == os.SCHED_OTHER for thread in threads}, {os.getpriority(0, thread) for thread in threads})
scheduling.run_in_batches(3)
print({os.getpriority(0, thread) for thread in threads}, len(threads))
scheduling.spare_collections()
print(gc.get_freeze_count() > 1000)
"""


def test_prompt_scheduling_keeps_policy_and_niceness_and_batches_give_way_in_all_threads() -> None:
    own = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpriority(0, 0))"], capture_output=True, text=True, check=True
    )
    nice = int(own.stdout)
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [f"{{True}} {{{nice}}}", f"{{{min(19, nice + 3)}}} 2", "True"]
