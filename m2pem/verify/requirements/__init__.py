"""What authors require of their missions: formulas and patterns, in the mission or beside it."""

from m2pem.verify.requirements.collection import (
    gather,
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
    "gather",
    "parse_spec",
    "read_mission_requirements",
    "read_spec",
]
