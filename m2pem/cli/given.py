"""The files that a command is given beside its mission: a fleet, answers.

What reads a kind of file takes a while to load, and is loaded when there is one.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from m2pem.cli.options import MADE_UP

if TYPE_CHECKING:
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission
    from m2pem.rehearsal.answers import Answers


def get_fleet(name: str, mission: "Mission") -> "Fleet":
    """The fleet of a file, or one that is made up for the mission.

    Raises:
        FleetError: with every finding.
    """
    if name == MADE_UP:
        from m2pem.fleet.madeup import fleet_for

        return fleet_for(mission)
    from m2pem.fleet.fleet_file import load_fleet

    return load_fleet(name)


def get_answers(file: Path | None, mission: "Mission") -> "Answers | None":
    """The answers for a mission; None without a file.

    Raises:
        AnswersError: with every finding.
    """
    if file is None:
        return None
    from m2pem.errors import AnswersError
    from m2pem.findings import has_errors
    from m2pem.rehearsal.answers import check_answers, load_answers

    answers = load_answers(file)
    findings = check_answers(answers, mission)
    if has_errors(findings):
        raise AnswersError(f"{file} does not fit {mission.file}", findings)
    return answers
