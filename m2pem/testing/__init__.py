"""Tests for authors of plugins: contracts, a fake arbiter, scenarios, and an executive to run them.

`from m2pem.testing import ArbiterContract`: subclass it, override two fixtures, and inherit all its
tests. A plugin of pytest (`m2pem.testing.plugin`) is loaded without configuration.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem.testing.contracts.arbiter import ArbiterCase, ArbiterContract
    from m2pem.testing.contracts.journal import JournalContract
    from m2pem.testing.contracts.ocu import OcuContract, Operator
    from m2pem.testing.contracts.service import ServiceCase, ServiceContract
    from m2pem.testing.faces import serve_face
    from m2pem.testing.fake_arbiter import FakeArbiter
    from m2pem.testing.harness import MissionResult, run_executive, run_mission

__all__ = [
    "ArbiterCase",
    "ArbiterContract",
    "FakeArbiter",
    "JournalContract",
    "OcuContract",
    "Operator",
    "MissionResult",
    "ServiceCase",
    "ServiceContract",
    "run_mission",
    "run_executive",
    "serve_face",
]

# Imported on first use: pytest imports this package wherever m2pem is installed, and rewrites the
# assertions of a contract only if it was not imported before.
_LAZY = {
    "ArbiterCase": "contracts.arbiter",
    "ArbiterContract": "contracts.arbiter",
    "FakeArbiter": "fake_arbiter",
    "JournalContract": "contracts.journal",
    "OcuContract": "contracts.ocu",
    "Operator": "contracts.ocu",
    "MissionResult": "harness",
    "ServiceCase": "contracts.service",
    "ServiceContract": "contracts.service",
    "run_mission": "harness",
    "run_executive": "harness",
    "serve_face": "faces",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
