"""Types of messages and services by their names, of any package that is installed."""

import re
from typing import Any

from m2pem.api import did_you_mean
from m2pem_plugin_ros.installation import RosError, require_interfaces

MESSAGE, SERVICE = "msg", "srv"

_EXAMPLES = {MESSAGE: "std_msgs/msg/Bool", SERVICE: "std_srvs/srv/SetBool"}
_NAME = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9]*)")


def full_name(name: str, kind: str) -> str:
    """Return a name such as "std_msgs/msg/Bool"; "std_msgs/Bool" is a short form of it.

    Raises:
        RosError: it is no such name.
    """
    found = _NAME.fullmatch(name)
    if found is None or found[2] not in (None, kind):
        raise RosError(f"{name!r} is not the name of a ROS type such as {_EXAMPLES[kind]}")
    return f"{found[1]}/{kind}/{found[3]}"


def find_type(name: str, kind: str) -> Any:
    """Return the class of a message (`MESSAGE`) or service (`SERVICE`).

    Raises:
        RosError: the name is wrong, or its package is not installed or has no such type.
    """
    package, _, type_ = full_name(name, kind).split("/")
    module = getattr(require_interfaces(package), kind, None)
    found = getattr(module, type_, None)
    if not isinstance(found, type):
        known = [each for each in dir(module) if each[:1].isupper()] if module else []
        hint = did_you_mean(type_, known) or (
            f"it has {', '.join(known[:20])}" if known else f"it has none of the kind {kind}"
        )
        raise RosError(f"the ROS package {package} has no {kind}/{type_}; {hint}")
    return found
