"""Fixtures of the tests in a real browser: a real server, with simulated vehicles."""

import pytest

pytest.register_assert_rewrite("browser_world")

from browser_world import browsing, served, server  # noqa: E402  # after its assertions are rewritten

__all__ = ["browsing", "served", "server"]
