"""What the static check finds about one task."""

from dataclasses import dataclass, field

from m2pem.findings import Finding, Severity
from m2pem.mission.elements import Activity


@dataclass(frozen=True, slots=True)
class TaskFindings:
    """Collects the findings of one task; each says the task, its line, and the role if any."""

    file: str
    task: Activity
    found: list[Finding] = field(default_factory=list)

    def add(
        self,
        rule: str,
        message: str,
        remedy: str = "",
        *,
        line: int,
        role: str = "",
        severity: Severity = Severity.ERROR,
        place: tuple[float, float] | None = None,
    ) -> Finding:
        """Note a finding at `line` of the mission, once, and return it."""
        where = f"{self.task.id} (line {self.task.line})" + (f", role '{role}'" if role else "")
        finding = Finding(
            severity, self.file, line, self.task.id, rule, f"{where}: {message}", remedy, "", place
        )
        if finding not in self.found:
            self.found.append(finding)
        return finding
