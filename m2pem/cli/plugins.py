"""`m2pem plugins`: what is installed, what it provides, and what is broken."""

import logging
from typing import TYPE_CHECKING, Any

import click

from m2pem.cli.options import as_json, example, format_option

if TYPE_CHECKING:
    from m2pem.plugins import PluginManager


@click.command(epilog=example("m2pem plugins"))
@format_option
def plugins(output: str) -> None:
    """List the plugins and what they provide.

    The behaviors of an arbiter are those that it would offer on a vehicle or payload that the
    fleet says nothing more about; `m2pem fleet` shows those of a real fleet.
    """
    from m2pem.cli.group import built_in_names
    from m2pem.plugins import PluginManager

    manager = PluginManager()
    manager.commands(built_in_names())
    listing = manager.listing()
    behaviors = {name: _behaviors(manager, name) for name in manager.arbiters()}
    if output == "json":
        click.echo(as_json({"plugins": listing, "behaviors": behaviors}))
        return
    for plugin in listing:
        click.echo(f"{plugin.name}  ({plugin.distribution} {plugin.version})")
        for provided in plugin.provides:
            click.echo(f"    {provided}")
            kind, _, name = provided.partition(" ")
            for resource, names in behaviors.get(name, {}).items() if kind == "arbiter" else ():
                click.echo(f"        {resource}: {', '.join(names) or 'nothing'}")
        if plugin.failure:
            click.secho(f"    broken: {plugin.failure}", fg="red")


def _behaviors(manager: "PluginManager", arbiter: str) -> "dict[str, list[str]]":
    """What an arbiter offers in each domain and on a payload; nothing if it needs a real fleet."""
    from m2pem.api.arbiter import ArbiterContext, Connection
    from m2pem.api.clock import SystemClock
    from m2pem.fleet.fleet import Domain
    from m2pem.mission.catalogue import ResourceId
    from m2pem.telemetry.bus import Bus

    vehicles = {ResourceId(domain.value): domain.value for domain in Domain}
    payload = ResourceId(f"{Domain.GROUND.value}/payload")
    connections = {
        resource: Connection(resource, domain)
        for resource, domain in {**vehicles, payload: Domain.GROUND.value}.items()
    }
    context = ArbiterContext(
        SystemClock(), Bus(), logging.getLogger("m2pem.arbiter"), (0.0, 0.0, 0.0)
    )
    found: dict[str, list[str]] = {}
    try:
        made: Any = manager.arbiter(arbiter)(connections, context)
        for resource in connections:
            what = "payload" if resource == payload else f"{resource} vehicle"
            found[what] = sorted({spec.name for spec in made.catalogue(resource)})
    except Exception as error:  # it may well refuse vehicles without a connection
        logging.getLogger("m2pem.cli").debug("arbiter %s shows no behaviors: %s", arbiter, error)
        return {}
    return found
