"""Reads missions: BPMN 2.0 XML to the model of `m2pem.mission.elements`.

Everything that is wrong with a file is found at once. See docs/missions.md for what is read.
"""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from m2pem.bpmn import garbage_collection
from m2pem.bpmn.activities import resolve_calls
from m2pem.bpmn.collaboration import check_collaborations, resolve_correlation, resolve_messages
from m2pem.bpmn.compensation import link_compensation, note_compensation
from m2pem.bpmn.context import ReadingContext
from m2pem.bpmn.data import resolve_data, resolve_data_flows
from m2pem.bpmn.files import Files, Part, find_called, merge, open_part
from m2pem.bpmn.loops import join_default_signals, resolve_loops
from m2pem.bpmn.rules.files import DOCTYPE, ENCODING, NOT_BPMN, NOT_XML, TOO_LARGE, UNREADABLE_FILE
from m2pem.bpmn.rules.registry import check_rules
from m2pem.bpmn.rules.subprocesses import NO_PROCESS
from m2pem.bpmn.search_path import SearchPath
from m2pem.bpmn.sequence_flows import add_unreachable, check_graph, link
from m2pem.bpmn.subprocesses import MAX_DEPTH
from m2pem.bpmn.tasks import resolve_prompts
from m2pem.bpmn.xml import max_bytes
from m2pem.errors import MissionError
from m2pem.findings import Severity, has_errors
from m2pem.mission.library import Library
from m2pem.mission.mission import Mission

__all__ = [
    "MAX_DEPTH",
    "NO_BPMN_RULES",
    "parse_mission",
    "read_mission",
    "read_partly",
]

NO_BPMN_RULES = frozenset(
    rule.slug for rule in (DOCTYPE, ENCODING, NOT_BPMN, NOT_XML, TOO_LARGE, UNREADABLE_FILE)
)
"""Rules of the findings that say that a file is no BPMN at all (`m2pem check`: exit 2)."""


def read_mission(path: str | Path, search_path: Iterable[Path | str] = ()) -> Mission:
    """Read a mission file, and the files that it calls into or imports.

    `search_path`: folders to look in for what it calls, after its own (docs/missions.md).

    Raises:
        MissionError: the file cannot be read or executed; it carries every finding.
    """
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(max_bytes() + 1)
    except OSError as error:
        message = f"cannot read the file: {error.strerror or error}"
        finding = UNREADABLE_FILE.finding(file, 0, "", message)
        raise MissionError(f"{file}: no mission", [finding]) from error
    return parse_mission(data, file, SearchPath(Path(path), map(Path, search_path)))


def parse_mission(
    data: bytes, file: str, library: Library | None = None, *, accepted: bool = False
) -> Mission:
    """Parse the bytes of a mission file; `file` is its name in findings.

    `library` has the other files that it calls into or imports; without one there are none.
    `accepted`: an earlier release has begun a run of it. What is an error since is read as that
    release read it, and is an error among the mission's `warnings`.

    Raises:
        MissionError: it is no BPMN 2.0, or has something that m2pem cannot execute; it carries
            every finding, errors and warnings, by file and line.
    """
    with garbage_collection.paused():
        return _parse(data, file, library, accepted=accepted)


def read_partly(data: bytes, file: str, library: Library | None = None) -> ReadingContext:
    """Read as much of a mission's own file as can be read, whatever is wrong with it.

    Raises:
        MissionError: it is no BPMN 2.0 at all.
    """
    with garbage_collection.paused():
        files = Files(open_part(data, file), library)
        find_called(files)
        for part in [each for each in files.parts if each.is_read]:
            _resolve(part)
        return files.main.context


def _parse(data: bytes, file: str, library: Library | None, *, accepted: bool) -> Mission:
    files = Files(open_part(data, file), library)
    reached = find_called(files)
    parts = [part for part in files.parts if part.is_read]
    for part in parts:
        _resolve(part)
    findings = [each for part in files.parts for each in part.context.findings.sorted()]
    if has_errors([*findings, *files.findings]):
        if accepted:
            with suppress(Exception):  # merging relies on what is no error in a mission
                return merge(files, reached)
        for part in parts:
            add_unreachable(part.context)
        raise _refusal(file, files)
    return merge(files, reached)


def _refusal(file: str, files: Files) -> MissionError:
    findings = [each for part in files.parts for each in part.context.findings.sorted()]
    findings += files.findings
    count = sum(finding.severity is Severity.ERROR for finding in findings)
    problems = "1 problem" if count == 1 else f"{count} problems"
    return MissionError(f"{file}: the mission has {problems}", findings)


def _resolve(part: Part) -> None:
    """Resolve references within the file, and check the elements that result."""
    context = part.context
    if not context.processes:
        root = part.document.root
        context.findings.error(root, root.get("id", ""), NO_PROCESS)
    resolve_data(context)
    resolve_loops(context)
    resolve_data_flows(context)
    resolve_prompts(context)
    resolve_calls(context)
    note_compensation(context)
    link(context)
    link_compensation(context)
    join_default_signals(context)
    resolve_messages(context)
    part.correlation = resolve_correlation(context)
    check_collaborations(context)
    check_graph(context)
    check_rules(part.document.root, context.findings, part.data)
