"""What `ros2 param` and `ros2 lifecycle` do, in plain rclpy: the clients of one node's services."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

AMPLE_S = 40.0

CONFIGURE = Transition.TRANSITION_CONFIGURE
ACTIVATE = Transition.TRANSITION_ACTIVATE
DEACTIVATE = Transition.TRANSITION_DEACTIVATE
CLEANUP = Transition.TRANSITION_CLEANUP


class NodeClient:
    """Asks `title`, a node such as /evsg1/m2pem_onboard, in a ROS domain."""

    def __init__(self, title: str, domain: int) -> None:
        self.title = title
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain, args=[])
        self.node = rclpy.create_node("client", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.shutdown()

    def until(self, holds: Callable[[], object], about: object = "") -> Any:
        """Spin until something is true, and return it."""
        deadline_s = time.monotonic() + AMPLE_S
        while not (found := holds()):
            assert time.monotonic() < deadline_s, f"it did not become true {about}"
            self._executor.spin_once(timeout_sec=0.02)
        return found

    def heard(self, kind: Any, topic: str, qos: Any = 10) -> list[Any]:
        """A list to which messages are added."""
        messages: list[Any] = []
        self.node.create_subscription(kind, topic, messages.append, qos)
        return messages

    def ask(self, kind: Any, service: str, **fields: Any) -> Any:
        """Call a service of the node, and return its response."""
        client = self.node.create_client(kind, f"{self.title}/{service}")
        self.until(client.service_is_ready)
        future = client.call_async(kind.Request(**fields))
        self.until(future.done)
        self.node.destroy_client(client)
        return future.result()

    # --- parameters -----------------------------------------------------------------------------

    def names(self) -> Sequence[str]:
        return list(self.ask(ListParameters, "list_parameters").result.names)

    def described(self, *names: str) -> Sequence[ParameterDescriptor]:
        return list(self.ask(DescribeParameters, "describe_parameters", names=names).descriptors)

    def values(self, *names: str) -> Sequence[Any]:
        got = self.ask(GetParameters, "get_parameters", names=names).values
        return [_value(each) for each in got]

    def set(self, name: str, value: float | bool) -> Any:
        """The result of setting a parameter."""
        said = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=float(value))
        if isinstance(value, bool):
            said = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=value)
        parameters = [Parameter(name=name, value=said)]
        return self.ask(SetParameters, "set_parameters", parameters=parameters).results[0]

    # --- life cycle -----------------------------------------------------------------------------

    def state(self) -> str:
        return str(self.ask(GetState, "get_state").current_state.label)

    def change(self, transition: int | str) -> bool:
        """Whether the transition was made."""
        said = Transition(label=transition) if isinstance(transition, str) else None
        said = said or Transition(id=transition)
        return bool(self.ask(ChangeState, "change_state", transition=said).success)


def _value(value: ParameterValue) -> Any:
    kinds = {
        ParameterType.PARAMETER_BOOL: value.bool_value,
        ParameterType.PARAMETER_DOUBLE: value.double_value,
        ParameterType.PARAMETER_STRING: value.string_value,
        ParameterType.PARAMETER_DOUBLE_ARRAY: list(value.double_array_value),
    }
    return kinds.get(value.type)


@contextmanager
def node_client(title: str, domain: int) -> Iterator[NodeClient]:
    """A client, closed at the end."""
    client = NodeClient(title, domain)
    try:
        yield client
    finally:
        client.close()
