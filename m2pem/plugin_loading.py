"""Finds and loads plugins; one that cannot be loaded is a `PluginFailure` and stops nothing."""

import importlib
import importlib.metadata
import inspect
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pluggy

from m2pem import hookspecs
from m2pem.errors import InternalError, PluginError

GROUP = "m2pem"


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a plugin comes from: its entry point, and the distribution that has it."""

    name: str
    module: str
    distribution: str
    version: str
    built_in: bool = False


@dataclass(frozen=True, slots=True)
class PluginFailure:
    """What broke in a plugin.

    `hook` is the hook that broke; "" when the plugin could not be loaded. `names`: what it had
    registered with that hook before, and is lost with it.
    """

    name: str
    distribution: str
    version: str
    error: str
    hook: str = ""
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"plugin {self.name!r} ({self.distribution} {self.version}): {self.error}"


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPlugin:
    """A plugin whose hooks fit their specifications, by name."""

    origin: Origin
    hooks: Mapping[str, pluggy.HookImpl]

    def call(self, hook: str, **arguments: object) -> Any:
        """Call one of its hooks with those of the arguments that it takes."""
        implementation = self.hooks[hook]
        return implementation.function(*(arguments[name] for name in implementation.argnames))


@dataclass(slots=True)
class Found:
    """Plugins in order: the built-in ones, then the others by name."""

    loaded: list[LoadedPlugin] = field(default_factory=list)
    failed: list[tuple[Origin, PluginFailure]] = field(default_factory=list)
    blocked: list[Origin] = field(default_factory=list)


def failure(
    origin: Origin, error: BaseException, hook: str = "", names: tuple[str, ...] = ()
) -> PluginFailure:
    """What an exception says of a plugin, on one line."""
    text = " ".join(str(error).split())
    if not isinstance(error, PluginError):
        text = f"{type(error).__name__}: {text}"
    return PluginFailure(origin.name, origin.distribution, origin.version, text, hook, names)


def find_plugins(built_in: Sequence[str], block: Collection[str]) -> Found:
    """Load the built-in modules and every entry point of group `m2pem` that is not blocked.

    `block` has names of plugins or distributions; "all" stands for every one.

    Raises:
        InternalError: a built-in module is missing or broken.
    """
    found = Found()
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(hookspecs)
    version = importlib.import_module(GROUP).__version__
    for module in built_in:
        origin = Origin(module, module, GROUP, version, built_in=True)
        try:
            found.loaded.append(_checked(manager, origin, importlib.import_module(module)))
        except Exception as error:
            raise InternalError(f"the built-in {failure(origin, error)}") from error
    blocked = {canonical(name) for name in block}
    for origin, load in sorted(_entry_points(), key=lambda entry: _order(entry[0])):
        if blocked & {"all", canonical(origin.name), canonical(origin.distribution)}:
            found.blocked.append(origin)
            continue
        try:
            found.loaded.append(_checked(manager, origin, load()))
        except KeyboardInterrupt:  # of the operator, not of the plugin
            raise
        except BaseException as error:
            found.failed.append((origin, failure(origin, error)))
    return found


def canonical(name: str) -> str:
    """A name of a plugin or distribution, however it was spelled."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _order(origin: Origin) -> tuple[str, str]:
    return origin.name, origin.distribution


def _entry_points() -> Iterator[tuple[Origin, Callable[[], object]]]:
    seen: set[str] = set()
    for distribution in importlib.metadata.distributions():
        # Searched before it is parsed: invalid files of other projects must not fail here.
        try:
            text = distribution.read_text("entry_points.txt") or ""
        except (OSError, UnicodeError):
            continue
        if f"[{GROUP}]" not in text:
            continue
        name, version = _name_and_version(distribution)
        if canonical(name) in seen:
            continue  # shadowed by one that comes earlier on the path, as for any import
        seen.add(canonical(name))
        try:
            entries = tuple(distribution.entry_points.select(group=GROUP))
        except Exception as error:
            yield Origin(name, "", name, version), _raiser(error)
            continue
        for entry in entries:
            yield Origin(entry.name, entry.value, name, version), _loader(entry)


def _name_and_version(distribution: importlib.metadata.Distribution) -> tuple[str, str]:
    try:
        return distribution.metadata["Name"] or "unknown", distribution.version or "?"
    except Exception:  # whatever is wrong with its metadata, its plugins may be well
        return "unknown", "?"


def _loader(entry: importlib.metadata.EntryPoint) -> Callable[[], object]:
    def load() -> object:
        if not entry.pattern.match(entry.value):
            raise PluginError(f"its entry point {entry.value!r} is not `module` or `module:object`")
        return entry.load()

    return load


def _raiser(error: Exception) -> Callable[[], object]:
    def load() -> object:
        raise PluginError(f"its entry points cannot be read: {error}")

    return load


def _checked(manager: pluggy.PluginManager, origin: Origin, plugin: object) -> LoadedPlugin:
    if manager.has_plugin(origin.name):
        raise PluginError("another plugin has the same name; uninstall or block one of them")
    try:
        manager.register(plugin, origin.name)
    except pluggy.PluginValidationError as error:
        raise PluginError(f"a hook does not fit its specification: {error}") from error
    try:
        return LoadedPlugin(origin, _hooks(manager, plugin))
    except PluginError:
        manager.unregister(name=origin.name)
        raise


def _hooks(manager: pluggy.PluginManager, plugin: object) -> dict[str, pluggy.HookImpl]:
    """The hooks of a plugin, each of which m2pem has and can call alone."""
    hooks = {}
    for caller in manager.get_hookcallers(plugin) or ():
        (implementation,) = (one for one in caller.get_hookimpls() if one.plugin is plugin)
        if not caller.has_spec():
            if implementation.optionalhook:
                continue
            raise PluginError(f"m2pem has no hook {caller.name}; see docs/plugins.md")
        if inspect.iscoroutinefunction(implementation.function) or inspect.isgeneratorfunction(
            implementation.function
        ):
            raise PluginError(
                f"{caller.name} must be a plain function, neither async nor a wrapper"
            )
        hooks[caller.name] = implementation
    for name in vars(hookspecs):
        mine = getattr(plugin, name, None)
        if name.startswith(f"{GROUP}_") and name not in hooks and inspect.isfunction(mine):
            raise PluginError(f"{name} is not marked with @m2pem.hookimpl")
    if not hooks:
        raise PluginError(
            f"nothing is marked with @m2pem.hookimpl in the {type(plugin).__name__} that its entry "
            "point leads to"
        )
    return hooks
