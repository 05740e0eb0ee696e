"""A hook of mkdocs: links out of `docs` (to missions, examples, the README) have no page there."""

import re
from typing import Any

OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+[^)]*\)")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Keep the text of such a link alone; pages under `docs` link within it as they did."""
    if page.file.src_uri.startswith("reference/"):
        return markdown
    return OUTSIDE.sub(r"\1", markdown)
