# SPDX-License-Identifier: GPL-2.0-only
"""What Sphinx does not look at in a site that it has written: anchors, and what would be loaded from elsewhere."""

import html.parser
import pathlib
import re
import urllib.parse

_LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("video", "src"), ("object", "data")}
_CSS = re.compile(r"url\(\s*[\"']?([^\"')]+)")


class _Page(html.parser.HTMLParser):
    """Names of anchors, and (address, is it loaded with the page) of links."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = {""}, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value)
            elif (tag, name) in _LOADED or (tag == "a" and name == "href"):
                self.links.append((value or "", (tag, name) in _LOADED))


def faults(folder):
    """One line for each link, picture, script or font of the pages in a folder that does not lead to something in it."""
    folder = pathlib.Path(folder).resolve()
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    found = [fault for path, page in pages.items() for link, loaded in page.links for fault in _fault(folder, pages, path, link, loaded)]
    for path in sorted(folder.rglob("*.css")):
        for link in _CSS.findall(path.read_text(encoding="utf-8")):
            found += _fault(folder, {}, path, link, True)
    return found


def _fault(folder, pages, path, link, loaded):
    address = urllib.parse.urlsplit(link)
    where = f"{path.relative_to(folder)}: '{link}'"
    if address.scheme == "data":
        return
    if address.scheme or address.netloc:
        if loaded:
            yield f"{where} is loaded from elsewhere"
        elif address.scheme not in ("https", "http", "mailto"):
            yield f"{where} is no link that works on a host"
        return
    if address.path.startswith("/"):
        yield f"{where} is no relative link"
        return
    target = (path.parent / urllib.parse.unquote(address.path)).resolve() if address.path else path
    if folder not in target.parents or not target.is_file():
        yield f"{where} leads to no file"
    elif target in pages and urllib.parse.unquote(address.fragment) not in pages[target].anchors:
        yield f"{where} names no anchor of that page"
