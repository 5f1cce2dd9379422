"""The SROS2 policy, config/security/policy.xml: what each node may do, by the INTERFACE of its class.

The classes are read without importing them: the libraries of some need not be installed.
"""

import ast
import inspect
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.node_list import PROGRAMS, NodeProgram
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

POLICY = Path(__file__).resolve().parents[2] / "config" / "security" / "policy.xml"
HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<!-- What each node may publish, subscribe to and serve, for SROS2: docs/security.md. Names without a slash are relative to the
     namespace: for a second vessel replace ns="/" by its namespace. Written by `make docs` of the nodes' INTERFACE; the tests
     compare this file with the graph of the nodes. -->
"""

RULES = {
    "publishes": ("topics", "publish", "topic"),
    "subscribes to": ("topics", "subscribe", "topic"),
    "services": ("services", "reply", "service"),
    "calls": ("services", "request", "service"),
    "actions": ("actions", "execute", "action"),
}
"""The rows of an INTERFACE, and their element, rule and entries in the policy."""

OF_LOG = ["/parameter_events", "/rosout"]
OF_EVERY_NODE = {
    "publishes": ["/diagnostics", *OF_LOG],
    "subscribes to": ["/clock"],
    "services": [
        *(f"~/{name}" for name in ("describe_parameters", "get_parameter_types", "get_parameters", "get_type_description")),
        *(f"~/{name}" for name in ("list_parameters", "set_parameters", "set_parameters_atomically")),
    ],
}

REPLAYED = [topic for topic in RECORDED_TOPICS if topic != "cmd_wrench"]
OTHERS = {
    "replay": {**OF_EVERY_NODE, "publishes": REPLAYED, "services": ["~/pause", *OF_EVERY_NODE["services"]]},
    "run_monitor": {"publishes": OF_LOG, "subscribes to": ["/diagnostics"], "services": ["~/get_type_description"]},
}
"""Nodes within the commands: a replay of a bag, which commands nothing, and the observer of a run."""


def policy() -> str:
    """The policy of all nodes, each in an enclave of its own."""
    root = ElementTree.Element("policy", version="0.2.0")
    enclaves = ElementTree.SubElement(root, "enclaves")
    for node, rights in ({name: _rights(name, program) for name, program in PROGRAMS.items()} | OTHERS).items():
        enclave = ElementTree.SubElement(enclaves, "enclave", path=f"/vessel_hsmc/{node}")
        profile = ElementTree.SubElement(ElementTree.SubElement(enclave, "profiles"), "profile", ns="/", node=node)
        for row, (element, rule, entry) in RULES.items():
            if names := rights.get(row):
                rules = ElementTree.SubElement(profile, element, {rule: "ALLOW"})
                for name in dict.fromkeys(names):
                    ElementTree.SubElement(rules, entry).text = name
    ElementTree.indent(root)
    return HEAD + ElementTree.tostring(root, encoding="unicode") + "\n"


def _rights(node: str, program: NodeProgram) -> dict[str, list[str]]:
    """The names in each row of a node's INTERFACE, and those of every node.

    What is in parentheses is for the reader; `<topics>` are the default of this parameter; for `thrusters/<name>/thrust` the
    policy has `thrusters/*`.
    """
    text = _interface(program)
    if "<topics>" in text:
        topics: Any = schema.entries((NODES | WATCHERS)[node])["topics"].default
        text = text.replace("<topics>", ", ".join(topics))
    text = re.sub(r"\s*\([^)]*\)|\n +(?= )", "", text)
    found = dict(re.split(r"  +", line, maxsplit=1) for line in text.splitlines())
    names = {row: re.sub(r"<[^,]*", "*", found[row]).split(", ") for row in found}
    return {row: names.get(row, []) + OF_EVERY_NODE.get(row, []) for row in RULES}


def _interface(program: NodeProgram) -> str:
    """The INTERFACE of a node's class."""
    found = find_spec(program.source)
    tree = ast.parse(Path(found.origin).read_text(encoding="utf-8") if found and found.origin else "")
    own = next(each for each in ast.walk(tree) if isinstance(each, ast.ClassDef) and each.name == program.kind)
    values = (each.value for each in own.body if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "INTERFACE")
    return inspect.cleandoc(ast.literal_eval(next(values)))
