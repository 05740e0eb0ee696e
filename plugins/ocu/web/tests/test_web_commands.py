"""`m2pem web`: users by name, and addresses of pages."""

import os
from pathlib import Path

import click
import m2pem_plugin_web
import pytest
from click.testing import CliRunner, Result
from m2pem_plugin_web.access import page_addresses
from m2pem_plugin_web.access.private_files import NotPrivateError, private_folder
from m2pem_plugin_web.access.users import Users
from web_world import MakeWorld

from m2pem.errors import M2pemError


def invoke(*words: str, stdin: str = "", **environment: str) -> Result:
    cli = click.Group("m2pem")
    m2pem_plugin_web.m2pem_register_commands(cli)
    return CliRunner().invoke(cli, ["web", *words], input=stdin, env=environment)


# --- users --------------------------------------------------------------------------------------


def test_users_are_added_listed_changed_and_removed(tmp_path: Path) -> None:
    path = tmp_path / "users.json"
    said = {"M2PEM_WEB_USERS": str(path)}
    for name, role in (("otto", "operator"), ("anna", "viewer"), ("anna", "commander")):
        done = invoke("add-user", name, "--role", role, stdin="correct horse\n", **said)
        assert done.exit_code == 0, done.output
    assert done.output == f"anna is a commander in {path}\n"
    assert path.stat().st_mode & 0o777 == 0o600
    assert "correct horse" not in path.read_text()
    assert invoke("users", **said).output == "anna  commander\notto  operator\n"
    assert invoke("remove-user", "otto", "--users", str(path)).exit_code == 0
    assert list(Users(path).all()) == ["anna"]


@pytest.mark.parametrize("name", ["", "../x", "a b", "-x", "x" * 65, "a\nb"])
def test_a_name_is_one_word(tmp_path: Path, name: str) -> None:
    path = tmp_path / "users.json"
    done = invoke("add-user", "--role", "viewer", "--users", str(path), "--", name, stdin="x" * 9)
    assert done.exit_code == 2
    assert "a name has letters" in done.output
    assert not path.exists()


@pytest.mark.parametrize("password", ["", "short", "x" * 1001])
def test_a_password_is_neither_short_nor_endless(tmp_path: Path, password: str) -> None:
    path = tmp_path / "users.json"
    words = ("add-user", "anna", "--role", "viewer", "--users", str(path))
    done = invoke(*words, stdin=f"{password}\n")
    assert done.exit_code == 2
    assert "8 to 1000" in done.output
    assert not path.exists()


def test_who_is_not_there_is_not_removed(tmp_path: Path) -> None:
    path = tmp_path / "users.json"
    path.touch(mode=0o600)
    path.write_text("{}")
    done = invoke("remove-user", "anna", "--users", str(path))
    assert isinstance(done.exception, M2pemError)
    assert "no user 'anna'" in str(done.exception)


# --- addresses ----------------------------------------------------------------------------------


async def test_the_address_of_a_page_has_the_token_that_is_valid(
    world: MakeWorld, tmp_path: Path
) -> None:
    state = {"XDG_STATE_HOME": str(tmp_path), "XDG_RUNTIME_DIR": ""}
    async with world(XDG_RUNTIME_DIR="") as here:
        first = invoke("url", **state).output.strip()
        assert first == here.ocu.url
        await here.browser()
        second = invoke("url", **state).output.strip()
        assert second != first
        assert await here.stranger().open(second)
    done = invoke("url", **state)
    assert isinstance(done.exception, M2pemError)
    assert "this user serves no page" in str(done.exception)


def test_addresses_are_in_the_runtime_directory_where_there_is_one(tmp_path: Path) -> None:
    assert page_addresses.folder({"XDG_RUNTIME_DIR": str(tmp_path)}) == tmp_path / "m2pem-web"
    said = {"XDG_RUNTIME_DIR": str(tmp_path / "none"), "XDG_STATE_HOME": str(tmp_path / "state")}
    assert page_addresses.folder(said) == tmp_path / "state" / "m2pem-web"


def test_pages_of_dead_executives_are_forgotten(tmp_path: Path) -> None:
    where = private_folder(tmp_path / "m2pem-web")
    dead = 2**22 + 1  # more than Linux gives out
    page_addresses.announce(where, page_addresses.Page(dead, 1, "http://127.0.0.1:1/", "t"))
    page_addresses.announce(where, page_addresses.Page(os.getpid(), 2, "http://127.0.0.1:2/", ""))
    (where / "page-3.json").write_text("{")
    assert [page.url for page in page_addresses.pages(where)] == ["http://127.0.0.1:2/"]
    assert not page_addresses.file_of(where, 1).exists()


def test_a_folder_of_secrets_is_closed_to_others_and_no_link(tmp_path: Path) -> None:
    assert private_folder(tmp_path / "new").stat().st_mode & 0o777 == 0o700
    (tmp_path / "link").symlink_to(tmp_path / "new")
    with pytest.raises(NotPrivateError, match="not a folder of this user's own"):
        private_folder(tmp_path / "link")
