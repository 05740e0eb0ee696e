"""All requirements of a mission, wherever they stand."""

from pathlib import Path

from m2pem.findings import Finding, Severity
from m2pem.verify.requirements.mission_file import read_mission_requirements
from m2pem.verify.requirements.names import Names
from m2pem.verify.requirements.requirement import Requirement, RequirementsError
from m2pem.verify.requirements.spec_file import parse_spec, read_spec

TEXT_NAME = "requirements.yaml"
"""What findings call a text that did not come from a file."""


def gather(names: Names, spec: Path | bytes | None = None) -> list[Requirement]:
    """Those in the mission's file, then those of a spec file, or of its text.

    Raises:
        RequirementsError: tells all that is wrong in both, and ids that stand in both.
    """
    found: list[Requirement] = []
    findings: list[Finding] = []
    try:
        found += read_mission_requirements(names)
    except RequirementsError as error:
        findings += error.findings
    if spec is not None:
        known = {each.id for each in found}
        try:
            if isinstance(spec, bytes):
                of_spec = parse_spec(spec, TEXT_NAME, names)
            else:
                of_spec = read_spec(spec, names)
        except RequirementsError as error:
            findings += error.findings
            of_spec = []
        findings += [
            Finding(
                Severity.ERROR,
                each.file,
                each.line,
                each.id,
                "requirement-id",
                f"{names.mission.file} has a requirement of this id too",
                "give each its own",
            )
            for each in of_spec
            if each.id in known
        ]
        found += of_spec
    if findings:
        raise RequirementsError(findings)
    return found
