"""Pictures below the map, from an MBTiles or PMTiles file."""

import gzip
import sqlite3
import struct
import zlib
from pathlib import Path

import pytest
from m2pem_plugin_web.settings import SettingError, read_settings
from m2pem_plugin_web.tile_files import open_tiles
from playwright.async_api import Browser, expect
from pmtiles.tile import Compression, TileType, zxy_to_tileid
from pmtiles.writer import write
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
    tiles = open_tiles(mbtiles(tmp_path / "map.mbtiles"))
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
    neither = r"text\.mbtiles is neither a readable MBTiles file .* nor a PMTiles file"
    with pytest.raises(SettingError, match=neither):
        open_tiles(text)
    with pytest.raises(SettingError, match=r"'pbf': the map shows images only"):
        open_tiles(mbtiles(tmp_path / "shapes.mbtiles", format_="pbf"))


def pmtiles(
    file: Path,
    tiles: dict[tuple[int, int, int], bytes],
    *,
    kind: TileType = TileType.PNG,
    packed: Compression = Compression.NONE,
) -> Path:
    """An archive, as the library of PMTiles writes it. `tiles`: by zoom, column and row."""
    numbered = {zxy_to_tileid(*place): content for place, content in tiles.items()}
    with write(str(file)) as archive:
        for number, content in sorted(numbered.items()):
            archive.write_tile(number, content)
        archive.finalize(
            {"tile_type": kind, "tile_compression": packed},
            {"attribution": "A survey &amp; <b>Co</b>"},
        )
    return file


def test_an_archive_with_directories_below_directories_is_read(tmp_path: Path) -> None:
    many = {
        (9, column, row): f"{column} {row}".encode() for column in range(150) for row in range(150)
    }
    world = {(1, column, row): png(GREEN) for column in (0, 1) for row in (0, 1)}
    tiles = open_tiles(pmtiles(tmp_path / "map.pmtiles", {**world, **many}))
    assert tiles.pictured.media_type == "image/png"
    assert (tiles.pictured.max_zoom, tiles.pictured.attribution) == (9, "A survey & Co")
    assert tiles.tile(1, 1, 0) == tiles.tile(1, 0, 1) == png(GREEN)  # written once
    assert all(tiles.tile(*place) == content for place, content in many.items())
    assert tiles.tile(9, 150, 0) is tiles.tile(3, 0, 0) is tiles.tile(1, 2, 0) is None
    tiles.close()


def test_packed_images_are_unpacked(tmp_path: Path) -> None:
    packed = gzip.compress(png(GREEN))
    file = pmtiles(tmp_path / "map.pmtiles", {(0, 0, 0): packed}, packed=Compression.GZIP)
    assert open_tiles(file).tile(0, 0, 0) == png(GREEN)


def test_archives_without_pictures_and_damaged_ones_are_refused(tmp_path: Path) -> None:
    tile = {(0, 0, 0): png(GREEN)}
    for kind in (TileType.MVT, TileType.MLT):
        shapes = pmtiles(tmp_path / "shapes.pmtiles", tile, kind=kind)
        with pytest.raises(SettingError, match=rf"'{kind.name.lower()}': the map shows images"):
            open_tiles(shapes)
    packed = pmtiles(tmp_path / "packed.pmtiles", tile, packed=Compression.BROTLI)
    with pytest.raises(SettingError, match=r"compressed by brotli: convert it"):
        open_tiles(packed)
    whole = pmtiles(tmp_path / "whole.pmtiles", tile).read_bytes()
    for name, content, why in (
        ("old", whole[:7] + b"\x02" + whole[8:], "its version is not 3"),
        ("short", whole[: -len(png(GREEN)) - 20], "the file ends at byte"),
        ("empty", whole[:7], "the file ends at byte 7"),
    ):
        file = tmp_path / f"{name}.pmtiles"
        file.write_bytes(content)
        with pytest.raises(SettingError, match=rf"{name}.pmtiles is not a readable PMTiles.*{why}"):
            open_tiles(file)


def test_a_damaged_part_of_an_archive_has_no_tiles(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = pmtiles(tmp_path / "map.pmtiles", {(0, 0, 0): png(GREEN)})
    tiles = open_tiles(file)
    with file.open("r+b") as opened:
        opened.truncate(file.stat().st_size - 1)
    assert tiles.tile(0, 0, 0) is None
    assert "tile 0/0/0 cannot be read: the file ends" in caplog.text


@IN_ONE_LOOP
@pytest.mark.parametrize("format_", ["mbtiles", "pmtiles"])
@pytest.mark.tried_with(
    "PMTiles and MBTiles",
    "maps without the network",
    kind="Maps and geodesy",
    result="shown on the page",
    package="pmtiles",
)
async def test_the_map_shows_them_and_whom_they_are_from(
    chromium: Browser, world: MakeWorld, tmp_path: Path, format_: str
) -> None:
    file = tmp_path / f"map.{format_}"
    if format_ == "mbtiles":
        mbtiles(file)
        with sqlite3.connect(file) as database:
            database.execute("DELETE FROM tiles WHERE zoom_level != 1")
            database.execute("INSERT INTO tiles SELECT 1, tile_column, 0, tile_data FROM tiles")
        database.close()
    else:
        pmtiles(file, {(1, column, row): png(GREEN) for column in (0, 1) for row in (0, 1)})
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
