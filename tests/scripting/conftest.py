"""The command line in this process, to compare with."""

from tests.cli.conftest import invoke

__all__ = ["invoke"]
