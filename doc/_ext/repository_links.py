# SPDX-License-Identifier: GPL-2.0-only
"""Links and pictures as a view of the repository's files resolves them: relative to the file that holds them.

A link to a file that is a page leads to the page, one to any other file to a copy of it. A link to a folder becomes its text.
A target that does not exist is a warning, and its link becomes text.
"""

import os
import pathlib
import posixpath
import re
import urllib.parse

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.util import logging

_LOG = logging.getLogger(__name__)
_ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:|//|#|$", re.I)


class RepositoryLinks(SphinxTransform):
    """Before MyST resolves links and Sphinx collects pictures and files."""

    default_priority = 5

    def apply(self, **_):
        self.pages = self.config.repository_pages
        self.root = pathlib.Path(self.config.repository_root)
        origin = next((path for path, name in self.pages.items() if name == self.env.docname), None)
        if origin is None:  # a page that is written while the site is built
            return
        self.folder = posixpath.dirname(origin)
        for node in list(self.document.findall(lambda node: isinstance(node, (nodes.reference, nodes.image, addnodes.download_reference))
                                               or (isinstance(node, addnodes.pending_xref) and node.get("reftype") == "myst"))):
            key = "uri" if isinstance(node, nodes.image) else "refuri" if isinstance(node, nodes.reference) else "reftarget"
            target = urllib.parse.unquote(node.get(key, ""))
            if not _ELSEWHERE.match(target):
                self.resolve(node, target)

    def resolve(self, node, target):
        path, _, anchor = target.partition("#")
        path = posixpath.normpath(posixpath.join(self.folder, path))
        if path.startswith("../") or not (self.root / path).exists():
            _LOG.warning("no file '%s' in the repository; links and pictures are relative to the folder of the file that holds them",
                         target, location=node)
            node.replace_self(nodes.inline("", "", *node.children))
            return
        from_sources = "/" + os.path.relpath(self.root / path, self.env.srcdir)
        if isinstance(node, nodes.image):
            node["uri"] = from_sources
            return
        if (self.root / path).is_dir():
            path = next((name for name in (f"{path}/README.md", f"{path}/index.rst") if name in self.pages), path)
        children = list(node.children)
        if path in self.pages:
            uri = self.app.builder.get_relative_uri(self.env.docname, self.pages[path]) + ("#" + anchor if anchor else "")
            new = nodes.reference("", "", *children, refuri=uri, internal=True)
        elif (self.root / path).is_dir():
            new = nodes.inline("", "", *children)
        else:
            new = addnodes.download_reference("", "", *children, refdoc=self.env.docname, reftarget=from_sources)
        node.replace_self(new)


def setup(app):
    app.add_config_value("repository_root", "", "env")
    app.add_config_value("repository_pages", {}, "env")  # path in the repository: name of the page
    app.add_transform(RepositoryLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
