"""What other plugins may import, and that it costs nothing until they do."""

import subprocess
import sys

import m2pem_plugin_mavlink
import pytest

LISTED = """
import sys, m2pem_plugin_mavlink
print([name for name in ("pymavlink", "m2pem_plugin_mavlink.link") if name in sys.modules])
"""


def test_all_that_is_public_is_there() -> None:
    for name in m2pem_plugin_mavlink.__all__:
        assert getattr(m2pem_plugin_mavlink, name) is not None


def test_what_is_not_public_is_not() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = m2pem_plugin_mavlink.nonsense


def test_importing_the_plugin_loads_no_library() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LISTED], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
