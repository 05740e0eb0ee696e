"""The table of rounds: kill point x vehicles x journal."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.chaos.rounds import Round

COLUMNS = (
    *("kill point", "vehicles", "journal", "rounds", "kills"),
    *("as undisturbed", "asked", "requested", "begun", "faults"),
)


def as_table(played: "Sequence[Round]") -> str:
    """Return the table of rounds by their first kill that names the row.

    A round with several kills counts in the row of each point. `asked`: rounds in which an
    operator was asked what became of a behavior. `requested`, `begun`: behaviors, of the journal
    and as the vehicles noted.
    """
    found: dict[tuple[str, str, str], list[Round]] = {}
    for each in played:
        for point in dict.fromkeys(kill.point for kill in each.plan.kills):
            found.setdefault((point, each.plan.world, each.plan.journal), []).append(each)
    return text_table(COLUMNS, [_row(key, some) for key, some in sorted(found.items())])


def text_table(columns: Sequence[str], body: Sequence[Sequence[object]]) -> str:
    """Return a table in columns; the first three are names, the others numbers."""
    rows = [columns, *body]
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(columns))]
    return "\n".join(
        "  ".join(
            str(cell).ljust(width) if column < 3 else str(cell).rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _row(key: tuple[str, str, str], some: "Sequence[Round]") -> tuple[object, ...]:
    verdicts = [each.verdict for each in some]
    return (
        *key,
        len(some),
        sum(each.reached for each in some),
        sum(not each.faults and not each.asked for each in verdicts),
        sum(bool(each.asked) for each in verdicts),
        sum(each.requested for each in verdicts),
        sum(each.begun for each in verdicts),
        sum(bool(each.faults) for each in verdicts),
    )
