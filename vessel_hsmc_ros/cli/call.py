"""`vessel-hsmc call`: pause, resume, reset, enable or disable running nodes."""

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import vessel_option
from vessel_hsmc_ros.cli.running import running_vessel

SWITCHES = {
    "pause": (("vessel_sim", "reference_ship"), "pause", True),
    "resume": (("vessel_sim", "reference_ship"), "pause", False),
    "enable": (("controller",), "enable", True),
    "disable": (("controller",), "enable", False),
    "stop": (("controller",), "enable", False),
}
"""Nodes, service and flag of each action that switches something."""

RESET = ("vessel_sim", "reference_ship", "controller")


@click.command()
@click.argument("action", type=click.Choice([*SWITCHES, "reset"]))
@vessel_option
def call(action: str, namespace: str) -> None:
    """Pause, resume, reset, enable, disable or stop a running vessel.

    \b
    pause, resume    the plant and the reference; time goes on in real time
    reset            ship and reference return to their start, the law forgets
    disable, stop    the controller commands a zero wrench, at once and until
                     `enable`; the run goes on, Ctrl-C in its terminal ends it
    enable           the controller commands again
    """  # noqa: D301 - \b keeps click from wrapping the list
    with running_vessel(namespace) as remote:
        from std_srvs.srv import SetBool, Trigger

        from vessel_hsmc_ros.nodes.remote import Service

        if action == "reset":
            services, request = [Service(node, "reset", Trigger) for node in RESET], Trigger.Request()
        else:
            nodes, name, flag = SWITCHES[action]
            services, request = [Service(node, name, SetBool) for node in nodes], SetBool.Request(data=flag)
        for service, client in zip(services, remote.connect(services), strict=True):
            print_line(f"{service.node}: {remote.call(client, request).message}")
