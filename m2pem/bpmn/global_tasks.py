"""Global tasks (BPMN 2.0.2, clause 10.3.3): a called one runs as a process with just that task.

The task keeps the id, so that records and answers name what was drawn. What is passed in lies in
the store of that process; data inputs and outputs of its own would only hide it.
"""

from collections.abc import Callable

from lxml import etree

from m2pem.bpmn.names import BPMN
from m2pem.bpmn.prompts import read_user_task
from m2pem.bpmn.reading import Reading
from m2pem.bpmn.scan import Scan, scan
from m2pem.bpmn.scripts import read_script_task
from m2pem.bpmn.tasks import read_business_rule_task, read_manual_task, read_plain_task
from m2pem.mission.elements import Activity, Process

_READERS: dict[str, Callable[[Reading, Scan], Activity]] = {
    BPMN + "globalTask": read_plain_task,
    BPMN + "globalBusinessRuleTask": read_business_rule_task,
    BPMN + "globalManualTask": read_manual_task,
    BPMN + "globalScriptTask": read_script_task,
    BPMN + "globalUserTask": read_user_task,
}
GLOBAL_TASKS = frozenset(_READERS)


def read_global_task(reading: Reading, element: etree._Element) -> Process:
    """The process that calling a global task begins."""
    identifier = element.get("id", "")  # claimed with the root elements
    process = Process(
        identifier, element.get("name", ""), reading.report.line(element), global_task=True
    )
    task = _READERS[element.tag](reading, scan(reading, element, identifier))
    reading.processes.append(process)
    reading.nodes.append(task)
    reading.containers.append(process)
    return process
