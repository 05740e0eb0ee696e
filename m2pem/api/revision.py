"""What a revision of a running mission would do, as operators see it before it is done; and the
versions that a run has had."""

from dataclasses import dataclass

from m2pem.api.runs import IncidentPreview, RunId
from m2pem.findings import Finding, Severity


@dataclass(frozen=True, slots=True)
class RunVersion:
    """A version of its mission that a run has, or has had, from record `seq` on.

    `version`: of the files; the same files have the same one. `mission`: the file's name. `at_us`:
    microseconds since the Unix epoch, by the executive's clock. `by`: who began the run, or revised
    it. `shared_with`: other runs under way that have this version now.
    """

    version: str
    mission: str
    seq: int
    at_us: int
    by: str
    shared_with: tuple[RunId, ...] = ()


@dataclass(frozen=True, slots=True)
class RevisionEffect:
    """One thing that a revision does. `kind`: moves, ends, restarts, adjusts, goes on, arms,
    rearms, disarms or changes. `element`: its id. `token`: the id of a token; 0: it is no token's.
    `text`: a sentence for people. `resources`: the vehicles and payloads that the token commands
    now."""

    kind: str
    element: str
    token: int
    text: str
    resources: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RevisionRefusal:
    """Why a revision cannot be. `candidates`: where the token can go instead, by the ids of
    elements and sequence flows of the new version; the nearest first. `labels`: what operators
    call each of them. `resources`: the vehicles and payloads that the token commands now.
    `can_end`: the token can end instead."""

    element: str
    token: int
    text: str
    candidates: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    resources: tuple[str, ...] = ()
    can_end: bool = False


@dataclass(frozen=True, slots=True)
class RevisionPreview:
    """The plan of a revision, for the run as it is now.

    `plan`: its digest, which `MissionControl.revise` takes. `version`, `previous`: of the files, as
    in record `MissionRevised`. `changes`: what differs between the versions, as sentences.
    `findings`: those of `m2pem check` about the new version; with errors, it cannot be used.
    `outlook`: whether the mission completes after it, explored from the run's present state; None:
    that was not explored, as the revision cannot be. `approval`: who must approve the new version
    before; "": that is not needed. `busy`: which vehicles and payloads new and changed tasks name
    that other runs or operators have now, and what happens to the task then, as sentences.
    """

    run: RunId
    mission: str
    plan: str
    version: str
    previous: str
    changes: tuple[str, ...] = ()
    effects: tuple[RevisionEffect, ...] = ()
    refusals: tuple[RevisionRefusal, ...] = ()
    findings: tuple[Finding, ...] = ()
    outlook: IncidentPreview | None = None
    approval: str = ""
    busy: tuple[str, ...] = ()

    @property
    def is_possible(self) -> bool:
        """Whether nothing speaks against it but what an operator may confirm."""
        errors = any(each.severity is Severity.ERROR for each in self.findings)
        return not (self.refusals or errors or self.approval)

    def __str__(self) -> str:
        lines = [f"{self.run}: from version {self.previous[:12]} to {self.version[:12]}"]
        lines += [f"  {each}" for each in self.changes or ("no element differs",)]
        if not self.refusals:
            lines.append("what becomes of the run:" if self.effects else "all that is active stays")
        lines += [f"  {each.kind}: {each.text}" for each in self.effects]
        lines += [f"  busy: {each}" for each in self.busy]
        lines += [str(each) for each in self.findings]
        lines += [f"refused: {each.text}" for each in self.refusals]
        if self.approval:
            lines.append(f"not approved: {self.approval}")
        if self.outlook is not None:
            lines.append(f"after it, {self.outlook}")
        return "\n".join(lines)
