"""The command line: one module a command, loaded when it is called (docs/cli.md)."""

import gc
import os
import signal

NEW_OBJECTS = 50_000
"""So many before Python looks for garbage in cycles, which records and tokens never are."""


def main() -> None:
    """Run the command line and exit with its status."""
    from m2pem.cli.group import run_command_line

    gc.set_threshold(NEW_OBJECTS)
    status = run_command_line()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(status))  # all is closed: this is how it ended
    gc.freeze()  # the memory goes with the process: Python need not look through a large mission
    raise SystemExit(status)
