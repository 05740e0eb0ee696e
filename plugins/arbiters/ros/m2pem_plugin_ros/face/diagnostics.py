"""What /diagnostics says of each vehicle and payload: link, readiness with its reasons, mode."""

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from m2pem.api import LinkState, PayloadState, ResourceId, VehicleState
from m2pem_plugin_ros.interfaces.messages import time_of
from m2pem_plugin_ros.interfaces.texts import one_line
from m2pem_plugin_ros.sensors.health import OWN_STATUS

QUEUE = 10


class DiagnosticsPublisher:
    """`publish` is called about once a second, as a diagnostic aggregator expects."""

    def __init__(self, node: Node, resources: list[ResourceId], namespace: str) -> None:
        self._resources = resources
        self._prefix = f"{OWN_STATUS}{node.get_fully_qualified_name()}"
        self._hardware = f"{namespace}/".lstrip("/")
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", QUEUE)

    def publish(
        self, states: Mapping[ResourceId, VehicleState | PayloadState], now_us: int
    ) -> None:
        """Publish all vehicles, and the payloads that have telemetry."""
        if not self._publisher.get_subscription_count():
            return
        message = DiagnosticArray(
            status=[
                _status(f"{self._prefix}: {each}", self._hardware + each, states.get(each))
                for each in self._resources
                if each in states or "/" not in each
            ]
        )
        message.header.stamp = time_of(now_us)
        self._publisher.publish(message)


def _status(name: str, hardware: str, state: VehicleState | PayloadState | None) -> Any:
    message = DiagnosticStatus(name=name, hardware_id=hardware)
    if state is None:
        message.level, message.message = DiagnosticStatus.STALE, "no telemetry yet"
        return message
    values: dict[str, object] = {"link": state.link.value, "behavior": state.behavior}
    if isinstance(state, VehicleState):
        values |= {"mode": state.mode, "armed": state.armed, "ready": state.ready}
        values["not ready"] = "; ".join(state.not_ready_reasons)
        if state.battery_fraction is not None:
            values["battery"] = f"{state.battery_fraction:.2f}"
    message.level, text = _level(state)
    message.message = one_line(text)
    message.values = [
        KeyValue(key=key, value=one_line(str(value)))
        for key, value in values.items()
        if value is not None and value != ""
    ]
    return message


def _level(state: VehicleState | PayloadState) -> tuple[bytes, str]:
    problems = {LinkState.LOST: ["link lost"], LinkState.DEGRADED: ["link degraded"]}.get(
        state.link, []
    )
    if isinstance(state, VehicleState) and state.ready is False:
        reasons = "; ".join(state.not_ready_reasons)
        problems.append(f"not ready: {reasons}" if reasons else "not ready")
    if state.link is LinkState.LOST:
        return DiagnosticStatus.ERROR, "; ".join(problems)
    if problems:
        return DiagnosticStatus.WARN, "; ".join(problems)
    return DiagnosticStatus.OK, "ok"
