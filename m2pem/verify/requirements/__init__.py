"""Requirements of a mission's author: formulas and patterns, in the mission's file or
a spec file.
"""

from m2pem.verify.requirements.collection import assumptions_given as assumptions_given
from m2pem.verify.requirements.collection import begins_all_pools as begins_all_pools
from m2pem.verify.requirements.collection import collect as collect
from m2pem.verify.requirements.collection import parse_spec as parse_spec
from m2pem.verify.requirements.collection import read_assumptions as read_assumptions
from m2pem.verify.requirements.collection import (
    read_mission_requirements as read_mission_requirements,
)
from m2pem.verify.requirements.collection import read_spec as read_spec
from m2pem.verify.requirements.names import Names as Names
from m2pem.verify.requirements.requirement import Requirement as Requirement
from m2pem.verify.requirements.requirement import RequirementsError as RequirementsError
