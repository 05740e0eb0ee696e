"""What plugin authors test with: contract suites, fakes, scenarios, and an executive to run them.

`from m2pem.testing import ArbiterContract`: subclass it, override two fixtures, and inherit all its
tests. It is a plugin of pytest, too, which needs no configuration (`m2pem.testing.plugin`).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from m2pem.testing.contracts.arbiter import ArbiterCase, ArbiterContract
    from m2pem.testing.contracts.journal import JournalContract
    from m2pem.testing.contracts.ocu import OcuContract, Operator
    from m2pem.testing.contracts.service import ServiceCase, ServiceContract
    from m2pem.testing.fakes import FakeArbiter
    from m2pem.testing.stage import Played, play, stage

__all__ = [
    "ArbiterCase",
    "ArbiterContract",
    "FakeArbiter",
    "JournalContract",
    "OcuContract",
    "Operator",
    "Played",
    "ServiceCase",
    "ServiceContract",
    "play",
    "stage",
]

# Loaded when asked for: pytest imports this package wherever m2pem is installed, and rewrites the
# assertions of a contract only if nobody imported it before.
_LAZY = {
    "ArbiterCase": "contracts.arbiter",
    "ArbiterContract": "contracts.arbiter",
    "FakeArbiter": "fakes",
    "JournalContract": "contracts.journal",
    "OcuContract": "contracts.ocu",
    "Operator": "contracts.ocu",
    "Played": "stage",
    "ServiceCase": "contracts.service",
    "ServiceContract": "contracts.service",
    "play": "stage",
    "stage": "stage",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
