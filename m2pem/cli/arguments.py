"""The answers file that a command line names."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from m2pem.mission.mission import Mission
    from m2pem.rehearsal.answers import Answers


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
