"""Fixtures of the web page's tests: real servers on 127.0.0.1."""

import pytest

pytest.register_assert_rewrite("web_world")

from web_world import world  # noqa: E402  # after its assertions are rewritten

__all__ = ["world"]
