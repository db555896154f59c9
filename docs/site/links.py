"""The links of a site: each leads to a page and a place that are there, and nothing is loaded from elsewhere."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a browser fetches by itself, by element.
LOADED = {"script": "src", "link": "href", "img": "src", "iframe": "src", "source": "src"}
# Of these `link` nothing is fetched.
NAMED_ONLY = {"canonical", "next", "prev", "author", "alternate"}


class Page(HTMLParser):
    """The links of a page with what they are for, and the names of its places."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[tuple[str, bool]] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take what an element links to, and its name."""
        given = dict(attrs)
        self.places |= {given[key] for key in ("id", "name") if given.get(key)}
        key = LOADED.get(tag, "href" if tag == "a" else None)
        if key and given.get(key):
            loads = tag in LOADED and not NAMED_ONLY & set((given.get("rel") or "").split())
            self.links.append((given[key], loads))


def broken_links(site: Path) -> list[str]:
    """Return what is wrong with the links of all pages below a folder, as `page: link: why`."""
    pages = {path: Page(path.read_text(encoding="utf-8", errors="replace")) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        for link, loads in page.links:
            why = _wrong(link, loads, path, pages)
            if why and path.name != "404.html":
                found.append(f"{path.relative_to(site)}: {link}: {why}")
    return found


def _wrong(link: str, loads: bool, path: Path, pages: dict[Path, Page]) -> str:
    parts = urlsplit(link)
    if parts.scheme == "data" or (parts.scheme in ("http", "https", "mailto") and not loads):
        return ""
    if parts.scheme or parts.netloc:
        return "loaded from elsewhere" if loads else "neither a page of the site nor of the web"
    if parts.path.startswith("/"):
        return "an absolute path"
    target = path if not parts.path else Path(str(path.parent.joinpath(unquote(parts.path)).resolve()))
    if target.is_dir():
        target = target / "index.html"
    if not target.is_file():
        return "not there"
    place = unquote(parts.fragment)
    if place and target in pages and place not in pages[target].places:
        return "no such place"
    return ""
