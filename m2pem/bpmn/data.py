"""Data objects, references to them and to data stores, and properties: what declares a key."""

from lxml import etree

from m2pem.bpmn.names import local
from m2pem.bpmn.reading import DataEnd, Reading, reference
from m2pem.bpmn.rules.references import DANGLING_REFERENCE
from m2pem.bpmn.scan import scan
from m2pem.mission.elements import Container, DataObject
from m2pem.mission.near import did_you_mean


def read_data(reading: Reading, element: etree._Element, container: Container) -> None:
    """A dataObject, dataObjectReference, dataStoreReference or property of a container."""
    identifier = reading.optional_id(element)
    scan(reading, element, identifier)
    name = element.get("name", "")
    what = local(element.tag)
    if what in ("dataObject", "property"):
        declared = DataObject(identifier, name, reading.report.line(element))
        if declared.key:
            reading.declared.append((container, declared))
        if identifier:
            reading.data.setdefault(identifier, DataEnd(declared.key, [element], declared))
    elif identifier:
        if what == "dataStoreReference":
            reading.data_stores.add(identifier)
        target = element.get("dataObjectRef") or element.get("dataStoreRef") or ""
        reading.data.setdefault(
            identifier, DataEnd(name or identifier, [element], refers_to=reference(target))
        )


def resolve_data(reading: Reading) -> None:
    """Name data objects after their references, and note which ones associations write.

    Editors draw and name the *reference*; the data object itself has only an id.
    """
    for identifier, end in reading.data.items():
        target = reading.data.get(end.refers_to)
        if target is None and end.refers_to:
            reading.report.warning(
                end.carriers[0],
                identifier,
                DANGLING_REFERENCE,
                f"it refers to '{end.refers_to}', which is no data object or data store",
                did_you_mean(end.refers_to, reading.data, "correct it, or delete it"),
            )
        if target is None or target.declared is None:
            continue
        declared = target.declared
        if not declared.name and end.carriers[0].get("name"):
            object.__setattr__(declared, "name", end.key)
    for association in reading.written:
        key = reading.data_key(association.target_ref)
        if key:
            reading.written_keys.add(key)
