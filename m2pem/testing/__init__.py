"""Tests for authors of plugins: contracts, a fake arbiter, scenarios, and an executive to run them.

`from m2pem.testing import ArbiterContract`: subclass it, override two fixtures, and inherit all its
tests. A plugin of pytest (`m2pem.testing.plugin`) is loaded without configuration.
"""

from typing import TYPE_CHECKING

from m2pem.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from m2pem.testing.contracts.arbiter import ArbiterCase as ArbiterCase
    from m2pem.testing.contracts.arbiter import ArbiterContract as ArbiterContract
    from m2pem.testing.contracts.journal import JournalContract as JournalContract
    from m2pem.testing.contracts.ocu import OcuContract as OcuContract
    from m2pem.testing.contracts.ocu import Operator as Operator
    from m2pem.testing.contracts.service import ServiceCase as ServiceCase
    from m2pem.testing.contracts.service import ServiceContract as ServiceContract
    from m2pem.testing.faces import serve_face as serve_face
    from m2pem.testing.fake_arbiter import FakeArbiter as FakeArbiter
    from m2pem.testing.harness import MissionResult as MissionResult
    from m2pem.testing.harness import run_executive as run_executive
    from m2pem.testing.harness import run_mission as run_mission

# Imported on first use: pytest imports this package wherever m2pem is installed, and rewrites the
# assertions of a contract only if it was not imported before.
_LAZY, __getattr__ = lazy_exports(__name__, __file__)

__all__ = list(_LAZY)
