"""User tasks: what they ask, from their own extension elements or from data objects they read."""

from dataclasses import dataclass, field

from lxml import etree

from m2pem.bpmn.names import BPMN, M2PEM, local
from m2pem.bpmn.reading import KEY, PendingPrompt, Reading, association, text_of
from m2pem.bpmn.rules.activities import DECISION_VALUE
from m2pem.bpmn.rules.data import BAD_KEY
from m2pem.bpmn.rules.events import TIMER_TIME
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.scan import Scan, own_extensions
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.behavior import Decision, Prompt
from m2pem.mission.duration import duration_us
from m2pem.mission.elements import UserTask
from m2pem.mission.expression import Expression

_USED = frozenset({"userTask", "prompt", "decision"})
_SETTINGS = ("store", "role", "timeout")
_DEFAULT_STORE = "user.decision"
_DONE = (Decision("done", "Done"),)


def read_user_task(reading: Reading, found: Scan) -> UserTask:
    """A user task; its prompt follows in `resolve_prompts`."""
    element = found.element
    task = UserTask(found.id, element.get("name", ""), reading.report.line(element))
    reading.prompts.append(
        PendingPrompt(
            task,
            element,
            own_extensions(found, _USED),
            found.documentation(),
            [association(each) for each in found.of("dataInputAssociation")],
        )
    )
    return task


def resolve_prompts(reading: Reading) -> None:
    """Give every user task its prompt, now that all data objects are known."""
    for pending in reading.prompts:
        asked = _Asked(reading, pending.task.id)
        asked.settings(pending.element, prefixed=True)
        for group in pending.extensions.values():
            for element in group:
                asked.read(element)
        own = len(asked.decisions)
        for each in pending.inputs:
            for source in each.source_refs:
                asked.data_object(source, own_decisions=own > 0)
        prompt = Prompt(
            asked.text or pending.documentation or pending.task.label,
            tuple(asked.decisions) or _DONE,
            asked.found.get("store", _DEFAULT_STORE),
            asked.found.get("role", ""),
            asked.timeout,
        )
        object.__setattr__(pending.task, "prompt", prompt)


@dataclass(slots=True)
class _Asked:
    """What has been found of one prompt; what was found first counts."""

    reading: Reading
    task: str
    text: str = ""
    decisions: list[Decision] = field(default_factory=list)
    found: dict[str, str] = field(default_factory=dict)
    timeout: Expression | None = None

    def read(self, element: etree._Element) -> None:
        """An m2pem:prompt, m2pem:decision or m2pem:userTask."""
        name = local(element.tag)
        if name == "decision":
            self._decision(element)
            return
        self.settings(element, prefixed=False)
        if name == "prompt":
            lines = [line.strip() for line in text_of(element).splitlines()]
            self.text = self.text or "\n".join(lines)
            return
        for child in element:
            if child.tag in (M2PEM + "prompt", M2PEM + "decision"):
                self.read(child)

    def data_object(self, identifier: str, *, own_decisions: bool) -> None:
        """What the data object that the task reads carries."""
        end = self.reading.data.get(identifier)
        if end is None:
            return
        carriers = list(end.carriers)
        if end.refers_to in self.reading.data:
            carriers += self.reading.data[end.refers_to].carriers
        for carrier in carriers:
            for outer in carrier.iterchildren(BPMN + "extensionElements"):
                for element in outer:
                    if element.tag in (M2PEM + "prompt", M2PEM + "userTask") or (
                        element.tag == M2PEM + "decision" and not own_decisions
                    ):
                        self.read(element)

    def settings(self, element: etree._Element, *, prefixed: bool) -> None:
        """The attributes store, role and timeout."""
        for name in _SETTINGS:
            text = element.get(M2PEM + name)
            if text is None and not prefixed:
                text = element.get(name)
            if text is None or name in self.found:
                continue
            self.found[name] = text.strip()
            if name == "store" and not KEY.fullmatch(text.strip()):
                self._error(
                    element,
                    BAD_KEY,
                    f"store='{text}' is no name of the data store",
                    'write a dotted name, for example store="user.decision"',
                )
            elif name == "timeout":
                self._timeout(element, text)

    def _timeout(self, element: etree._Element, text: str) -> None:
        self.timeout = self.reading.template(element, self.task, text)
        if self.timeout is None or not self.timeout.constant:
            return
        try:
            duration_us(self.timeout.evaluate(lambda _: None), 0)
        except (ExpressionSyntaxError, ExpressionError) as error:
            self._error(element, TIMER_TIME, f"timeout: {error}", 'write for example "PT5M"')

    def _decision(self, element: etree._Element) -> None:
        value = element.get("value", element.get(M2PEM + "value"))
        value = (value if value is not None else text_of(element)).strip()
        if not value:
            self._error(
                element,
                DECISION_VALUE,
                "a decision has no value",
                'write <m2pem:decision value="continue" label="Continue"/>',
            )
        elif any(value == other.value for other in self.decisions):
            self._error(
                element,
                DECISION_VALUE,
                f"two decisions have the value '{value}'",
                "give each its own value",
            )
        else:
            label = element.get("label", element.get(M2PEM + "label")) or value
            self.decisions.append(Decision(value, label))

    def _error(self, element: etree._Element, rule: Rule, message: str, remedy: str) -> None:
        self.reading.report.error(element, self.task, rule, message, remedy)
