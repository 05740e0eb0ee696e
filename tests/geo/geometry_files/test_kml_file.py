"""KML as other programs write it."""

import time
import zipfile
from collections.abc import Mapping
from io import BytesIO

import pytest

from m2pem.findings import Severity
from m2pem.geo.geometry_files import (
    FileFormat,
    GeometryFile,
    NamedGeometry,
    read_geometry_file,
    write_geometry_file,
)
from m2pem.geo.geometry_files.contents import MAX_POSITIONS
from m2pem.mission.geometry import Area, Geometry, Point, Route

LINE = "<Placemark><name>{}</name><LineString>{}<coordinates>7,53,5 8,54,6</coordinates>"
LINE += "</LineString></Placemark>"
GX = 'xmlns:gx="http://www.google.com/kml/ext/2.2"'


def kml(body: str, attributes: str = "") -> str:
    root = f'kml xmlns="http://www.opengis.net/kml/2.2" {attributes}'
    return f"<{root}><Document>{body}</Document></kml>"


def read(content: str | Mapping[str, str]) -> GeometryFile:
    """Read a KML, or a KMZ with these members."""
    if isinstance(content, str):
        return read_geometry_file("a.kml", content.encode())
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, text in content.items():
            archive.writestr(name, text)
    return read_geometry_file("a.kmz", file.getvalue())


def found(file: GeometryFile) -> dict[str, Geometry]:
    return {each.name: each.geometry for each in file.geometries}


def line(mode: str = "") -> Route:
    if not mode:
        return Route(((53.0, 7.0, None), (54.0, 8.0, None)))
    return Route(((53.0, 7.0, 5.0), (54.0, 8.0, 6.0)), mode)


# --- prefixes -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "document",
    [
        kml('<d xsi:schemaLocation="a b"/>' + LINE.format("a", "")),
        kml("<atom:link href='x'/>" + LINE.format("a", "<gx:drawOrder>1</gx:drawOrder>"), GX),
        # Declared where it is used once, and used once more elsewhere.
        kml(f"<gx:Tour {GX}/><gx:x/>" + LINE.format("a", "")),
        "<?xml version='1.0'?><!-- <kml> -->\n<kml >" + LINE.format("a", "<my:x/>") + "</kml>",
    ],
)
def test_a_prefix_that_is_not_declared_does_no_harm(document: str) -> None:
    assert found(read(document)) == {"a": line()}


def test_a_track_with_undeclared_prefixes_is_a_route() -> None:
    track = "<gx:Track><gx:altitudeMode>absolute</gx:altitudeMode><gx:coord>7 53 9</gx:coord>"
    file = read(kml(f"<Placemark><name>t</name>{track}</gx:Track></Placemark>"))
    assert found(file) == {"t": Route(((53.0, 7.0, 9.0),), "amsl")}


def test_a_document_that_is_cut_off_stays_an_error_beside_such_prefixes() -> None:
    """lxml 6.1 with `recover` takes it, and after a hundred prefixes names no other error."""
    file = read(kml(LINE.format("a", "") + "<gx:x/>" * 200)[:-30])
    assert file.geometries == ()
    assert str(file.problems[0]).startswith("is not XML: ")


@pytest.mark.parametrize(
    "content",
    [
        b"<kml>" + b"<a:b/>" * 1_500_000 + b"</kml",
        b"<?a?>" * 1_900_000,
        b"<!-- <kml -->" * 700_000,
        b"<kml>" + b" ".join(b"p%d:x" % number for number in range(1_000_000)) + b"<gx:a/></kml>",
    ],
)
def test_ten_megabytes_of_prefixes_take_seconds_and_no_more(content: bytes) -> None:
    begin = time.process_time()
    assert read_geometry_file("a.kml", content[:9_999_999]).geometries == ()
    assert time.process_time() - begin < 20


@pytest.mark.parametrize("declaration", ["<!DOCTYPE kml>", '<!DOCTYPE kml [<!ENTITY a "b">]>'])
def test_a_document_type_is_refused_beside_undeclared_prefixes(declaration: str) -> None:
    (problem,) = read(declaration + kml("<gx:a/>")).problems
    assert "has a document type" in str(problem)


# --- altitudes ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "frame"),
    [
        ("<altitudeMode>absolute</altitudeMode>", "amsl"),
        ("<gx:altitudeMode>relativeToGround</gx:altitudeMode>", "terrain"),
        ("<gx:altitudeMode>clampToSeaFloor</gx:altitudeMode>", ""),
        ("<altitudeMode>clampToGround</altitudeMode>", ""),
        ("<extrude>1</extrude><tessellate>1</tessellate>", ""),
    ],
)
def test_altitude_modes(mode: str, frame: str) -> None:
    assert found(read(kml(LINE.format("a", mode), GX))) == {"a": line(frame)}


def test_heights_above_the_sea_floor_are_refused() -> None:
    mode = "<gx:altitudeMode>relativeToSeaFloor</gx:altitudeMode>"
    (problem,) = read(kml(LINE.format("a", mode), GX)).problems
    assert "altitudeMode 'relativeToSeaFloor' is above the sea floor; one of" in str(problem)


def test_an_offset_of_altitudes_is_added() -> None:
    raised = LINE.format(
        "a", "<altitudeMode>absolute</altitudeMode><gx:altitudeOffset>-2.5</gx:altitudeOffset>"
    )
    assert found(read(kml(raised, GX)))["a"] == Route(((53.0, 7.0, 2.5), (54.0, 8.0, 3.5)), "amsl")


def test_a_line_without_an_altitude_at_some_positions_has_a_warning() -> None:
    body = LINE.format("a", "<altitudeMode>absolute</altitudeMode>").replace("54,6", "54")
    file = read(kml(body))
    assert found(file)["a"] == Route(((53.0, 7.0, 5.0), (54.0, 8.0, None)), "amsl")
    assert [str(each) for each in file.problems] == ["placemark 'a': has no altitude at position 2"]


def test_a_multitrack_gives_its_tracks_its_altitude_mode_unless_they_have_one() -> None:
    """The schema of `gx` has the mode at both; GDAL 3.12.4 gives it of neither."""
    own = "<altitudeMode>relativeToGround</altitudeMode>"
    tracks = "".join(
        f"<gx:Track>{mode}<gx:coord>7 53 9</gx:coord></gx:Track>" for mode in ("", own)
    )
    multi = f"<gx:MultiTrack><altitudeMode>absolute</altitudeMode>{tracks}</gx:MultiTrack>"
    file = read(kml(f"<Placemark><name>t</name>{multi}</Placemark>", GX))
    assert [each.geometry for each in file.geometries] == [
        Route(((53.0, 7.0, 9.0),), "amsl"),
        Route(((53.0, 7.0, 9.0),), "terrain"),
    ]


def test_an_empty_sample_of_a_track_is_left_out_with_a_warning() -> None:
    """GDAL 3.12.4 reads it as the place 0, 0, 0."""
    coords = "".join(f"<gx:coord>{text}</gx:coord>" for text in ("7 53 9", " ", "8 54 9"))
    mode = "<altitudeMode>absolute</altitudeMode>"
    file = read(
        kml(f"<Placemark><name>t</name><gx:Track>{mode}{coords}</gx:Track></Placemark>", GX)
    )
    assert found(file)["t"] == Route(((53.0, 7.0, 9.0), (54.0, 8.0, 9.0)), "amsl")
    (problem,) = file.problems
    assert problem.severity is Severity.WARNING
    assert str(problem) == "placemark 't': position 2: is empty, and left out"


# --- what is no line ----------------------------------------------------------------------------


def test_what_is_not_read_is_named() -> None:
    model = "<Placemark><name>m</name><Model><Location/></Model></Placemark>"
    change = "<Update><Change>" + LINE.format("b", "") + "</Change></Update>"
    body = f"{model}<GroundOverlay><name>g</name></GroundOverlay>{change}<gx:Tour/>"
    file = read(kml(LINE.format("a", "") + body, GX))
    assert found(file) == {"a": line()}
    assert [str(each) for each in file.problems] == [
        "placemark 'm': a Model is not read; give its place as a Point",
        "GroundOverlay 'g': is a picture, which is not read",
        "Update: its changes of other features are not made; save the changed features",
        "Tour: is a flight of the viewer's camera, which is not read",
    ]


@pytest.mark.parametrize("version", ["http://earth.google.com/kml/2.0", ""])
def test_documents_of_old_versions_and_without_a_namespace_are_read(version: str) -> None:
    declared = f'xmlns="{version}"' if version else ""
    body = LINE.format("a", "<altitudeMode>absolute</altitudeMode>")
    assert found(read(f"<kml {declared}><Folder>{body}</Folder></kml>")) == {"a": line("amsl")}


def test_a_geometry_without_altitudes_is_written_as_clamped_to_the_ground() -> None:
    way = ((53.0, 7.0, None), (54.0, 8.0, None))
    area = Area(((*way, (53.0, 8.0, None), way[0]),))
    for geometry in (Point(way[0]), Route(way), area):
        text = write_geometry_file(FileFormat.KML, [NamedGeometry("a", geometry)])
        assert b"<altitudeMode>clampToGround</altitudeMode>" in text
        assert found(read(text.decode())) == {"a": geometry}


# --- links within an archive --------------------------------------------------------------------


def link(href: str, element: str = "Link") -> str:
    return f"<NetworkLink><name>n</name><{element}><href>{href}</href></{element}></NetworkLink>"


def test_links_within_an_archive_are_followed_once_each() -> None:
    point = "<Placemark><name>{}</name><Point><coordinates>7,53</coordinates></Point></Placemark>"
    file = read(
        {
            "doc.kml": kml(link("sub/one%20two.kml") + link("http://example.org/x.kml")),
            "sub/one two.kml": kml(point.format("a") + link("../b.kml#view", "Url")),
            "b.kml": kml(point.format("b") + link("doc.kml") + link("b.kml")),
            "left.kml": kml(point.format("c")),
        }
    )
    place = Point((53.0, 7.0, None))
    assert found(file) == {"a": place, "b": place}
    assert [str(each) for each in file.problems] == [
        "NetworkLink 'n': what it refers to is not in this file; save that as a separate file",
        "left.kml: is not read: doc.kml does not link it; save it as a file",
    ]


def test_a_linked_document_that_is_damaged_is_an_error_of_that_document() -> None:
    file = read({"doc.kml": kml(LINE.format("a", "") + link("b.kml")), "b.kml": "<kml>"})
    assert found(file) == {"a": line()}
    (problem,) = file.problems
    assert str(problem).startswith("b.kml: is not XML")


def test_a_document_beyond_the_limit_of_positions_is_refused_before_it_is_read() -> None:
    places = "7,53 " * (MAX_POSITIONS + 1)
    file = read(kml(LINE.format("a", "").replace("7,53,5", places)))
    assert file.geometries == ()
    assert str(file.problems[0]).startswith("the file has more than 200,000 positions")
