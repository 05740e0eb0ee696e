"""Event logs for process mining: XES (IEEE 1849), a trace for each run.

Events are those of activities, by the extensions concept, time, lifecycle and organizational. In
the lifecycle, an activity that fails or is interrupted ends with `ate_abort`, one whose run ends
before with `pi_abort`; a pause of the run suspends all that are under way.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from lxml import etree

from m2pem.api import ExportedRun, ExportOptions
from m2pem.api import records as r
from m2pem.mission.elements import Activity
from m2pem_plugin_recorder.export.states import iso_time

_NAMESPACE = "http://www.xes-standard.org/"
_PREFIXES: dict[Any, str] = {None: _NAMESPACE}
_EXTENSIONS = (
    ("Concept", "concept", "http://www.xes-standard.org/concept.xesext"),
    ("Time", "time", "http://www.xes-standard.org/time.xesext"),
    ("Lifecycle", "lifecycle", "http://www.xes-standard.org/lifecycle.xesext"),
    ("Organizational", "org", "http://www.xes-standard.org/org.xesext"),
)
_TRANSITIONS = {
    r.TokenOutcome.COMPLETED: "complete",
    r.TokenOutcome.FAILED: "ate_abort",
    r.TokenOutcome.INTERRUPTED: "ate_abort",
    r.TokenOutcome.TERMINATED: "pi_abort",
}
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(slots=True, eq=False)
class Event:
    """An event of an activity. `resource`: who did it, an operator or vehicles."""

    at_us: int
    element: str
    transition: str
    instance: str
    resource: str = ""
    role: str = ""
    code: str = ""


@dataclass(slots=True, eq=False)
class _UnderWay:
    """A token on an activity, with its events so far."""

    element: str
    instance: str
    events: list[Event] = field(default_factory=list)
    resource: str = ""
    role: str = ""
    code: str = ""


def events_of(run: ExportedRun) -> list[Event]:
    """Return the events of a run's activities, in their order."""
    elements = run.mission.elements if run.mission is not None else {}
    events: list[Event] = []
    under_way: dict[int, _UnderWay] = {}

    def add(token: int, at_us: int, transition: str) -> None:
        work = under_way[token]
        event = Event(
            at_us, work.element, transition, work.instance, work.resource, work.role, work.code
        )
        events.append(event)
        work.events.append(event)

    def drop(token: int) -> None:
        for event in under_way.pop(token).events:
            events.remove(event)

    for each in run.records:
        record, at_us = each.record, each.at_us
        match record:
            case r.TokenEntered(token=token, element=element):
                if isinstance(elements.get(element), Activity):
                    under_way[token] = _UnderWay(element, f"{element}-{token}-{each.seq}")
                    add(token, at_us, "start")
            case r.ScopeOpened(token=int(token), instances=int()) if token in under_way:
                drop(token)  # it waits around the instances, and is none of them
            case r.BehaviorRequested(token=token, resources=resources) if token in under_way:
                work = under_way[token]
                work.resource = ", ".join(resources)
                for event in work.events:
                    event.resource = event.resource or work.resource
            case r.PromptOpened(token=token, role=role) if token in under_way:
                under_way[token].role = role
            case r.PromptAnswered(token=token, by=by) if token in under_way:
                under_way[token].resource = by
            case r.ErrorThrown(token=token, code=code) if token in under_way:
                under_way[token].code = code
            case r.BehaviorEnded(token=token, code=code) if token in under_way:
                under_way[token].code = code
            case r.TokenLeft(token=token, outcome=outcome) if token in under_way:
                if outcome is r.TokenOutcome.CONSUMED:
                    drop(token)  # with others it began one execution
                    continue
                add(token, at_us, _TRANSITIONS[outcome])
                del under_way[token]
            case r.RunPaused() | r.RunResumed():
                transition = "suspend" if isinstance(record, r.RunPaused) else "resume"
                for token in under_way:
                    add(token, at_us, transition)
            case r.RunEnded():
                for token in list(under_way):
                    add(token, at_us, "pi_abort")
                    del under_way[token]
    return events


class XesExporter:
    """One log; see the module."""

    def __init__(self, output: BinaryIO, _: ExportOptions) -> None:
        self._log = etree.Element(
            "log",
            {"xes.version": "2.0", "xes.features": "nested-attributes"},
            nsmap=_PREFIXES,
        )
        self._output = output
        for name, prefix, uri in _EXTENSIONS:
            etree.SubElement(self._log, "extension", name=name, prefix=prefix, uri=uri)
        for scope in ("trace", "event"):
            defaults = etree.SubElement(self._log, "global", scope=scope)
            _text(defaults, "concept:name", "unknown")
            if scope == "event":
                _text(defaults, "lifecycle:transition", "complete")
                _time(defaults, "time:timestamp", 0)
        etree.SubElement(
            self._log, "classifier", name="Activity", scope="event", keys="concept:name"
        )
        _text(self._log, "concept:name", "m2pem")
        _text(self._log, "lifecycle:model", "standard")

    def add(self, run: ExportedRun) -> None:
        """Add the trace of a run."""
        summary = run.summary
        trace = etree.SubElement(self._log, "trace")
        _text(trace, "concept:name", summary.run)
        _text(trace, "m2pem:mission", summary.mission)
        _text(trace, "m2pem:process", summary.process)
        _text(trace, "m2pem:outcome", summary.status.value)
        for each in events_of(run):
            event = etree.SubElement(trace, "event")
            _text(event, "concept:name", run.label(each.element))
            _text(event, "concept:instance", each.instance)
            _text(event, "lifecycle:transition", each.transition)
            _time(event, "time:timestamp", each.at_us)
            _text(event, "m2pem:element", each.element)
            for key, value in (
                ("org:resource", each.resource),
                ("org:role", each.role),
                ("m2pem:code", each.code),
            ):
                if value:
                    _text(event, key, value)

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        tree = etree.ElementTree(self._log)
        tree.write(self._output, encoding="UTF-8", xml_declaration=True, pretty_print=True)
        return ()


def xml_text(text: str) -> str:
    """Return a text with a replacement for the characters that XML cannot have."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)


def _text(parent: etree._Element, key: str, value: str) -> None:
    etree.SubElement(parent, "string", key=key, value=xml_text(value))


def _time(parent: etree._Element, key: str, time_us: int) -> None:
    etree.SubElement(parent, "date", key=key, value=iso_time(time_us))
