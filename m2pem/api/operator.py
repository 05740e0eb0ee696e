"""Who asks: the name that the journal keeps of an operator."""

import getpass
import socket


def operator_name() -> str:
    """The user and the host of this process, as "anna@gcs1"."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "operator"
    return f"{user}@{socket.gethostname().partition('.')[0]}"
