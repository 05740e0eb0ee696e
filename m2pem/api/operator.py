"""Who asks: the name that the journal keeps of an operator."""

import getpass
import os
import socket

VARIABLE = "M2PEM_OPERATOR"
"""The environment variable for operators who share an account."""


def operator_name() -> str:
    """Return M2PEM_OPERATOR, else the user and the host of this process, as "anna@gcs1"."""
    if named := os.environ.get(VARIABLE, "").strip():
        return named
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "operator"
    return f"{user}@{socket.gethostname().partition('.')[0]}"
