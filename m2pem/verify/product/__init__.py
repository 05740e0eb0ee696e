"""Whether a formula holds of all runs of a system: the search for one that breaks it.

    verdict = check(system, formula)
    verdict.result                      # holds, violated, undecided
    verdict.run                         # how it is broken: steps, and steps that repeat for ever

The system is anything with a finite number of states (`LabelledSystem`).
"""

from m2pem.verify.product.check import check
from m2pem.verify.product.labelled import LabelledSystem
from m2pem.verify.product.verdict import Limits, Move, Progress, Result, Run, Stopped, Verdict

__all__ = [
    "LabelledSystem",
    "Limits",
    "Move",
    "Progress",
    "Result",
    "Run",
    "Stopped",
    "Verdict",
    "check",
]
