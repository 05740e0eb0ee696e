"""Requirements of a mission's author: formulas and patterns, in the mission's file or
a spec file.
"""

from m2pem.verify.requirements.collection import (
    collect,
    parse_spec,
    read_mission_requirements,
    read_spec,
)
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.requirement import Requirement, RequirementsError

__all__ = [
    "Names",
    "Requirement",
    "RequirementsError",
    "collect",
    "parse_spec",
    "read_mission_requirements",
    "read_spec",
]
