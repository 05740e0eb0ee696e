"""What authors require of their missions: formulas and patterns, in the mission or beside it."""

from m2pem.verify.requirements.gathering import gather
from m2pem.verify.requirements.mission_file import read_mission_requirements
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.requirement import Requirement, RequirementsError
from m2pem.verify.requirements.spec_file import parse_spec, read_spec

__all__ = [
    "Names",
    "Requirement",
    "RequirementsError",
    "gather",
    "parse_spec",
    "read_mission_requirements",
    "read_spec",
]
