"""The form for what happens in a rehearsal knows all that an answers file may say."""

import json
from pathlib import Path
from typing import get_args

from m2pem.rehearsal.answers_file import (
    AnswerEntry,
    AnswersModel,
    BehaviorEntry,
    ServiceEntry,
    TimedEntry,
)

PANEL = Path(__file__).parents[1] / "ui" / "src" / "editor" / "panels" / "run"


def test_the_form_has_the_sections_of_answers_files() -> None:
    known = {
        "sections": list(AnswersModel.model_fields),
        "answers": list(AnswerEntry.model_fields),
        "services": list(ServiceEntry.model_fields),
        "behaviors": list(BehaviorEntry.model_fields),
        "sends": list(TimedEntry.model_fields),
        "ends": list(get_args(BehaviorEntry.model_fields["end"].annotation)),
    }
    assert json.loads((PANEL / "answersFile.json").read_text()) == known
