"""Runs that no executive drives any more: what they held, and how to go on."""

from collections.abc import Mapping
from dataclasses import dataclass

from m2pem.cli.journals import journal_to_read
from m2pem.cli.standing import Standing
from m2pem.journal import Journal, RunInfo


@dataclass(frozen=True, slots=True)
class Interrupted:
    """A run that was left without an end. `behaviors`: what it was doing, by vehicle or payload."""

    run: str
    mission: str
    behaviors: Mapping[str, str]

    def as_text(self) -> str:
        """For people: what may still move or stand held, and the commands to go on."""
        held = ", ".join(f"{name} ({behavior})" for name, behavior in self.behaviors.items())
        what = f"it has {held}, which may go on or stand held" if held else "it has no vehicle"
        return (
            f"{self.run} ({self.mission}) was interrupted, and no executive drives it: {what}; "
            f"`m2pem resume {self.run}` goes on with it, and `m2pem resume {self.run} --stop` "
            "stops it"
        )


async def interrupted_runs(url: str | None) -> list[Interrupted]:
    """The interrupted runs of a journal, by what its records say."""
    async with journal_to_read(url) as journal:
        return [
            await _interrupted(journal, line)
            for line in await journal.runs()
            if line.outcome is None and not line.driven and line.last_seq > 0
        ]


async def _interrupted(journal: Journal, line: RunInfo) -> Interrupted:
    standing = Standing(line)
    async for entry in journal.read(line.run):
        for record in entry.records:
            standing.take(record)
    return Interrupted(line.run, line.header.mission_name, standing.commanded())
