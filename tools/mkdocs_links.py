"""A hook of mkdocs: files out of `docs` that pages link to (missions, READMEs) go into the site."""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

LINK = re.compile(r"(?<=\]\()((?:\.\./)+[^)#\s]+)")
FOLDER = "repository"


def on_files(files: Any, config: Any) -> Any:
    """Add each file that a page links to. Markdown goes in as text: its links lead elsewhere."""
    root = Path(config.config_file_path).parent
    for page in list(files.documentation_pages()):
        for link in LINK.findall(page.content_string):
            target = _outside(page.src_uri, link)
            uri = _uri(target) if target else ""
            if target and files.get_file_from_path(uri) is None:
                files.append(File.generated(config, uri, abs_src_path=str(root / target)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Let links out of `docs` lead to the files in the site."""

    def rewritten(found: re.Match[str]) -> str:
        target = _outside(page.file.src_uri, found[1])
        here = posixpath.dirname(page.file.src_uri) or "."
        return posixpath.relpath(_uri(target), here) if target else found[1]

    return LINK.sub(rewritten, markdown)


def _outside(page: str, link: str) -> str:
    """The path of a link's target in the repository; "" if it is a page of the documentation."""
    target = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), link))
    return "" if target.startswith("docs/") else target


def _uri(target: str) -> str:
    return f"{FOLDER}/{target}{'.txt' if target.endswith('.md') else ''}"
