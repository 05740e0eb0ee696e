"""`m2pem templates`: element templates of a fleet, for Camunda Modeler and bpmn-js."""

from pathlib import Path

import click

from m2pem.cli.options import as_json, example, fleet_option, writing


@click.group(
    epilog=example(
        "m2pem templates export --fleet fleet_configs/vignette1.yaml --for camunda --out m2pem.json"
    )
)
def templates() -> None:
    """Make forms of a fleet's behaviors for BPMN editors."""


@templates.command(
    epilog=example("m2pem templates export --fleet fleet_configs/vignette1.yaml --for camunda")
)
@fleet_option(required=True)
@click.option(
    "--for",
    "editor",
    type=click.Choice(["camunda", "bpmn-io"]),
    required=True,
    help="Camunda Modeler with diagrams for Camunda 8, or bpmn-js and diagrams for Camunda 7.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write to this file  [default: standard output]",
)
def export(fleet_file: str, editor: str, out: Path | None) -> None:
    """Write element templates: a form for each behavior, service and common question.

    docs/editors.md says where an editor looks for them.
    """
    from m2pem.scripting.sources import DEFAULT_FLEET, arbiters_of

    if fleet_file == DEFAULT_FLEET:
        raise click.UsageError(f"{DEFAULT_FLEET!r} is made up from a mission; name a fleet file")
    from m2pem.editing.element_templates import Editor, element_templates
    from m2pem.fleet.fleet_file import load_fleet
    from m2pem.plugins import PluginManager

    fleet = load_fleet(fleet_file)
    plugins = PluginManager()
    arbiters = arbiters_of(fleet, plugins)
    resources = (*fleet.vehicles, *fleet.payloads, *fleet.teams)
    offers = {resource: arbiters.graph.offers(resource) for resource in resources}
    made = element_templates(fleet, offers, sorted(plugins.services()), Editor(editor))
    text = as_json(made) + "\n"
    if out is None:
        click.echo(text, nl=False)
        return
    with writing(out):
        out.write_text(text, encoding="utf-8")
    click.echo(f"{out}: {len(made)} element templates of the fleet {fleet.name}")
