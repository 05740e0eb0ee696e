"""The editor's patterns of requirements are those that `m2pem verify` has."""

import json
from pathlib import Path

from m2pem.verify.requirements.patterns import GROUPS

EDITOR = Path(__file__).parents[1] / "ui" / "src" / "editor" / "panels" / "requirements"


def test_the_editor_offers_the_patterns_that_there_are() -> None:
    known = [
        {
            "name": pattern.name,
            "group": group,
            "meaning": pattern.meaning,
            "scoped": pattern.scoped,
            "fair": pattern.fair,
            "steps": pattern.steps,
            "arguments": [
                {"name": each.name, "kind": each.kind.value, "required": each.required}
                for each in pattern.arguments
            ],
        }
        for group, patterns in GROUPS.items()
        for pattern in patterns
    ]
    assert json.loads((EDITOR / "patterns.json").read_text()) == known
