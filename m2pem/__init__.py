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
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from m2pem.hookspecs import hookimpl

if TYPE_CHECKING:
    from m2pem.errors import AnswersError, FleetError, M2pemError, MissionError, OperatorError
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.scripting.campaign import Campaign, campaign
    from m2pem.scripting.checking import CheckResult, check
    from m2pem.scripting.diagram import draw
    from m2pem.scripting.executive import Executive, Prompt, Run
    from m2pem.scripting.rehearsal import rehearse, rehearse_async
    from m2pem.scripting.run_result import RunResult
    from m2pem.scripting.sources import load_mission
    from m2pem.scripting.verification import VerificationResult, verify

__version__ = "0.2.0"

__all__ = [
    "AnswersError",
    "Campaign",
    "CheckResult",
    "Executive",
    "FleetError",
    "M2pemError",
    "MissionError",
    "OperatorError",
    "Prompt",
    "Run",
    "RunResult",
    "VerificationResult",
    "__version__",
    "campaign",
    "check",
    "draw",
    "hookimpl",
    "load_fleet",
    "load_mission",
    "rehearse",
    "rehearse_async",
    "verify",
]

# Loaded when asked for: the parsers of files are most of what importing m2pem would cost.
_MODULES = {
    "m2pem.errors": "AnswersError FleetError M2pemError MissionError OperatorError",
    "m2pem.fleet.fleet_file": "load_fleet",
    "m2pem.scripting.campaign": "Campaign campaign",
    "m2pem.scripting.checking": "CheckResult check",
    "m2pem.scripting.diagram": "draw",
    "m2pem.scripting.executive": "Executive Prompt Run",
    "m2pem.scripting.rehearsal": "rehearse rehearse_async",
    "m2pem.scripting.run_result": "RunResult",
    "m2pem.scripting.sources": "load_mission",
    "m2pem.scripting.verification": "VerificationResult verify",
}
_LAZY = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_LAZY[name]), name)
    globals()[name] = value
    return value


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
