"""`python -m tools.draw FILE` writes the notation on standard input as a drawn BPMN file.

`--again FILE...` lays out files anew that are there: after elements were added by hand.
"""

import argparse
import sys
from pathlib import Path

from lxml import etree

from tests.engine.notation import xml
from tools.draw.diagram import draw


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tools.draw", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--again", action="store_true", help="draw files anew that are there")
    asked = parser.parse_args()
    if not asked.again and len(asked.files) != 1:
        parser.error("one file is written from standard input; say --again to redraw several")
    for file in asked.files:
        try:
            text = file.read_bytes() if asked.again else _standard_input()
            drawn = draw(text)
        except (ValueError, etree.XMLSyntaxError) as error:
            print(f"{file}: {error}", file=sys.stderr)
            return 1
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(drawn)
    return 0


def _standard_input() -> bytes:
    text = sys.stdin.read()
    return (text if text.lstrip().startswith("<?xml") else xml(text)).encode()


if __name__ == "__main__":
    sys.exit(main())
