"""A managed (lifecycle) node, whose output a person activates, deactivates and stops.

`...` stands for `ros2 lifecycle set NODE`.

| request | lifecycle | effect |
|---|---|---|
| `~/enable` true, `... activate` | inactive -> active | the node commands; refused with a reason unless it is ready |
| `~/enable` false, `... deactivate` | active -> inactive | standby: the node computes and commands nothing |
| `~/stop` | active -> inactive | zero at once, latched until `~/rearm`, which leads to standby |
| `... cleanup` | inactive -> unconfigured | the node computes nothing either; more of its parameters can be set |
| `... configure` | unconfigured -> inactive | standby, with the parameters of now |
| `... shutdown` | any -> finalized | as unconfigured, for good |
"""

from abc import abstractmethod
from typing import Any, ClassVar

from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import SetBool

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import RefusalError, VesselHsmcError
from vessel_hsmc_ros.nodes.base import VesselNode, refuse_failed_requests

STANDBY = "disabled: in standby, nothing is commanded"

DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ManagedNode(LifecycleNodeMixin, VesselNode):  # type: ignore[misc]
    """Base of a node that commands actuators.

    Unless told otherwise it configures itself when its subclass calls `manage`, so that a node that is started by hand works
    without a lifecycle manager. In real time, its parameters can be set while it is unconfigured.
    """

    FIXED: ClassVar[frozenset[str]] = frozenset()
    """Names of the parameters, or of whole groups, that topics and timers are made of: these are fixed at the start."""

    def __init__(self, **options: Any) -> None:
        VesselNode.__init__(self, **options)
        self._refusal = ""
        self._quiet = False

    def manage(self, autostart: bool) -> None:
        """Offer the transitions and services; with `autostart` the node is then inactive, else unconfigured."""
        LifecycleNodeMixin.__init__(self)
        refuse_failed_requests(self, [self._service_change_state])
        if autostart:
            self.trigger_configure()
        else:
            self._lock(False)
        self.create_service(SetBool, "~/enable", self._serve_enable)
        self.reporter.offer("stop", self._stop)
        self.reporter.offer("rearm", self._rearm)

    def destroy_node(self) -> None:
        """Leave the ROS graph, in which the lifecycle would keep the node."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def _lock(self, locked: bool) -> None:
        """Let the parameters that cannot be changed while the node computes be read-only, or not."""
        for name, entry in schema.entries(self.PARAMETERS).items():
            fixed = self.parameters.lockstep or entry.tunable or not self.FIXED.isdisjoint((name, name.partition(".")[0]))
            if not fixed and self.has_parameter(name):
                self.describe_parameter(name).read_only = locked

    @abstractmethod
    def configure(self) -> None:
        """Take the present parameters. Raises VesselHsmcError if they are not allowed; the node stays unconfigured."""

    @abstractmethod
    def begin(self) -> None:
        """Begin to command. Raises RefusalError if the node is not ready; with the reason."""

    @abstractmethod
    def pause(self) -> None:
        """Go to standby, also from a state in which nothing was commanded."""

    @abstractmethod
    def halt(self) -> None:
        """Command zero at once, and latch."""

    @abstractmethod
    def rearm(self) -> None:
        """Unlatch. Raises RefusalError if the node is not stopped."""

    @property
    def lifecycle(self) -> str:
        """Label of the present lifecycle state: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def _serve_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = self.activate() if request.data else self._deactivate()
        response.message = ("enabled" if request.data else STANDBY) if response.success else f"not enabled: {self._refusal}"
        return response

    def activate(self) -> bool:
        """Request to command; returns whether the node does."""
        if self.lifecycle == "inactive":
            self.trigger_activate()
        elif self.lifecycle != "active":
            self._refusal = f"the node is {self.lifecycle}: it needs a transition to inactive first"
        return self.lifecycle == "active"

    def activate_quietly(self) -> bool:
        """Begin to command without a request, and so without an event."""
        self._quiet = True
        try:
            return self.activate()
        finally:
            self._quiet = False

    def _deactivate(self) -> bool:
        if self.lifecycle == "active":
            self.trigger_deactivate()
        else:
            self.pause()  # before the node has begun, too: it must not begin by itself then
            self.reporter.event("disable", STANDBY)
        return True

    def _stop(self) -> str:
        self.halt()
        if self.lifecycle == "active":
            self.trigger_deactivate()  # the stop stays latched
        return "stopped: the wrench is zero until ~/rearm"

    def _rearm(self) -> str:
        self.rearm()
        return "rearmed: in standby until ~/enable"

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take the present parameters; the node then computes."""
        del state
        try:
            self.configure()
        except VesselHsmcError as error:
            self.get_logger().error(f"not configured: {error}")
            return REFUSED
        self._lock(True)
        return DONE

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the parameters be set."""
        del state
        self._lock(False)
        return DONE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to command, unless the node is not ready."""
        del state
        try:
            self.begin()
        except RefusalError as error:
            self._refusal = str(error)
            self.get_logger().warning(f"not activated: {error}", throttle_duration_sec=1.0)
            return REFUSED
        self._refusal = ""
        if not self._quiet:
            self.reporter.event("enable", "enabled")
        return DONE

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go to standby; a stop stays latched."""
        del state
        self.pause()
        self.reporter.event("disable", STANDBY)
        return DONE

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Command nothing any more."""
        return self.on_deactivate(state)
