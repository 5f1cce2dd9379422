"""The verb `forecast` as a process, from a boat's main data to the page."""

import json
from collections.abc import Callable
from pathlib import Path

from harness import Command, run_folder

Start = Callable[..., Command]


