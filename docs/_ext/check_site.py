"""Checks of the finished site: links lead somewhere, nothing is loaded from another host, tutorials show their results.

``python docs/_ext/check_site.py build/docs`` prints what is wrong, one line each, and exits with 1 if anything is.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADING = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "audio": "src",
           "embed": "src", "object": "data"}
"""Elements that load a file as the page is shown, and the attribute with its address."""

PICTURES = {"paper_in_ten_figures": 10}
"""Least number of pictures on the page of a tutorial; 1 on the others. Each has a card, too."""

_LOADING_LINKS = {"stylesheet", "preload", "modulepreload", "icon", "shortcut icon", "preconnect", "dns-prefetch"}
_CSS_ADDRESS = re.compile(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)")


class Page(HTMLParser):
    """What a page links to, what it loads, and the anchors it has."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = {"", "top"}
        self._style = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note ids, links and what is loaded."""
        found = {name: value or "" for name, value in attrs}
        self.anchors.update(found[name] for name in ("id", "name") if name in found)
        self._style = tag == "style"
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in LOADING and found.get(LOADING[tag]):
            self.loaded.append(found[LOADING[tag]])
        if tag == "link" and found.get("rel", "") in _LOADING_LINKS:
            self.loaded.append(found.get("href", ""))
        self.loaded += css_addresses(found.get("style", ""))

    def handle_data(self, data: str) -> None:
        """Note what a style sheet within the page loads."""
        if self._style:
            self.loaded += css_addresses(data)

    def handle_endtag(self, tag: str) -> None:
        """A style sheet ends."""
        self._style = False


def css_addresses(text: str) -> list[str]:
    """The addresses in a style sheet; data within it left out."""
    found = (match[1] or match[2] for match in _CSS_ADDRESS.finditer(text))
    return [address for address in found if not address.startswith(("data:", "#"))]


def is_foreign(address: str) -> bool:
    """Whether an address is on another host."""
    return address.startswith("//") or bool(urlsplit(address).netloc)


def broken(site: Path, name: str, address: str, pages: dict[str, Page]) -> bool:
    """Whether an address on a page leads to a file or an anchor that does not exist."""
    parts = urlsplit(address)
    if parts.scheme or parts.netloc:
        return False
    target = (site / name).parent / unquote(parts.path) if parts.path else site / name
    target = target / "index.html" if target.is_dir() else target
    if not target.resolve().is_relative_to(site.resolve()) or not target.exists():
        return True
    page = pages.get(target.resolve().relative_to(site.resolve()).as_posix())
    return page is not None and unquote(parts.fragment) not in page.anchors


def unshown(name: str, html: str, page: Page) -> list[str]:
    """What the page of a tutorial does not show of what its cells return."""
    folder, _, file = name.rpartition("/")
    if folder != "tutorials" or file == "index.html":
        return []
    found, least = len({a for a in page.loaded if a.endswith(".png")}), PICTURES.get(file.removesuffix(".html"), 1)
    return [f"{name}: no card"] * ("gearchaos-card" not in html) + (
        [f"{name}: {found} pictures, not {least}"] if found < least else [])


def pages_of(site: Path) -> list[Path]:
    """The pages of a site; the theme's templates are none."""
    return [file for file in sorted(site.rglob("*.html")) if "_static" not in file.relative_to(site).parts]


def problems(site: Path) -> list[str]:
    """Everything that is wrong with the site in a folder, one line each."""
    files = {f.relative_to(site).as_posix(): f for f in pages_of(site)}
    texts = {name: file.read_text(encoding="utf-8") for name, file in files.items()}
    pages = {name: Page(html) for name, html in texts.items()}
    out = [] if pages else [f"{site}: no pages"]
    for name, page in pages.items():
        out += [f"{name}: loads {a}" for a in page.loaded if is_foreign(a)]
        out += unshown(name, texts[name], page)
        out += [f"{name}: {a} does not exist" for a in (*page.links, *page.loaded) if broken(site, name, a, pages)]
    for sheet in sorted(site.rglob("*.css")):
        addresses = css_addresses(sheet.read_text(encoding="utf-8"))
        out += [f"{sheet.relative_to(site)}: loads {a}" for a in addresses if is_foreign(a)]
    return out


def main() -> None:
    """Check the site in the folder named on the command line."""
    site = Path(sys.argv[1])
    found = problems(site)
    print(*found, sep="\n")
    links = sum(len(Page(f.read_text(encoding="utf-8")).links) for f in pages_of(site))
    print(f"{len(list(site.rglob('*.html')))} pages, {links} links, {len(found)} problems")
    raise SystemExit(1 if found else 0)


if __name__ == "__main__":
    main()
