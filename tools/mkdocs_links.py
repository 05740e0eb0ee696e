"""A hook of mkdocs: files out of `docs` that pages link to go into the site, Markdown as pages.

`X` of the repository is `repository/X` of the site. The READMEs of the project and of the examples
are written for readers of the repository; their links lead to the same files here.
"""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

LINK = re.compile(r"(?<=\]\()(?!\w+:)([^)#\s]+)")
FOLDER = "repository"


def on_files(files: Any, config: Any) -> Any:
    """Add each file of the repository that a page links to, and those that such a page links to."""
    root = Path(config.config_file_path).parent
    pages = list(files.documentation_pages())
    while pages:
        page = pages.pop()
        for link in LINK.findall(page.content_string):
            target = _target(page.src_uri, link)
            uri = _uri(target)
            if files.get_file_from_path(uri) is None and (root / target).is_file():
                file = File.generated(config, uri, abs_src_path=str(root / target))
                files.append(file)
                pages += [file] if file.is_documentation_page() else []
    return files


def on_page_markdown(markdown: str, page: Any, files: Any, **_: Any) -> str:
    """Let links between files of the repository lead to these files in the site."""
    here = posixpath.dirname(page.file.src_uri) or "."

    def rewritten(found: re.Match[str]) -> str:
        uri = _uri(_target(page.file.src_uri, found[1]))
        inside = files.get_file_from_path(uri) is not None
        return posixpath.relpath(uri, here) if inside else found[1]

    return LINK.sub(rewritten, markdown)


def _target(page: str, link: str) -> str:
    """The path in the repository of what a page of the site links to."""
    path = page.removeprefix(f"{FOLDER}/") if page.startswith(f"{FOLDER}/") else f"docs/{page}"
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), link))


def _uri(target: str) -> str:
    """The path in the site of a file of the repository."""
    return target.removeprefix("docs/") if target.startswith("docs/") else f"{FOLDER}/{target}"
