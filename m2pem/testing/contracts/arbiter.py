"""What every arbiter must keep to, as tests to inherit."""

from m2pem.testing.contracts.arbiter_behaviors import ArbiterBehaviors
from m2pem.testing.contracts.arbiter_case import ArbiterCase, CutLink, Effects, MakeArbiter
from m2pem.testing.contracts.arbiter_links import ArbiterLinks

__all__ = ["ArbiterCase", "ArbiterContract", "CutLink", "Effects", "MakeArbiter"]


class ArbiterContract(ArbiterBehaviors, ArbiterLinks):
    """Override the fixtures `make_arbiter` and `case`; `cut_link` and `effects` too, if you can.

    Say in `unsupported` what the arbiter does not support, and why, by the subjects of `subjects`:

        class TestRover(ArbiterContract):
            unsupported = {"hold": "the base has no brake"}

    Its tests are then skipped, and the report at the end lists it. Everything else must be kept.
    """
