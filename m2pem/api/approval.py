"""Who has approved a mission, and who must before it may start."""

from dataclasses import dataclass
from datetime import UTC, datetime

from m2pem.units import US_PER_S


@dataclass(frozen=True, slots=True)
class GivenApproval:
    """A person has approved a mission, at microseconds since the Unix epoch."""

    by: str
    at_us: int

    def __str__(self) -> str:
        when = datetime.fromtimestamp(self.at_us / US_PER_S, UTC)
        return f"{self.by} ({when:%Y-%m-%d %H:%M} UTC)"


@dataclass(frozen=True, slots=True)
class EarlierApproval:
    """A person has approved an earlier content of a mission. `changed`: its files and drawings that
    are other now, or are in one of both contents. `file`: the SHA-256 of the mission's file
    then."""

    by: str
    at_us: int
    changed: tuple[str, ...]
    file: str = ""

    def __str__(self) -> str:
        given = GivenApproval(self.by, self.at_us)
        return f"{given} approved it before these changed: {', '.join(self.changed)}"


@dataclass(frozen=True, slots=True)
class MissionApproval:
    """How a mission stands with a fleet.

    `mission`: the name of its file; `digest`: of its content. `persons`: how many others than its
    editors the fleet asks for; 0: none. `role`: the role of operators who may approve; "": all.
    `editors`: who has made its files and drawings what they are; `editor_unknown`: one of
    them was made by a person who is not known, so that one person more must approve.
    `approvals`: those that count. `not_counted`: those of its editors. `earlier`: those of earlier
    contents.
    """

    mission: str
    digest: str
    persons: int = 0
    role: str = ""
    editors: tuple[str, ...] = ()
    editor_unknown: bool = False
    approvals: tuple[GivenApproval, ...] = ()
    not_counted: tuple[GivenApproval, ...] = ()
    earlier: tuple[EarlierApproval, ...] = ()

    @property
    def needed(self) -> int:
        """How many approvals must count before it may start."""
        return self.persons + 1 if self.persons and self.editor_unknown else self.persons

    @property
    def missing(self) -> int:
        """How many more must approve."""
        return max(0, self.needed - len(self.approvals))

    @property
    def may_start(self) -> bool:
        """Whether no more persons must approve it."""
        return self.missing == 0

    def who(self) -> str:
        """Return who must approve it."""
        who = f"with the role {self.role!r} " if self.role else ""
        but = f"other than {', '.join(self.editors)}, who edited it" if self.editors else ""
        if self.editor_unknown:
            unknown = "one more than the fleet says, as it is not known who edited "
            unknown += "all of it" if self.editors else "it"
            but = f"{but} ({unknown})" if but else f"({unknown})"
        number = f"{self.missing} more " if self.approvals else f"{self.missing} "
        persons = "person" if self.missing == 1 else "persons"
        return " ".join(f"{number}{persons} {who}{but}".split())

    def __str__(self) -> str:
        if not self.persons:
            return f"{self.mission} needs no approval"
        given = ", ".join(map(str, self.approvals))
        said = f"{self.mission} (content {self.digest[:8]}) is "
        said += "approved" if self.may_start else "not approved"
        if given:
            said += f": approved by {given}" if self.may_start else f": {given} approved it"
        if not self.may_start:
            said += f"{';' if given else ':'} {self.who()} must approve it"
        lines = [said, *map(str, self.earlier)]
        lines += [f"{each} edited it: that approval does not count" for each in self.not_counted]
        return "\n".join(lines)
