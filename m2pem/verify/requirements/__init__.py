"""Requirements of a mission's author: formulas and patterns, in the mission's file or
a spec file.
"""

from m2pem.verify.requirements.collection import (
    assumptions_given,
    begins_all_pools,
    collect,
    parse_spec,
    read_assumptions,
    read_mission_requirements,
    read_spec,
)
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.requirement import Requirement, RequirementsError

__all__ = [
    "Names",
    "Requirement",
    "RequirementsError",
    "assumptions_given",
    "begins_all_pools",
    "collect",
    "parse_spec",
    "read_assumptions",
    "read_mission_requirements",
    "read_spec",
]
