"""What every arbiter must keep to, as tests to inherit."""

from m2pem.testing.contracts.arbiter_behaviors import ArbiterBehaviors
from m2pem.testing.contracts.arbiter_case import ArbiterCase, CutLink, MakeArbiter
from m2pem.testing.contracts.arbiter_links import ArbiterLinks

__all__ = ["ArbiterCase", "ArbiterContract", "CutLink", "MakeArbiter"]


class ArbiterContract(ArbiterBehaviors, ArbiterLinks):
    """Override `make_arbiter` and `case`; `cut_link` too, unless there is no link to cut; and
    `run`, if the arbiter cannot live in virtual time. What is not supported is skipped, and so
    stands in the test report.
    """
