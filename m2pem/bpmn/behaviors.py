"""Behaviors and services as XML: the paper's Figure 3 (docs/missions.md)."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from lxml import etree

from m2pem.bpmn.context import MARK, ReadingContext
from m2pem.bpmn.needs import NEED_ATTRIBUTES, NeedReader
from m2pem.bpmn.rules.attributes import BAD_VALUE
from m2pem.bpmn.rules.behaviors import (
    BEHAVIOR_NAME,
    BEHAVIOR_TYPE,
    DUPLICATE_PARAMETER,
    DUPLICATE_PROPERTY,
    DUPLICATE_ROLE,
    MISPLACED,
    PARAMETER_NAME,
    ROLE_ALLOCATION,
    ROLE_NAME,
    ROLE_NEED,
    ROLE_NOT_LITERAL,
    SERVICE_CLASS,
)
from m2pem.bpmn.rules.rule import Rule
from m2pem.bpmn.xml import BPMN, M2PEM, local
from m2pem.mission.behavior import (
    Behavior,
    BehaviorType,
    Keep,
    OnLoss,
    Parameter,
    Role,
    RoleKind,
    ServiceCall,
)

_LITERAL_ATTRIBUTES = frozenset({"name", "optional", "onLoss", "keep", *RoleKind})


class BehaviorReader:
    """Reads the XML inside one task; `line` finds the lines of that XML in the mission file."""

    def __init__(
        self, context: ReadingContext, task: str, line: Callable[[etree._Element], int]
    ) -> None:
        self._context = context
        self._findings = context.findings
        self._task = task
        self._line = line

    def behavior(self, element: etree._Element) -> Behavior | None:
        """Read a `<behavior>`; return None when it has errors, which are reported."""
        head: dict[str, str] = {}
        for name in ("type", "name"):
            text = _attribute(element, name)
            if text is not None:
                head[name] = text
        parameters: list[Parameter] = []
        roles: list[Role] = []
        for child in self._children(element):
            what = local(child.tag)
            if what == "property":
                self._head_property(child, head)
            elif what == "properties":
                parameters += self._parameters(child)
            elif what == "resources":
                roles += self._resources(child)
            elif what == "role":
                self._misplaced(child, "role", "resources")
        self.refuse_repeated(parameters, DUPLICATE_PARAMETER)
        self.refuse_repeated(roles, DUPLICATE_ROLE)
        return self._finish(element, head, parameters, roles)

    def _finish(
        self,
        element: etree._Element,
        head: dict[str, str],
        parameters: list[Parameter],
        roles: list[Role],
    ) -> Behavior | None:
        kind = head.get("type", "").strip()
        name = head.get("name", "").strip()
        line = self._line(element)
        if kind not in list(BehaviorType):
            what = f"its type is '{kind}'" if kind else "it has no type"
            self._error(
                line,
                BEHAVIOR_TYPE,
                f"the behavior cannot be commanded: {what}",
                f"write one of the types {', '.join(BehaviorType)}",
            )
        if not name or "${" in name:
            what = f"its name '{name}' is no literal text" if name else "it has no name"
            self._error(
                line,
                BEHAVIOR_NAME,
                f"the behavior cannot be commanded: {what}",
            )
        if kind not in list(BehaviorType) or not name:
            return None
        # What is needed is of the behavior's own type; a team is made of the vehicles chosen.
        filled = [role if role.resource else replace(role, kind=RoleKind(kind)) for role in roles]
        if kind == BehaviorType.TEAM:
            self._refuse_on_loss(
                filled,
                "belongs to a behavior of type vehicle or payload",
                "delete it; the fleet file says what a team does: on_lost_member",
            )
        return Behavior(BehaviorType(kind), name, line, tuple(parameters), tuple(filled))

    def _head_property(self, element: etree._Element, head: dict[str, str]) -> None:
        name = _attribute(element, "name") or ""
        if name not in ("type", "name"):
            self._misplaced(element, f"property '{name}'", "properties")
            return
        text = _value_text(element)
        if head.get(name, text) != text:
            self._error(
                self._line(element),
                BEHAVIOR_TYPE if name == "type" else BEHAVIOR_NAME,
                f"the behavior's {name} is both '{head[name]}' and '{text}'",
                "keep one of the two",
            )
        head[name] = text

    def service(self, element: etree._Element) -> ServiceCall | None:
        """Read an `<m2pem:service class="...">`; return None when it has no class."""
        parameters: list[Parameter] = []
        roles: list[Role] = []
        for child in self._children(element):
            what = local(child.tag)
            if what == "property":
                parameters += self.one_parameter(child)
            elif what == "role":
                roles += self._role(child)
            elif what == "properties":
                parameters += self._parameters(child)
            elif what == "resources":
                roles += self._resources(child)
        self.refuse_repeated(parameters, DUPLICATE_PROPERTY)
        self.refuse_repeated(roles, DUPLICATE_ROLE)
        for role in roles:
            if role.need is not None or role.keep is not None:
                self._error(
                    role.line,
                    ROLE_NEED,
                    f"role '{role.name}' of a service says what it needs, waits or keeps it",
                    "only behaviors choose resources as they start: name the payload or vehicle",
                )
        self._refuse_on_loss(
            roles, "belongs to a behavior", "delete it: a service that fails ends with its error"
        )
        name = (_attribute(element, "class") or "").strip()
        line = self._line(element)
        if not name:
            self._error(line, SERVICE_CLASS, "the service has no class")
            return None
        return ServiceCall(name, line, tuple(roles), tuple(parameters))

    # --- properties and roles -------------------------------------------------------------------

    def _parameters(self, element: etree._Element) -> list[Parameter]:
        result: list[Parameter] = []
        for child in self._children(element):
            if local(child.tag) == "property":
                result += self.one_parameter(child)
        return result

    def one_parameter(self, element: etree._Element) -> list[Parameter]:
        """Read a `<property>`; return nothing when it has errors, which are reported."""
        name = _attribute(element, "name")
        text = _value_text(element)
        line = self._line(element)
        if not name:
            self._error(line, PARAMETER_NAME, "a property has no name")
            return []
        if not MARK.search(text) and not text.lstrip().startswith("="):
            return [Parameter(name, text, line)]
        value = self._context.template(line, self._task, text)
        return [] if value is None else [Parameter(name, value, line)]

    def _resources(self, element: etree._Element) -> list[Role]:
        return self.roles([each for each in self._children(element) if local(each.tag) == "role"])

    def roles(self, elements: list[etree._Element]) -> list[Role]:
        """Read `<role>` elements, without those that have errors, which are reported."""
        return [role for element in elements for role in self._role(element)]

    def _role(self, element: etree._Element) -> list[Role]:
        line = self._line(element)
        name = (_attribute(element, "name") or "").strip()
        if not name:
            self._error(line, ROLE_NAME, "a role has no name", 'write <role name="driver" .../>')
        texts = {key: _attribute(element, key) for key in sorted(_LITERAL_ATTRIBUTES)}
        for key, text in texts.items():
            if text is not None and ("${" in text or "#{" in text):
                self._error(
                    line,
                    ROLE_NOT_LITERAL,
                    f"{key}='{text}' of role '{name}' is an expression, but roles are literal",
                )
                return []
        given = ((key, _attribute(element, key)) for key in NEED_ATTRIBUTES)
        needs = {key: text for key, text in given if text is not None}
        named = [(kind, texts[kind] or "") for kind in RoleKind if texts[kind] is not None]
        by_need = "requires" in needs or "same" in needs
        if by_need and named:
            self._error(
                line,
                ROLE_ALLOCATION,
                f"role '{name}' names a {named[0][0]} and says what it needs, too",
                "keep the name, or what is needed of it",
            )
            return []
        if not by_need and (len(named) != 1 or not named[0][1].strip()):
            what = " and ".join(kind for kind, _ in named) if len(named) > 1 else "no resource"
            self._error(
                line,
                ROLE_ALLOCATION,
                f"role '{name}' names {what}",
                "name exactly one vehicle, payload or team, or say with requires= what it needs",
            )
            return []
        kind, resource = named[0] if named else (RoleKind.VEHICLE, "")
        need = None
        if needs:
            need = NeedReader(self._context, self._task, line, name, by_need=by_need).read(needs)
            if need is None:
                return []
        optional = self._optional(line, name, texts["optional"])
        on_loss = self._on_loss(line, name, texts["onLoss"], by_need=by_need)
        keep = self._keep(line, name, texts["keep"])
        found = Role(name, kind, resource.strip(), line, optional, need, on_loss, keep)
        return [found] if name else []

    def _keep(self, line: int, role: str, text: str | None) -> Keep | None:
        if text is None:
            return None
        if text not in list(Keep):
            self._error(
                line,
                ROLE_NEED,
                f"role '{role}': keep='{text}' is none of {', '.join(Keep)}",
                "write keep='process' or keep='subprocess', keep='task' to keep it no longer than "
                "this task, or delete it",
            )
            return None
        return Keep(text)

    def _on_loss(self, line: int, role: str, text: str | None, *, by_need: bool) -> OnLoss:
        if text is None:
            return OnLoss.FAIL
        if text not in list(OnLoss):
            self._error(
                line,
                ROLE_NEED,
                f"role '{role}': onLoss='{text}' is none of {', '.join(OnLoss)}",
                "write onLoss='reassign' to have another do the rest, 'ask', or delete it",
            )
            return OnLoss.FAIL
        if text == OnLoss.REASSIGN and not by_need:
            self._error(
                line,
                ROLE_NEED,
                f"role '{role}': onLoss='{text}' belongs to a role that says what it needs",
                "write requires= in place of the name, so that there is another, or onLoss='ask'",
            )
        return OnLoss(text)

    def _refuse_on_loss(self, roles: Iterable[Role], why: str, remedy: str) -> None:
        for role in roles:
            if role.on_loss is not OnLoss.FAIL:
                text = f"role '{role.name}': onLoss='{role.on_loss.value}' {why}"
                self._error(role.line, ROLE_NEED, text, remedy)

    def _optional(self, line: int, role: str, text: str | None) -> bool:
        if text not in (None, "true", "false", "1", "0"):
            self._error(
                line,
                BAD_VALUE,
                f"optional='{text}' of role '{role}' is neither true nor false",
                'write optional="true", or delete it',
            )
        return text in ("true", "1")

    # --- findings ------------------------------------------------------------------------------

    def _children(self, element: etree._Element) -> Iterator[etree._Element]:
        for child in element:
            if _is_in_own_namespace(child.tag):
                yield child

    def refuse_repeated(
        self,
        items: Iterable[Role | Parameter],
        rule: Rule,
        besides: Iterable[Role | Parameter] = (),
    ) -> None:
        """Report the names that repeat another item's, or one of `besides`."""
        what = rule.slug.removeprefix("duplicate-")
        seen = {item.name for item in besides}
        for item in items:
            if item.name in seen:
                self._error(item.line, rule, f"the {what} '{item.name}' is given twice")
            seen.add(item.name)

    def _misplaced(self, element: etree._Element, what: str, wrapper: str) -> None:
        self._error(
            self._line(element),
            MISPLACED,
            f"{what} is outside <{wrapper}>",
            f"move it into <{wrapper}>",
        )

    def _error(self, line: int, rule: Rule, message: str, remedy: str = "") -> None:
        self._findings.error(line, self._task, rule, message, remedy)


def is_behavior(element: etree._Element) -> bool:
    """Whether an element is a `<behavior>`, of no namespace, BPMN's or m2pem's."""
    return local(element.tag) == "behavior" and _is_in_own_namespace(element.tag)


def _is_in_own_namespace(tag: str) -> bool:
    return not tag.startswith("{") or tag.startswith((BPMN, M2PEM))


def _attribute(element: etree._Element, name: str) -> str | None:
    plain = element.get(name)
    return plain if plain is not None else element.get(M2PEM + name)


def _value_text(element: etree._Element) -> str:
    value = _attribute(element, "value")
    return value if value is not None else (element.text or "").strip()
