"""`vessel-hsmc call`: pause, resume, hold, release, reset, enable, disable, stop or rearm running nodes."""

import click

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.cli.options import running_vessel, vessel_option
from vessel_hsmc_ros.core.exceptions import RunError

SWITCHES = {
    "pause": (("vessel_sim", "reference_ship"), "pause", True),
    "resume": (("vessel_sim", "reference_ship"), "pause", False),
    "hold": (("reference_ship",), "hold", True),
    "release": (("reference_ship",), "hold", False),
    "enable": (("controller",), "enable", True),
    "disable": (("controller",), "enable", False),
}
"""Nodes, service and flag of each action that switches something."""

TRIGGERS = {
    "reset": ("vessel_sim", "reference_ship", "controller"),
    "stop": ("controller",),
    "rearm": ("controller",),
}
"""Nodes of each action that triggers something, whose service has the same name."""


@click.command()
@click.argument("action", type=click.Choice([*SWITCHES, *TRIGGERS]))
@vessel_option
def call(action: str, namespace: str) -> None:
    """Pause, resume, hold, release, reset, enable, disable, stop or rearm a running vessel.

    \b
    pause     pause ship and reference; in real time the clock goes on
    resume    let ship and reference go on after a pause
    hold      let the vessel come to rest on its way and keep station
    release   let it sail its way on after a hold
    reset     put ship and reference back to their start, and reset the law
    disable   put the controller into standby: it commands zero until `enable`
              (the run goes on; Ctrl-C in its terminal ends it)
    stop      command zero at once, in any state, and stay stopped until `rearm`
    rearm     end the stop: the controller is in standby, and `enable` starts it
    enable    let the controller command, if its inputs are complete
    """  # noqa: D301 - \b keeps click from wrapping the list
    with running_vessel(namespace) as remote:
        from std_srvs.srv import SetBool, Trigger

        from vessel_hsmc_ros.nodes.remote import Service

        if action in TRIGGERS:
            services, request = [Service(node, action, Trigger) for node in TRIGGERS[action]], Trigger.Request()
        else:
            nodes, name, flag = SWITCHES[action]
            services, request = [Service(node, name, SetBool) for node in nodes], SetBool.Request(data=flag)
        for service, client in zip(services, remote.connect(services), strict=True):
            response = remote.call(client, request)
            if not response.success:
                raise RunError(f"{service.node}: {response.message}")
            print_line(f"{service.node}: {response.message}")
