"""Resources that a run keeps between its tasks (`keep` of a role, docs/allocation.md).

A task whose role says so keeps what fills the role until the process or subprocess that the task is
in ends. Only tasks in that scope get it until then. A resource is kept once: by the outermost scope
for which a task has asked.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence

from m2pem.engine import records as r
from m2pem.engine.execution import Execution
from m2pem.engine.state import Keeping, RunState, Scope, Token
from m2pem.mission.behavior import Behavior, Keep
from m2pem.mission.elements import Process


def keep_resources(
    x: Execution, token: Token, behavior: Behavior, roles: Mapping[str, Sequence[str]]
) -> None:
    """Keep what fills the roles of a behavior that is requested, or keep it no longer.

    A task that is executed again keeps what it has now in place of what it had before.
    """
    for role in behavior.roles:
        if role.keep is None:
            continue
        resources = roles.get(role.name, ())
        _let_go_of_earlier(x, token, role.name, resources)
        for resource in resources:
            if role.keep is Keep.TASK:
                end_keeping(x, resource, f"{token.node.label} is the last task to have it")
            else:
                _keep(x, token, behavior, role.name, resource, _until(token, role.keep))


def _let_go_of_earlier(x: Execution, token: Token, role: str, now: Collection[str]) -> None:
    for resource, keeping in list(x.state.kept.items()):
        same = (keeping.token, keeping.element, keeping.role) == (token.id, token.node.id, role)
        if same and resource not in now:
            end_keeping(x, resource, f"{token.node.label} has {', '.join(now)} now")


def _keep(
    x: Execution, token: Token, behavior: Behavior, role: str, resource: str, until: Scope
) -> None:
    known = x.state.kept.get(resource)
    if known is not None:
        if known.until in _around(until):
            return
        end_keeping(x, resource, f"{token.node.label} keeps it for longer")
    needs = (each.need for each in behavior.roles)
    x.emit(
        r.ResourceKept(
            token.id,
            x.process_of(token.node),
            token.node.id,
            token.scope.id,
            f"{x.state.run}.k{x.state.last_keeping + 1}",
            role,
            resource,
            until.id,
            max((need.priority for need in needs if need is not None), default=0),
        )
    )


def _until(token: Token, keep: Keep) -> Scope:
    """Return the scope with whose end the keeping ends."""
    scope = token.scope
    while scope.parent is not None and (
        scope.loop is not None
        or (keep is Keep.PROCESS and not isinstance(scope.container, Process))
    ):
        scope = scope.parent
    return scope


def _around(scope: Scope) -> Iterator[Scope]:
    """Yield a scope and those around it."""
    place: Scope | None = scope
    while place is not None:
        yield place
        place = place.parent


def end_keeping(x: Execution, resource: str, reason: str) -> None:
    """Keep a resource no more, if it is kept."""
    keeping = x.state.kept.get(resource)
    if keeping is not None:
        x.emit(r.KeepingEnded(keeping.id, resource, reason))


def end_keepings_of(x: Execution, scope: Scope) -> None:
    """Keep nothing more that is kept until a scope ends, which ends now."""
    for resource, keeping in list(x.state.kept.items()):
        if keeping.until is scope:
            end_keeping(x, resource, "")


def may_use(keeping: Keeping, token: Token) -> bool:
    """Whether a task may have what is kept: it is in the scope until whose end that is kept."""
    return any(scope is keeping.until for scope in _around(token.scope))


def kept_for_others(state: RunState, token: Token, resource: str) -> str:
    """Return why a task cannot have a resource that its run keeps elsewhere; "": it can."""
    keeping = state.kept.get(resource)
    if keeping is None or may_use(keeping, token):
        return ""
    label = state.label_of(keeping.element)
    return f"{resource} is kept for {label} until {keeping.until.container.label} ends"
