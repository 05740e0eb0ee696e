"""The command line: one module a command, loaded when it is called (docs/cli.md)."""


def main() -> None:
    """Run the command line and exit with its status."""
    from m2pem.cli.group import run_command_line

    raise SystemExit(run_command_line())
