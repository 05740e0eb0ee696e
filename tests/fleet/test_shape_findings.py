from pathlib import Path

import pytest
from pydantic import ValidationError

from m2pem.fleet.fleet_schema import FleetModel
from m2pem.fleet.shape_findings import note_shape_findings
from m2pem.fleet.yaml_source import read_yaml


def findings(folder: Path, text: str) -> list[tuple[int, str, str, str, str]]:
    path = folder / "fleet.yaml"
    path.write_text(text)
    source = read_yaml(path)
    with pytest.raises(ValidationError) as refused:
        FleetModel.model_validate(source.data)
    note_shape_findings(source, refused.value, FleetModel)
    return [(f.line, f.element, f.rule, f.message, f.remedy) for f in source.findings]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "version: 1\nvehicels: {}\n",
            (2, "vehicels", "unknown-key", "unknown key 'vehicels'", "did you mean 'vehicles'?"),
        ),
        (
            "version: 1\nvehicles:\n  a: {domain: air, arbiter: s, payloads: {p: {\n  xyz: 1}}}\n",
            (
                4,
                "vehicles.a.payloads.p.xyz",
                "unknown-key",
                "unknown key 'xyz'",
                "known keys: arbiter, connection, behaviors, detector",
            ),
        ),
        (
            "version: 1\norigin: {lat: 1, lon: 2, height: 3}\n",
            (
                2,
                "origin.height",
                "unknown-key",
                "unknown key 'height'",
                "known keys: lat, lon, alt",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a:\n    domain: air\n",
            (3, "vehicles.a.arbiter", "missing-key", "'arbiter' is missing", ""),
        ),
        (
            "version: 1\nvehicles:\n  a:\n    arbiter: sim\n    domain: grond\n",
            (
                5,
                "vehicles.a.domain",
                "bad-value",
                "'grond' is not one of 'ground', 'air', 'surface' or 'subsurface'",
                "did you mean 'ground'?",
            ),
        ),
        ("version: 2\n", (1, "version", "bad-value", "2 is not one of 1", "")),
        (
            "version: 1\nvehicles: [a]\n",
            (
                2,
                "vehicles",
                "bad-value",
                "['a'] is not a map",
                "write 'key: value' lines below it",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a: {domain: air, arbiter: sim, manned: yes}\n",
            (
                3,
                "vehicles.a.manned",
                "bad-value",
                "'yes' is neither true nor false",
                "YAML 1.2 reads only true and false as such",
            ),
        ),
        (
            "version: 1\nvehicles:\n  a b: {domain: air, arbiter: sim}\n",
            (
                3,
                "vehicles.a b",
                "bad-name",
                "'a b' is no name: it has white space or '/' in it, or is empty",
                "",
            ),
        ),
        (
            "version: 1\nmax_outage: 30 m\n",
            (
                2,
                "max_outage",
                "bad-value",
                "'30 m' is a distance, not a duration; a duration is written with s, ms, min, h",
                "",
            ),
        ),
        ("version: 1\nmax_outage: 0\n", (2, "max_outage", "bad-value", "0 is not above 0", "")),
        (
            "version: 1\norigin: {lat: 98, lon: 0}\n",
            (2, "origin.lat", "bad-value", "98 should be less than or equal to 90", ""),
        ),
        (
            "version: 1\nteams: {t: {members: []}}\n",
            (2, "teams.t.members", "bad-value", "[] is too short", "at least one is needed"),
        ),
    ],
)
def test_each_mistake_is_told_in_a_persons_words(
    tmp_path: Path, text: str, expected: tuple[int, str, str, str, str]
) -> None:
    assert findings(tmp_path, text) == [expected]


def test_a_long_value_is_cut_in_the_message(tmp_path: Path) -> None:
    ((_, _, _, message, _),) = findings(tmp_path, f"version: 1\nvehicles: {'x' * 500}\n")
    assert len(message) < 100
