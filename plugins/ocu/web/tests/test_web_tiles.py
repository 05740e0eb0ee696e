"""Pictures below the map, from an MBTiles file."""

import sqlite3
import struct
import zlib
from pathlib import Path

import pytest
from m2pem_plugin_web.settings import SettingError, read_settings
from m2pem_plugin_web.tiles import Tiles
from playwright.async_api import Browser, expect
from web_browsing import page_at
from web_desk import IN_ONE_LOOP
from web_world import MakeWorld

ZOOM = 15
GREEN = (60, 160, 60)


def png(colour: tuple[int, int, int]) -> bytes:
    """A picture of 256 x 256 pixels of one colour."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        whole = kind + content
        return struct.pack(">I", len(content)) + whole + struct.pack(">I", zlib.crc32(whole))

    head = struct.pack(">IIBBBBB", 256, 256, 8, 2, 0, 0, 0)
    rows = (b"\0" + bytes(colour) * 256) * 256
    parts = (chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def mbtiles(file: Path, *, format_: str = "png", attribution: str = "A survey & <b>Co</b>") -> Path:
    """A file with every tile of the northern half of the world at zoom 1, and one at zoom 15."""
    with sqlite3.connect(file) as database:
        database.execute("CREATE TABLE metadata (name text, value text)")
        database.execute(
            "CREATE TABLE tiles (zoom_level integer, tile_column integer, tile_row integer,"
            " tile_data blob)"
        )
        said = {"format": format_, "attribution": attribution}
        database.executemany("INSERT INTO metadata VALUES (?, ?)", said.items())
        north = [(1, column, 1, png(GREEN)) for column in (0, 1)]
        database.executemany("INSERT INTO tiles VALUES (?, ?, ?, ?)", [*north, (ZOOM, 3, 4, b"x")])
    database.close()
    return file


def test_rows_are_counted_from_the_north(tmp_path: Path) -> None:
    tiles = Tiles(mbtiles(tmp_path / "map.mbtiles"))
    assert tiles.tile(1, 0, 0) == png(GREEN)
    assert tiles.tile(1, 0, 1) is None
    assert tiles.tile(ZOOM, 3, (1 << ZOOM) - 1 - 4) == b"x"
    assert tiles.pictured.max_zoom == ZOOM
    assert tiles.pictured.attribution == "A survey & Co"


def test_what_is_no_file_of_pictures_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(
        SettingError, match=r"M2PEM_WEB_TILES=.*none\.mbtiles: the file does not exist"
    ):
        read_settings({"M2PEM_WEB_TILES": str(tmp_path / "none.mbtiles")})
    text = tmp_path / "text.mbtiles"
    text.write_text("no database, but a text that is long enough to be taken for one" * 20)
    with pytest.raises(SettingError, match=r"text\.mbtiles is not a readable MBTiles file"):
        Tiles(text)
    with pytest.raises(SettingError, match=r"'pbf': the map shows images only"):
        Tiles(mbtiles(tmp_path / "shapes.mbtiles", format_="pbf"))


@IN_ONE_LOOP
async def test_the_map_shows_them_and_whom_they_are_from(
    chromium: Browser, world: MakeWorld, tmp_path: Path
) -> None:
    file = mbtiles(tmp_path / "map.mbtiles")
    with sqlite3.connect(file) as database:
        database.execute("DELETE FROM tiles WHERE zoom_level != 1")
        database.execute("INSERT INTO tiles SELECT 1, tile_column, 0, tile_data FROM tiles")
    database.close()
    async with world(M2PEM_WEB_TILES=str(file)) as here, page_at(chromium, here.ocu.url) as it:
        page = it.page
        run = (await here.asked()).run
        await page.goto(f"{here.base}/runs/{run}")
        drawn = page.locator(".leaflet-tile-loaded").first
        await expect(drawn).to_be_attached()
        assert await drawn.evaluate("each => each.naturalWidth") == 256
        whom = page.locator(".leaflet-control-attribution")
        await expect(whom).to_have_text("A survey & Co")
        it.assert_well()
