"""What call activities call (BPMN 2.0.2, clause 10.3.6): processes and global tasks.

They are looked for in the calling file, in the files that it imports, in the mission's own file,
and on the search path, in this order. A prefix whose namespace is another file's leaves the calling
file to the last.
"""

from collections import deque

from m2pem.bpmn.files import Files, Part
from m2pem.bpmn.names import BPMN
from m2pem.bpmn.reading import PendingCall
from m2pem.bpmn.rules.activities import AMBIGUOUS_CALL, NO_CALLED_ELEMENT
from m2pem.bpmn.rules.files import NOT_EXECUTED
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.mission.elements import Process
from m2pem.mission.library import LibraryError
from m2pem.mission.near import did_you_mean

_MAX_LISTED = 10


def find_called(files: Files) -> set[Process]:
    """Tell each call activity what it calls; gives back the processes that take part.

    All of the mission's own file do, and of others those that are called, by whatever way. What
    cannot be found is reported.
    """
    waiting = deque((files.main, process) for process in files.main.read())
    reached = {process for _, process in waiting}
    while waiting:
        part, process = waiting.popleft()
        for pending in part.calls(process):
            target = _target(files, part, pending)
            if target is None:
                continue
            called = target.process(pending.call.called_id)
            object.__setattr__(pending.call, "called", called)
            if called not in reached:
                reached.add(called)
                waiting.append((target, called))
    return reached


def _target(files: Files, part: Part, pending: PendingCall) -> Part | None:
    """The file in which the called element is; None when a finding says why there is none."""
    name = pending.call.called_id
    rule, remedy = DANGLING_REFERENCE, ""
    if not name:
        rule, message = NO_CALLED_ELEMENT, "the call activity does not say what it calls"
    elif name.startswith("=") or "{" in name:
        rule = NOT_EXECUTED
        message = "m2pem does not execute a calledElement that is an expression"
        remedy = (
            "write the process's id, so that it can be checked before anything moves; to choose "
            "between several, use a gateway and a call activity for each"
        )
    else:
        try:
            found = _look(files, part, name, _namespace(part, pending))
        except LibraryError as error:
            rule, message, remedy = AMBIGUOUS_CALL, error.message, error.remedy
        else:
            if found is not None:
                return found
            message = f"calledElement names '{name}', which is no process or global task of "
            places = files.library.places if files.library is not None else ()
            message += "this file" + (
                f", nor of a BPMN file in {', '.join(places)}" if places else ""
            )
    remedy = remedy or _existing(files, part, name)
    part.reading.report.error(pending.call.line, pending.call.id, rule, message, remedy)
    return None


def _existing(files: Files, part: Part, name: str) -> str:
    known = [process.id for process in part.read()] + list(part.reading.global_tasks)
    listed = ", ".join(f"'{each}'" for each in dict.fromkeys(known[:_MAX_LISTED]))
    remedy = f"name a process of this file: {listed}"
    if files.library is not None:
        remedy += "; or name the folder of its file with --path"
    return did_you_mean(name, known, remedy) if name else remedy


def _namespace(part: Part, pending: PendingCall) -> str:
    """The namespace that the name's prefix is bound to, if it is another file's; else ""."""
    prefix, colon, _ = pending.element.get("calledElement", "").strip().rpartition(":")
    namespace = pending.element.nsmap.get(prefix, "") if colon else ""
    return "" if namespace in (part.namespace, BPMN[1:-1]) else str(namespace)


def _look(files: Files, part: Part, name: str, namespace: str) -> Part | None:
    if not namespace and part.has(name):
        return part
    imports = zip(part.imports, part.import_namespaces, strict=True)
    imported = {
        each: None
        for each, declared in imports
        if each.has(name) and namespace in ("", declared, each.namespace)
    }
    if len(imported) > 1:
        raise LibraryError(
            f"'{name}' is in several imported files: {', '.join(each.name for each in imported)}",
            "import one of them, or write the prefix of its namespace",
        )
    for each in imported:
        return each
    main = files.main
    if main.has(name) and namespace in ("", main.namespace):
        return main
    found = files.called(name, namespace)
    if found is not None and found.has(name):
        return found
    return part if part.has(name) else None  # editors write prefixes that mean nothing
