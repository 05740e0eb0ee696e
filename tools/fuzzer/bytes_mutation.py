"""Damages files below the level of XML: their bytes, and what they are encoded in."""

from random import Random

_ENCODINGS = ("utf-16", "utf-16-le", "utf-32", "latin-1", "utf-8-sig", "cp1252", "utf-7", "cp037")
_DECLARED = ("utf-8", "UTF-16", "latin-1", "US-ASCII", "ebcdic", "utf-7", "idna", "nonsense", "")
_TOKENS = (
    b"<!DOCTYPE x [<!ENTITY a 'b'>]>",
    b"&a;",
    b"&#0;",
    b"&#10;",
    b"<![CDATA[",
    b"]]>",
    b"<!--",
    b"<?xml version='1.0'?>",
    b"\0",
    b"\xff\xfe",
    b"</process>",
    b"<",
    b"\r",
)


def encoded(data: bytes, dice: Random) -> bytes:
    """The text in another encoding, which its declaration names, or not."""
    text = data.decode("utf-8", "replace")
    if dice.random() < 0.7:
        text = f"<?xml version='1.0' encoding='{dice.choice(_DECLARED)}'?>\n{text}"
    return text.encode(dice.choice(_ENCODINGS), "xmlcharrefreplace")


def damaged(data: bytes, dice: Random) -> bytes:
    """The bytes with some of them changed, cut, repeated or put in."""
    found = bytearray(data)
    for _ in range(dice.choice((1, 1, 2, 5, 20))):
        if not found:
            break
        place = dice.randrange(len(found))
        length = dice.choice((1, 1, 10, 1000))
        match dice.randrange(4):
            case 0:
                found[place] = dice.randrange(256)
            case 1:
                del found[place : place + length]
            case 2:
                found[place:place] = found[place : place + length]
            case _:
                found[place:place] = dice.choice(_TOKENS)
    return bytes(found)
