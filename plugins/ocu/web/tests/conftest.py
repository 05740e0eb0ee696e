"""Fixtures of the web page's tests: real servers on 127.0.0.1, and a real browser."""

import pytest

for module in ("web_world", "web_desk", "web_browsing", "web_running", "web_drawing"):
    pytest.register_assert_rewrite(module)

from web_desk import chromium, desk, executive, profile  # noqa: E402  # after that
from web_world import world  # noqa: E402

__all__ = ["chromium", "desk", "executive", "profile", "world"]
