"""In: the folder of a built book, the address of the repository. Out: links to README pages and to files outside the
book set right; a failure for every link to a page, picture or heading that is not there.

mdBook writes a chapter README.md as index.html and leaves links to it alone. Files outside docs/ are not in the book:
links to them lead to the repository.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
# print.html has all pages in one, with the links of each; 404.html is served at any address.
SKIPPED = {"404.html", "print.html", "toc.html"}


class Page(HTMLParser):
    """The headings that a page has and the addresses that it links to."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        named = dict(attrs)
        self.ids.update(named[key] for key in ("id", "name") if named.get(key))
        self.links.extend(named[key] for key in ("href", "src") if named.get(key))


def mended(path, book, repository):
    """A page's text with the links to README pages and to files outside the book set right."""

    def link(match):
        address = match.group(2)
        parts = urlsplit(address)
        if parts.scheme or parts.netloc or not parts.path:
            return match.group(0)
        heading = f"#{parts.fragment}" if parts.fragment else ""
        to = (path.parent / parts.path).resolve()
        if to.name == "README.html" and not to.exists() and to.with_name("index.html").exists():
            return f'{match.group(1)}"{address.replace("README.html", "index.html", 1)}"'
        # docs/ became the book's root.
        source = (ROOT / "docs" / path.parent.relative_to(book) / parts.path).resolve()
        source = source if source.exists() else source.with_suffix(".md")
        if book not in to.parents and source.exists() and ROOT in source.parents:
            return f'{match.group(1)}"{repository}/blob/main/{source.relative_to(ROOT)}{heading}"'
        return match.group(0)

    return re.sub(r'(href=)"([^"]*)"', link, path.read_text(encoding="utf-8"))


def missing(book):
    """(page, link) of each link within the book that leads nowhere, and the number of links."""
    pages = {p.resolve(): Page(p) for p in book.rglob("*.html")}
    wrong, count = [], 0
    for path, page in pages.items():
        if path.name in SKIPPED:
            continue
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            to = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            there = to.exists() and book in to.parents
            heading = unquote(parts.fragment)
            if not there or (heading and to in pages and heading not in pages[to].ids):
                wrong.append((path.relative_to(book), link))
    return wrong, count


def main():
    book, repository = Path(sys.argv[1]).resolve(), sys.argv[2].rstrip("/")
    for path in book.rglob("*.html"):
        path.write_text(mended(path, book, repository), encoding="utf-8")
    wrong, count = missing(book)
    for page, link in wrong:
        print(f"{page}: {link} leads nowhere in the book", file=sys.stderr)
    if wrong or count < 100:
        sys.exit(f"{len(wrong)} of {count} links of the book lead nowhere (at least 100 links are expected)")
    print(f"{count} links of the book lead somewhere")


main()
