"""The verbs by their groups, with the line that the help of the command has of each: no verb is imported for it."""

GROUPS = {
    "Simulate a ship": {
        "demo": "Two control laws on one example, side by side, in one page.",
        "run": "Simulate a scenario by ROS 2 nodes and record it.",
        "simulate": "Simulate a scenario quickly, without ROS.",
        "scenarios": "List the scenarios, or print one to start from.",
        "vessels": "List the ships of the library, or show one of them.",
        "parameters": "List all parameters, or search them for a word.",
    },
    "Analyse": {
        "report": "Make a page with diagrams from recordings.",
        "replay": "Play a recording back, check it or repeat it.",
        "recover": "Repair a recording that was cut off or damaged.",
        "compare": "Compare control laws on scenarios, or recorded runs.",
        "sweep": "Simulate a scenario for each value of a parameter.",
        "campaign": "Simulate thousands of runs with drawn parameters.",
        "tune": "Search the gains of a law.",
        "gains": "Print the gains of the guided law, and its margins.",
        "reproduce": "Repeat every case and figure of the paper.",
    },
    "Running vessels": {
        "watch": "Show the state of a running vessel.",
        "call": "Pause, resume, reset, enable, disable, stop or rearm.",
        "set": "Change parameters of a running vessel.",
        "goto": "Send a running vessel to a position.",
        "path": "Send a running vessel along waypoints.",
    },
    "Your own boat": {
        "init": "Write a complete commented scenario for your ship.",
        "check": "Check the connection with a boat, line by line.",
        "manoeuvres": "Simulate turning circle, zig-zags and crash stop.",
        "excite": "Write manoeuvres for an identification.",
        "ardupilot": "Simulate the ship for ArduPilot's autopilot (SITL).",
        "identify": "Identify the hull data of a ship from recordings.",
    },
    "This command": {
        "completion": "Let the shell complete verbs, options and scenarios.",
    },
}

VERBS = {name: line for verbs in GROUPS.values() for name, line in verbs.items()}

BAGS = ("lz4", "mcap", "rosbags", "zstandard")
PAGES = (*BAGS, "jinja2", "matplotlib", "plotly")
LIBRARIES = {
    **dict.fromkeys(("demo", "run", "simulate", "compare", "sweep", "reproduce", "report"), PAGES),
    **dict.fromkeys(("campaign", "identify", "manoeuvres"), (*PAGES, "scipy")),
    "tune": (*PAGES, "optuna", "scipy"),
    "recover": ("lz4", "mcap", "zstandard"),
    "replay": BAGS,
    "scenarios": ("scipy",),
    "vessels": ("scipy",),
}
"""The modules that verbs import beside ROS, click, NumPy, PyYAML and rich."""
