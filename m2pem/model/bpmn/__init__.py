"""Reads missions: BPMN 2.0 XML to the model of `m2pem.model.elements`.

Everything that is wrong with a file is found at once. See docs/missions.md for what is read.
"""

from pathlib import Path

from m2pem.errors import MissionError
from m2pem.findings import Finding, Severity, has_errors
from m2pem.model.bpmn.calls import resolve_calls
from m2pem.model.bpmn.collaboration import check_collaborations
from m2pem.model.bpmn.compensation import link_compensation, note_compensation
from m2pem.model.bpmn.containers import MAX_DEPTH, read_process
from m2pem.model.bpmn.correlation import resolve_correlation
from m2pem.model.bpmn.data import resolve_data
from m2pem.model.bpmn.data_flow import resolve_data_flows
from m2pem.model.bpmn.graph import add_unreachable, check_graph
from m2pem.model.bpmn.link import link
from m2pem.model.bpmn.loop_data import join_default_signals, resolve_loops
from m2pem.model.bpmn.messages import resolve_messages
from m2pem.model.bpmn.names import BPMN, local
from m2pem.model.bpmn.prompts import resolve_prompts
from m2pem.model.bpmn.reading import Reading
from m2pem.model.bpmn.report import Report
from m2pem.model.bpmn.roots import read_roots
from m2pem.model.bpmn.rules import check_rules
from m2pem.model.bpmn.rules.registry import code
from m2pem.model.bpmn.xml import MAX_BYTES, Document, XmlError, parse_xml
from m2pem.model.elements import Mission

__all__ = ["MAX_BYTES", "MAX_DEPTH", "NO_BPMN_RULES", "parse_mission", "read_mission"]

NO_BPMN_RULES = frozenset(
    {"doctype", "encoding", "not-bpmn", "not-xml", "too-large", "unreadable-file"}
)
"""Rules of the findings that say that a file is no BPMN at all (`m2pem check`: exit 2)."""


def read_mission(path: str | Path) -> Mission:
    """Read a mission file.

    Raises:
        MissionError: the file cannot be read or executed; it carries every finding.
    """
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        finding = Finding(
            Severity.ERROR,
            file,
            0,
            "",
            "unreadable-file",
            f"cannot read the file: {error.strerror or error}",
            "name a BPMN 2.0 file",
            code("unreadable-file"),
        )
        raise MissionError(f"{file}: no mission", [finding]) from error
    return parse_mission(data, file)


def parse_mission(data: bytes, file: str) -> Mission:
    """Parse the bytes of a mission file; `file` is its name in findings.

    Raises:
        MissionError: it is no BPMN 2.0, or has something that m2pem cannot execute; it carries
            every finding, errors and warnings, by line.
    """
    try:
        document = parse_xml(data)
    except XmlError as error:
        finding = Finding(
            Severity.ERROR,
            file,
            error.line,
            "",
            error.rule,
            error.message,
            error.remedy,
            code(error.rule),
        )
        raise MissionError(f"{file}: no BPMN 2.0 file", [finding]) from None
    report = Report(file, document.line)
    if document.root.tag != BPMN + "definitions":
        _not_bpmn(report, document)
        raise MissionError(f"{file}: no BPMN 2.0 file", report.findings)
    mission = _read(report, document, data)
    if mission is None:
        count = sum(finding.severity is Severity.ERROR for finding in report.findings)
        problems = "1 problem" if count == 1 else f"{count} problems"
        raise MissionError(f"{file}: the mission has {problems}", report.sorted())
    return mission


def _not_bpmn(report: Report, document: Document) -> None:
    tag = document.root.tag
    namespace = tag.rpartition("}")[0].removeprefix("{") or "none"
    report.error(
        document.root,
        document.root.get("id", ""),
        "not-bpmn",
        f"the file's root is '{local(tag)}' of the namespace {namespace}, not BPMN 2.0's "
        "'definitions'",
        f'export it as BPMN 2.0: xmlns="{BPMN[1:-1]}"',
    )


def _read(report: Report, document: Document, data: bytes) -> Mission | None:
    reading = Reading(report)
    processes = read_roots(reading, document.root)
    for element in processes:
        read_process(reading, element)
    if not processes:
        report.error(
            document.root,
            document.root.get("id", ""),
            "no-process",
            "the file has no process",
            "draw a process with a start event",
        )
    resolve_data(reading)
    resolve_loops(reading)
    resolve_data_flows(reading)
    resolve_prompts(reading)
    resolve_calls(reading)
    note_compensation(reading)
    elements = link(reading)
    link_compensation(reading)
    join_default_signals(reading)
    resolve_messages(reading)
    correlation_properties = resolve_correlation(reading)
    check_collaborations(reading, elements)
    check_graph(reading)
    check_rules(document.root, report, data)
    if has_errors(report.findings):
        add_unreachable(reading)
        return None
    return Mission(
        file=report.file,
        source=data,
        processes=tuple(reading.processes),
        nodes=tuple(reading.nodes),
        flows=tuple(ends.flow for ends in reading.flows),
        signals=reading.signals,
        messages=reading.messages,
        errors=reading.errors,
        escalations=reading.escalations,
        participants=tuple(reading.participants),
        message_flows=tuple(flow for flow, _ in reading.message_flows),
        lanes=tuple(reading.lanes),
        warnings=report.sorted(),
        elements=elements,
        associated=frozenset(reading.written_keys),
        correlation_properties=correlation_properties,
        data_stores=frozenset(reading.data_key(store) for store in reading.data_stores),
    )
