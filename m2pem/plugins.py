"""What plugins offer: arbiters, OCUs, faces, services, commands, checks and observers.

Plugins are looked for when something is first asked for. One that breaks is kept in `failures`,
with what broke, and stops neither the others nor the rest of itself.
"""

import logging
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from m2pem.api.capabilities import arbiter_problem, face_problem, ocu_problem
from m2pem.api.health import HealthCheck, HealthStatus
from m2pem.errors import InternalError, PluginError
from m2pem.findings import Finding, Severity
from m2pem.plugin_loading import (
    Found,
    LoadedPlugin,
    Origin,
    PluginFailure,
    canonical,
    failure,
    find_plugins,
)
from m2pem.suggestions import did_you_mean, nearest

if TYPE_CHECKING:
    import click

    from m2pem.api.arbiter import Arbiter
    from m2pem.api.exporter import Exporter
    from m2pem.api.face import Face
    from m2pem.api.ocu import Ocu
    from m2pem.api.service import Service
    from m2pem.engine.records import Record
    from m2pem.fleet.fleet import Fleet
    from m2pem.mission.mission import Mission

__all__ = ["DEFAULT_PLUGINS", "PluginFailure", "PluginInfo", "PluginManager", "Plugins"]

T = TypeVar("T")

DEFAULT_PLUGINS = ("m2pem.simulation.hooks", "m2pem.services.plugin", "m2pem.cli.plain_plugin")
"""Modules of the core that load through the same hooks as anyone's plugin."""

BLOCK_VARIABLE = "M2PEM_BLOCK_PLUGINS"

_HOOKS = {
    "arbiter": "m2pem_register_arbiters",
    "ocu": "m2pem_register_ocus",
    "face": "m2pem_register_faces",
    "exporter": "m2pem_register_exporters",
    "service": "m2pem_register_services",
    "command": "m2pem_register_commands",
}
_PROBLEM_OF: Mapping[str, Callable[[object], str]] = {
    "arbiter": arbiter_problem,
    "ocu": ocu_problem,
    "face": face_problem,
    "exporter": lambda _: "",
    "service": lambda _: "",
}
"""What is wrong in the capabilities that a factory declares, by the kind of what it makes."""

_CHECK = "m2pem_check_mission"
_CHECK_HOST = "m2pem_check_host"
_OBSERVE = "m2pem_records_committed"
PUBLISHED: Mapping[str, Mapping[str, str]] = {
    "arbiter": {name: name for name in ("mavlink", "ptz", "ros", "vda5050", "zenoh")},
    "ocu": {name: name for name in ("mocu", "terminal", "web")},
    "face": {
        "cot": "cot",
        "foxglove": "recorder",
        "otlp": "opentelemetry",
        "prometheus": "opentelemetry",
        "recorder": "recorder",
        "ros": "ros",
    },
}
"""What the plugins of m2pem itself provide, installed or not, and the plugin that has it."""


def how_to_install(distribution: str) -> str:
    """Say how a plugin of m2pem is installed: no public package index has it."""
    return f"pip install '{distribution}' (docs/install.md says from where)"


_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class PluginInfo:
    """One line of `m2pem plugins`.

    `provides`: "arbiter mavlink", "command foo", "mission checks", "record observer", ...
    `failure`: what broke in it, "" when nothing did.
    """

    name: str
    module: str
    distribution: str
    version: str
    provides: tuple[str, ...] = ()
    failure: str = ""


@dataclass(frozen=True, slots=True)
class _Offer:
    """Something registered under a name, and by whom."""

    factory: Any
    origin: Origin


class Plugins(Protocol):
    """What an executive asks plugins for; `PluginManager` describes each method."""

    def arbiter(self, name: str) -> "Callable[..., Arbiter]": ...

    def service(self, name: str) -> "Callable[[], Service]": ...

    def service_writes(self) -> dict[str, tuple[str, ...]]: ...

    def check_mission(self, mission: "Mission", fleet: "Fleet | None") -> list[Finding]: ...

    def records_committed(self, run_id: str, records: "Sequence[Record]") -> None: ...


class PluginManager:
    """All plugins. Making one is cheap; the first question loads them.

    `block`: names of plugins or distributions that are not to be loaded, "all" for every one but
    the built-in; the environment variable M2PEM_BLOCK_PLUGINS (comma-separated) adds to it.
    `failures`: what has broken so far.
    """

    def __init__(
        self, block: Collection[str] = (), *, built_in: Sequence[str] = DEFAULT_PLUGINS
    ) -> None:
        self.failures: list[PluginFailure] = []
        self._built_in = tuple(built_in)
        named = os.environ.get(BLOCK_VARIABLE, "").split(",")
        self._block = {*block, *(name.strip() for name in named if name.strip())}
        self._offers: dict[str, dict[str, _Offer]] = {}

    def arbiters(self) -> "Mapping[str, Callable[..., Arbiter]]":
        """Every arbiter by its name."""
        return self._factories("arbiter")

    def ocus(self) -> "Mapping[str, Callable[..., Ocu]]":
        """Every operator control unit by its name."""
        return self._factories("ocu")

    def faces(self) -> "Mapping[str, Callable[..., Face]]":
        """Every face by its name."""
        return self._factories("face")

    def exporters(self) -> "Mapping[str, Callable[..., Exporter]]":
        """Every format of `m2pem export` by its name."""
        return self._factories("exporter")

    def services(self) -> "Mapping[str, Callable[[], Service]]":
        """Every service by its name."""
        return self._factories("service")

    def arbiter(self, name: str) -> "Callable[..., Arbiter]":
        """The arbiter of that name.

        Raises:
            PluginError: there is none; says which plugin broke, or which names there are.
        """
        return self._one("arbiter", self.arbiters(), name)

    def ocu(self, name: str) -> "Callable[..., Ocu]":
        """The operator control unit of that name; errors as for `arbiter`."""
        return self._one("ocu", self.ocus(), name)

    def face(self, name: str) -> "Callable[..., Face]":
        """The face of that name; errors as for `arbiter`."""
        return self._one("face", self.faces(), name)

    def exporter(self, name: str) -> "Callable[..., Exporter]":
        """The exporter of that name; errors as for `arbiter`."""
        return self._one("exporter", self.exporters(), name)

    def service(self, name: str) -> "Callable[[], Service]":
        """The service of that name; errors as for `arbiter`."""
        return self._one("service", self.services(), name)

    def service_writes(self) -> dict[str, tuple[str, ...]]:
        """What each service writes to the data store, by its name; errors as for `arbiter`."""
        return {name: tuple(self.service(name)().writes) for name in self.services()}

    def commands(self, cli: "click.Group") -> None:
        """Add the plugins' commands; a plugin that would replace a command adds none.

        Groups of the same name become one: `m2pem sim` has a command of each simulator.
        """
        import click  # noqa: PLC0415  # not everything that uses plugins has a command line

        hook = _HOOKS["command"]
        known = set(cli.list_commands(click.Context(cli)))
        offers = self._offers["command"] = {}
        for plugin in self._having(hook):
            own = click.Group(cli.name)
            if self._run(plugin, hook, own.commands, cli=own) is not None:
                continue
            if taken := sorted(_taken(known, cli, own)):
                error = PluginError(f"there is a command {', '.join(taken)} already")
                self._failed(plugin.origin, error, hook, own.commands)
                continue
            known |= set(own.commands)
            for name, command in own.commands.items():
                shared = cli.commands.get(name)
                if isinstance(shared, click.Group) and isinstance(command, click.Group):
                    both = copy(shared)
                    both.commands = {**shared.commands, **command.commands}
                    cli.add_command(both, name)
                else:
                    cli.add_command(command, name)
                offers.setdefault(name, _Offer(command, plugin.origin))

    def check_mission(self, mission: "Mission", fleet: "Fleet | None") -> list[Finding]:
        """The plugins' findings; for a check that breaks, a warning: it may have had some."""
        findings: list[Finding] = []
        for plugin in self._having(_CHECK):
            try:
                returned = plugin.call(_CHECK, mission=mission, fleet=fleet)
                findings += _all_of(Finding, "findings", returned)
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                broken = self._failed(plugin.origin, error, _CHECK)
                remedy = "ask its author; to check without it, block the plugin"
                findings.append(
                    Finding(
                        Severity.WARNING,
                        mission.file,
                        0,
                        "",
                        "plugin-check-broken",
                        f"the check of {broken} was not done",
                        remedy,
                    )
                )
        return findings

    def check_host(self, fleet: "Fleet | None") -> list[HealthCheck]:
        """The plugins' checks of this host; for one that breaks, a check with the warning."""
        checks: list[HealthCheck] = []
        for plugin in self._having(_CHECK_HOST):
            try:
                returned = plugin.call(_CHECK_HOST, fleet=fleet)
                checks += _all_of(HealthCheck, "checks", returned)
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                broken = str(self._failed(plugin.origin, error, _CHECK_HOST))
                remedy = "ask its author; what it needs of this host was not checked"
                name = f"plugin {plugin.origin.name}"
                checks.append(HealthCheck(name, HealthStatus.WARNING, broken, remedy))
        return checks

    def records_committed(self, run_id: str, records: "Sequence[Record]") -> None:
        """Call the observers; an exception of one is logged, the first time as an error, which
        operators see, and affects no other."""
        for plugin in self._observers:
            known = len(self.failures)
            try:
                plugin.call(_OBSERVE, run_id=run_id, records=records)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # no task is cancelled in a plain function
                broken = self._failed(plugin.origin, error, _OBSERVE)
                level = logging.ERROR if len(self.failures) > known else logging.DEBUG
                _logger.log(level, "run %s: the observer of %s", run_id, broken, exc_info=True)

    def listing(self) -> list[PluginInfo]:
        """Every plugin with what it provides, those that broke or are blocked too."""
        if "command" not in self._offers:
            import click  # noqa: PLC0415  # see `commands`

            self.commands(click.Group())
        for kind in ("arbiter", "ocu", "face", "exporter", "service"):
            self._factories(kind)
        loaded = [plugin.origin for plugin in self._found.loaded]
        broken = [origin for origin, _ in self._found.failed]
        return [self._info(origin) for origin in (*loaded, *broken, *self._found.blocked)]

    def unknown(self, kind: str, name: str) -> PluginError:
        """Return the error for an unknown name. `kind`: the names of `_HOOKS`."""
        hook = _HOOKS[kind]
        blocked = [_blocked(origin) for origin in self._found.blocked]
        broken = [each for each in self.failures if each.hook in ("", hook)] + blocked
        if namesakes := [each for each in broken if _is_namesake(each, name)]:
            return PluginError(
                f"{kind} {name!r} is not available: {'; '.join(map(str, namesakes))}"
            )
        offers = self._offers.get(kind, {})
        parts = [f"there is no {kind} {name!r}; known: {', '.join(sorted(offers)) or 'none'}"]
        if hint := did_you_mean(name, offers):
            parts.append(hint)
        elif kind in PUBLISHED and re.fullmatch(r"[a-z][a-z0-9_-]*", name):
            known = nearest(canonical(name), PUBLISHED[kind], 0.6)
            if known:
                distribution = f"m2pem-plugin-{PUBLISHED[kind][known]}"
                parts.append(f"{known!r} is in a plugin: {how_to_install(distribution)}")
            else:
                parts.append("is the plugin that has it installed?")
        if broken:
            parts.append(f"or it belongs to one that was not loaded: {'; '.join(map(str, broken))}")
        return PluginError("; ".join(parts))

    @cached_property
    def _found(self) -> Found:
        found = find_plugins(self._built_in, self._block)
        self.failures += [broken for _, broken in found.failed]
        return found

    @cached_property
    def _observers(self) -> list[LoadedPlugin]:
        return self._having(_OBSERVE)

    def _having(self, hook: str) -> list[LoadedPlugin]:
        return [plugin for plugin in self._found.loaded if hook in plugin.hooks]

    def _one(self, kind: str, factories: Mapping[str, T], name: str) -> T:
        if name not in factories:
            raise self.unknown(kind, name)
        return factories[name]

    def _factories(self, kind: str) -> dict[str, Any]:
        if kind not in self._offers:
            offers: dict[str, _Offer] = {}
            for plugin in self._having(_HOOKS[kind]):
                offers |= self._offered(plugin, kind, offers)
            self._offers[kind] = offers
        return {name: offer.factory for name, offer in self._offers[kind].items()}

    def _offered(
        self, plugin: LoadedPlugin, kind: str, before: Mapping[str, _Offer]
    ) -> dict[str, _Offer]:
        """What a plugin registers; nothing at all when any of it is wrong."""
        offered: dict[str, _Offer] = {}

        def register(name: str, factory: Callable[..., Any]) -> None:
            if not isinstance(name, str) or not re.fullmatch(r"\w[\w.-]*", name):
                raise PluginError(f"{name!r} is no name for a plugin's {kind}")
            if not callable(factory):
                raise PluginError(f"{kind} {name!r}: {factory!r} cannot be called to make one")
            if problem := _PROBLEM_OF[kind](factory):
                raise PluginError(f"{kind} {name!r}: {problem}")
            if other := {**before, **offered}.get(name):
                raise PluginError(f"{kind} {name!r} is registered by {other.origin.name!r} already")
            offered[name] = _Offer(factory, plugin.origin)

        broken = self._run(plugin, _HOOKS[kind], offered, register=register)
        return offered if broken is None else {}

    def _run(
        self, plugin: LoadedPlugin, hook: str, names: Iterable[str], **arguments: object
    ) -> PluginFailure | None:
        """Call a hook that runs at start-up; `names`: what it has registered when it breaks."""
        try:
            plugin.call(hook, **arguments)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            broken = self._failed(plugin.origin, error, hook, names)
            if plugin.origin.built_in:
                raise InternalError(f"the built-in {broken}") from error
            return broken
        return None

    def _failed(
        self, origin: Origin, error: BaseException, hook: str, names: Iterable[str] = ()
    ) -> PluginFailure:
        broken = failure(origin, error, hook, tuple(names))
        # An observer may break at every commit: the first time says enough.
        if not any((one.name, one.hook) == (broken.name, hook) for one in self.failures):
            self.failures.append(broken)
        return broken

    def _info(self, origin: Origin) -> PluginInfo:
        provides = [
            f"{kind} {name}"
            for kind in _HOOKS
            for name, offer in self._offers[kind].items()
            if offer.origin is origin
        ]
        for hook, what in (
            (_CHECK, "mission checks"),
            (_CHECK_HOST, "host checks"),
            (_OBSERVE, "record observer"),
        ):
            if any(plugin.origin is origin for plugin in self._having(hook)):
                provides.append(what)
        errors = [
            broken.error
            for broken in (*self.failures, *map(_blocked, self._found.blocked))
            if (broken.name, broken.distribution) == (origin.name, origin.distribution)
        ]
        return PluginInfo(
            origin.name,
            origin.module,
            origin.distribution,
            origin.version,
            tuple(provides),
            "; ".join(errors),
        )


def _blocked(origin: Origin) -> PluginFailure:
    return failure(origin, PluginError(f"blocked, for example by {BLOCK_VARIABLE}"))


def _is_namesake(broken: PluginFailure, name: str) -> bool:
    """Whether a name can only belong to that plugin."""
    distribution = canonical(broken.distribution).removeprefix("m2pem-plugin-")
    return name in broken.names or canonical(name) in (canonical(broken.name), distribution)


def _taken(known: set[str], cli: "click.Group", own: "click.Group") -> Iterator[str]:
    """Yield the commands of `own` that `cli` has already; "group command" in a group of both."""
    import click  # noqa: PLC0415  # see `PluginManager.commands`

    for name in known & set(own.commands):
        first, second = cli.commands.get(name), own.commands[name]
        if isinstance(first, click.Group) and isinstance(second, click.Group):
            yield from (f"{name} {each}" for each in set(first.commands) & set(second.commands))
        else:
            yield name


def _all_of(kind: type[T], what: str, result: object) -> list[T]:
    """What a hook returned, if all of it is of that kind; `what`: its name for the message."""
    if result is None:
        return []
    if not isinstance(result, Iterable):
        raise PluginError(f"it returned {result!r}, not {what}")
    returned = list(result)
    if wrong := [each for each in returned if not isinstance(each, kind)]:
        raise PluginError(f"it returned {wrong[0]!r} among its {what}")
    return returned
