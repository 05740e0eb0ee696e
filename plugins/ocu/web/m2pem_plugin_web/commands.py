"""`m2pem web`: named users, and the address of a page that is served."""

import os
import sys
from collections.abc import MutableMapping
from pathlib import Path

import click

from m2pem.errors import OperatorError
from m2pem_plugin_web.access.roles import Role
from m2pem_plugin_web.settings import USERS

users_option = click.option(
    "--users",
    "path",
    type=click.Path(path_type=Path, dir_okay=False),
    envvar=USERS,
    required=True,
    metavar="FILE",
    help=f"The file of users; {USERS} if it is set.",
)


@click.group()
def web() -> None:
    """Manage the users of the web page, and print its address."""


@web.command("add-user")
@click.argument("name")
@click.option(
    "--role",
    type=click.Choice([each.value for each in Role]),
    required=True,
    help="The user's role.",
)
@users_option
def add_user(name: str, role: str, path: Path) -> None:
    """Add a user, or change the role and password of one.

    The command asks for the password; without a terminal it reads the first line of standard input.
    """
    from m2pem_plugin_web.access.passwords import hash_password  # noqa: PLC0415  # start fast
    from m2pem_plugin_web.access.users import (  # noqa: PLC0415
        NAME,
        NAME_IN_WORDS,
        User,
        Users,
        write_users,
    )

    if not NAME.fullmatch(name):
        raise click.UsageError(f"{name!r}: {NAME_IN_WORDS}")
    users = Users(path).all() if path.exists() else {}
    try:
        hashed = hash_password(_ask_for_password(name))
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    write_users(path, {**users, name: User(Role(role), hashed)})
    click.echo(f"{name} is {'an' if role[0] in 'aeiou' else 'a'} {role} in {path}")


@web.command("users")
@users_option
def list_users(path: Path) -> None:
    """List the users and their roles."""
    from m2pem_plugin_web.access.users import Users  # noqa: PLC0415

    for name, user in sorted(Users(path).all().items()):
        click.echo(f"{name}  {user.role}")


@web.command("remove-user")
@click.argument("name")
@users_option
def remove_user(name: str, path: Path) -> None:
    """Remove a user; all sessions of that name end at once."""
    from m2pem_plugin_web.access.users import Users, write_users  # noqa: PLC0415

    users = dict(Users(path).all())
    if users.pop(name, None) is None:
        raise OperatorError(f"{path} has no user {name!r}")
    write_users(path, users)
    click.echo(f"{name} is removed from {path}")


@web.command()
def url() -> None:
    """Print the address of each page that this user's executives serve.

    The address has a token that signs in one browser; the next call prints another token.
    """
    from m2pem_plugin_web.access import page_addresses  # noqa: PLC0415

    found = list(page_addresses.pages(page_addresses.folder(os.environ)))
    if not found:
        raise OperatorError(
            "this user serves no page: start one with m2pem serve --fleet FLEET --ocu web"
        )
    for page in found:
        click.echo(page.url)


def _ask_for_password(name: str) -> str:
    if sys.stdin.isatty():
        question = f"Password of {name}"
        return str(click.prompt(question, hide_input=True, confirmation_prompt=True))
    return sys.stdin.readline().rstrip("\n")


def add_to(commands: MutableMapping[str, click.Command]) -> None:
    """Add the group `web` to the command line."""
    commands["web"] = web
