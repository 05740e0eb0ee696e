"""Draws what is found in each broken mission: `python -m tools.broken_mission_pictures`."""

from hashlib import sha256

from m2pem.executive.loading import load_source
from m2pem.plugins import PluginManager
from m2pem.verify.check import check
from m2pem.verify.report.findings import findings_of
from m2pem.verify.report.picture import pictures
from m2pem.verify.translate.options import Options
from tests.broken.expected import EXPECTED, Expected


def drawn(expected: Expected) -> str:
    """The picture of one: its first violation of what is to be found."""
    mission = load_source(str(expected.mission))
    plugins = PluginManager()
    writes = {name: tuple(plugins.service(name)().writes) for name in plugins.services()}
    findings = findings_of(mission, check(mission, options=Options(service_writes=writes)))
    violation = next(each for each in findings.violations if each.answer.property == expected.asked)
    hashed = sha256(expected.mission.read_bytes()).hexdigest()
    about = f"Drawn from {expected.mission.name}, SHA-256 {hashed}"
    return pictures(findings, violation, about=about)[""]


if __name__ == "__main__":
    for each in EXPECTED:
        each.picture.write_text(drawn(each), encoding="utf-8")
