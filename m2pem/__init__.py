"""m2pem: a mission executive for teams of unmanned vehicles.

A mission is a BPMN 2.0 diagram; m2pem checks it against a fleet, verifies it, rehearses it on a
virtual clock and executes it with tokens. From Python or a notebook (docs/python.md):

    mission = m2pem.load_mission("patrol.bpmn")
    fleet = m2pem.load_fleet("fleet.yaml")
    findings = m2pem.check(mission, fleet)
    proof = m2pem.verify(mission, fleet)
    result = m2pem.rehearse(mission, fleet, answers="answers.yaml")

On the command line: `m2pem --help`.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING

from m2pem.hookspecs import hookimpl as hookimpl
from m2pem.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from m2pem.errors import AnswersError as AnswersError
    from m2pem.errors import FleetError as FleetError
    from m2pem.errors import M2pemError as M2pemError
    from m2pem.errors import MissionError as MissionError
    from m2pem.errors import OperatorError as OperatorError
    from m2pem.fleet.fleet_file import load_fleet as load_fleet
    from m2pem.scripting.campaign import Campaign as Campaign
    from m2pem.scripting.campaign import campaign as campaign
    from m2pem.scripting.checking import CheckResult as CheckResult
    from m2pem.scripting.checking import check as check
    from m2pem.scripting.diagram import draw as draw
    from m2pem.scripting.executive import Executive as Executive
    from m2pem.scripting.executive import Prompt as Prompt
    from m2pem.scripting.executive import Run as Run
    from m2pem.scripting.rehearsal import rehearse as rehearse
    from m2pem.scripting.rehearsal import rehearse_async as rehearse_async
    from m2pem.scripting.run_result import RunResult as RunResult
    from m2pem.scripting.sources import load_mission as load_mission
    from m2pem.scripting.verification import VerificationResult as VerificationResult
    from m2pem.scripting.verification import verify as verify

__version__ = "0.2.0"

# Loaded when asked for: the parsers of files are most of what importing m2pem would cost.
_LAZY, __getattr__ = lazy_exports(__name__, __file__)

__all__ = ["__version__", "hookimpl"]
__all__ += list(_LAZY)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})


class _Package(ModuleType):
    """This package, whose attributes `campaign` and `verify` are the functions.

    The import of a module of the package `m2pem.verify` would set the attribute to that package.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if name in _LAZY and isinstance(value, ModuleType):
            return
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
