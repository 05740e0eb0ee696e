"""What the environment says of this unit: its namespace, and whether it stays on this machine."""

import os
import re
from collections.abc import Mapping

from m2pem.errors import PluginError

NAMESPACE = "M2PEM_ROS_NAMESPACE"
"""Where services and topics are: /m2pem, unless this variable says otherwise."""

LOOPBACK = "M2PEM_ROS_LOOPBACK"
"""1: DDS stays on 127.0.0.1. 0: it does not. Otherwise it does where nothing real moves."""

DEFAULT_NAMESPACE = "/m2pem"

_NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


class SettingError(PluginError):
    """A variable of the environment is not what it may be."""

    exit_status = 2


def namespace(environment: Mapping[str, str] = os.environ) -> str:
    """The namespace of the executive's node, with a leading "/".

    Raises:
        SettingError: it is not one of ROS.
    """
    named = environment.get(NAMESPACE, "").strip() or DEFAULT_NAMESPACE
    absolute = f"/{named.strip('/')}"
    if not _NAMESPACE.fullmatch(absolute) or "__" in absolute:
        raise SettingError(
            f"{NAMESPACE}={named!r} is no namespace of ROS: it has letters, digits and single '_', "
            "in parts that begin with a letter, such as /team_a/m2pem"
        )
    return absolute


def stays_on_loopback(environment: Mapping[str, str], *, simulated: bool) -> bool:
    """Whether DDS is to stay on 127.0.0.1; `simulated`: nothing real moves.

    Raises:
        SettingError: the variable has another value than 0, 1 or none.
    """
    match environment.get(LOOPBACK, "").strip():
        case "":
            return simulated
        case "0":
            return False
        case "1":
            return True
        case other:
            raise SettingError(f"{LOOPBACK}={other!r}: 1 keeps DDS on 127.0.0.1, and 0 does not")
