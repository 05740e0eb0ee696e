"""What the environment says of this unit: its namespace."""

import os
import re
from collections.abc import Mapping

from m2pem.errors import PluginError

NAMESPACE = "M2PEM_ROS_NAMESPACE"
"""Where services and topics are: /m2pem, unless this variable says otherwise."""

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
