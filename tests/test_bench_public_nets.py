"""Workflow nets as BPMN, and what is measured of them."""

from math import inf
from pathlib import Path

import pytest

from bench.verification.nets import UnfitError, bpmn_of
from bench.verification.public_nets import checked, main, nets

Arcs = list[tuple[str, str]]

FORKED: Arcs = [
    ("alpha", "begin"),
    ("begin", "left.used"),
    ("begin", "right.used"),
    ("left.used", "end"),
    ("right.used", "end"),
    ("end", "done"),
]
"""Two tasks side by side, joined."""
CHOSEN: Arcs = [
    ("alpha", "first"),
    ("alpha", "second"),
    ("first", "left.used"),
    ("second", "right.used"),
    ("left.used", "end"),
    ("right.used", "end"),
    ("end", "done"),
]
"""One of two tasks, and both are waited for."""
TWICE: Arcs = [
    ("alpha", "begin"),
    ("begin", "left.used"),
    ("begin", "right.used"),
    ("left.used", "one"),
    ("right.used", "other"),
    ("one", "done"),
    ("other", "done"),
]
"""Two tasks side by side, and an end that both come to."""


def pnml(arcs: Arcs) -> bytes:
    places = {"alpha", "done", "left.used", "right.used"}
    names = dict.fromkeys(name for arc in arcs for name in arc)
    marked = "<initialMarking><text>1</text></initialMarking>"
    nodes = "".join(
        f'<place id="{name}">{marked if name == "alpha" else ""}</place>'
        if name in places
        else f'<transition id="{name}"/>'
        for name in names
    )
    lines = "".join(f'<arc source="{one}" target="{other}"/>' for one, other in arcs)
    return f"<pnml><net>{nodes}{lines}</net></pnml>".encode()


@pytest.mark.parametrize(
    ("arcs", "sound"), [(FORKED, True), (CHOSEN, False), (TWICE, False)], ids=str
)
def test_a_net_has_the_verdict_of_its_soundness(arcs: Arcs, sound: bool) -> None:
    found = checked("A", "net", sound, bpmn_of(pnml(arcs)))
    assert found.agrees
    assert (found.first_s is None) is sound
    assert found.states > 1
    assert found.peak_mb > 1


@pytest.mark.parametrize(
    ("arcs", "why"),
    [
        ([*FORKED, ("end", "gone")], "transition gone"),
        ([*CHOSEN, ("left.used", "first")], "no free choice"),
        ([*FORKED, ("end", "alpha")], "begin with one token"),
    ],
)
def test_a_net_that_is_no_bpmn_is_refused(arcs: Arcs, why: str) -> None:
    with pytest.raises(UnfitError, match=why):
        bpmn_of(pnml(arcs))


def test_a_folder_is_measured_and_what_differs_is_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The peak is that of the process, which has run other tests before.
    monkeypatch.setattr("bench.verification.public_nets.MOST_MB", inf)
    folder = tmp_path / "ibm" / "lib_A" / "pnml"
    folder.mkdir(parents=True)
    (folder / "one.lola.pnml").write_bytes(pnml(FORKED))
    (folder / "two.lola.pnml").write_bytes(pnml(CHOSEN))
    rows = "ibm/lib_A/one.lola 9 1 3 0 50 1\nibm/lib_A/two.lola 9 1 3 0 50 {}\n"
    (tmp_path / "all-ibm.txt").write_text(rows.format(0))
    assert [each[:3] for each in nets(tmp_path)] == [("A", "one", True), ("A", "two", False)]
    results = tmp_path / "results"
    assert main([str(tmp_path), "--results", str(results)]) == 0
    assert "All bounds are kept." in (results / "public_nets.md").read_text()
    (tmp_path / "all-ibm.txt").write_text(rows.format(1))
    assert main([str(tmp_path), "--results", str(results)]) == 1
    assert "- two: violated" in capsys.readouterr().out
