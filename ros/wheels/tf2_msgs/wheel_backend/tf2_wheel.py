"""Builds this package with the backend of ros/m2pem_interfaces, which stays in one place (PEP 517).

A `backend-path` may not lead out of the source tree, so this stands in it and goes there.
"""

import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent
BACKEND = PACKAGE.parents[1] / "m2pem_interfaces" / "wheel_backend"

sys.path.insert(0, str(BACKEND))

import rosidl_wheel  # noqa: E402  # it is found only now

rosidl_wheel.PACKAGE = PACKAGE

build_wheel = rosidl_wheel.build_wheel
