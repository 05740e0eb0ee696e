"""`m2pem examples`: the examples that come with m2pem."""

from pathlib import Path

import click

from m2pem.cli.options import example


@click.command(epilog=example("m2pem examples t05"))
@click.argument("name", required=False)
@click.argument("folder", required=False, type=click.Path(path_type=Path))
def examples(name: str | None, folder: Path | None) -> None:
    """List the examples, or copy one.

    NAME is its number (t05) or its folder. It is copied into FOLDER, by default examples/NAME here:
    the commands of its README are typed where you are now.
    """
    from m2pem.demo.shipped_files import copy_example, list_examples

    if name is None:
        known = list_examples()
        width = max(len(each.name) for each in known)
        for each in known:
            click.echo(f"{each.name:{width}}  {each.shows}")
        click.echo("\n`m2pem examples t01` copies one.")
        return
    target = copy_example(name, folder)
    click.echo(f"{target}: {', '.join(sorted(each.name for each in target.iterdir()))}")
    click.echo(f"Read {target / 'README.md'}; type its commands here.")
