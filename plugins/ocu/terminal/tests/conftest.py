"""Fixtures of the terminal's tests."""

from terminal_world import world

__all__ = ["world"]
