"""What a table of appliers is: by kind of record, what it does to the state."""

from collections.abc import Callable
from typing import Any, TypeAlias

from m2pem.engine.state import RunState

Appliers: TypeAlias = dict[type, Callable[[RunState, Any], None]]
