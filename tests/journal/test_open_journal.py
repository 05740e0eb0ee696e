import stat
from pathlib import Path
from urllib.parse import quote

import pytest

from m2pem.errors import JournalError
from m2pem.journal import MemoryJournal, default_url, open_journal
from m2pem.journal.sqlite import SqliteJournal
from m2pem.testing.contracts.journal_harness import HEADER, opened


async def assert_opens(url, path):
    async with opened(lambda: open_journal(url)) as journal:
        assert isinstance(journal, SqliteJournal)
        assert await journal.create(HEADER) == "r1"
    assert path.stat().st_size > 0
    path.unlink()
    path.with_name(f"{path.name}-mark").unlink()


async def test_memory_opens_a_journal_in_memory():
    async with opened(lambda: open_journal("memory:")) as journal:
        assert isinstance(journal, MemoryJournal)


async def test_a_path_or_a_url_opens_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a b.db"
    for url in (
        "a b.db",
        "./a b.db",
        str(path),
        f"sqlite://{path}",
        f"sqlite://{quote(str(path))}",
    ):
        await assert_opens(url, path)
    # SQLAlchemy's spelling of an absolute path.
    await assert_opens(f"sqlite:///{path}", path)


async def test_a_path_may_have_a_colon(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    await assert_opens("trial:3.db", tmp_path / "trial:3.db")


@pytest.mark.parametrize(
    "url",
    [
        "",
        "mysql://x/y",
        "zenoh://x",
        "sqlite:",
        "sqlite://",
        "sqlite:///",
        "sqlite://host/a.db",
        "sqlite:///a.db?mode=ro",
        "memory://",
        "http://u:s3cret@x/y",
    ],
)
def test_what_is_no_journal_url_is_refused_with_what_would_be(url):
    with pytest.raises(
        JournalError, match=r"is not a journal's URL: write .*sqlite:///"
    ) as refused:
        open_journal(url)
    assert "s3cret" not in str(refused.value)


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


async def test_the_default_is_in_the_users_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "my state"))
    url = default_url()
    assert url == f"sqlite://{quote(str(tmp_path))}/my%20state/m2pem/journal.db"
    assert mode(tmp_path / "my state" / "m2pem") == 0o700
    async with opened(lambda: open_journal(url)) as journal:
        await journal.create(HEADER)
    assert mode(tmp_path / "my state" / "m2pem" / "journal.db") == 0o600


@pytest.mark.parametrize("configured", [None, "", "relative/state"])
def test_without_a_valid_setting_the_default_is_under_the_home_folder(
    tmp_path, monkeypatch, configured
):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    if configured is not None:
        monkeypatch.setenv("XDG_STATE_HOME", configured)
    assert default_url() == f"sqlite://{quote(str(tmp_path))}/.local/state/m2pem/journal.db"
    assert not Path(configured or "relative").exists()


def test_a_state_folder_that_cannot_be_made_is_told(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    with pytest.raises(JournalError, match="m2pem cannot be made: Not a directory"):
        default_url()
