# SPDX-License-Identifier: GPL-2.0-only
"""Formulas as MathML by docutils' own converter: no script, no font and no network is needed to read them."""

import inspect

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.util import logging

_LOG = logging.getLogger(__name__)
# docutils 0.20 renamed the option.
_BLOCK = {"as_block": True} if "as_block" in inspect.signature(latex2mathml.tex2mathml).parameters else {"inline": False}


def _convert(writer, node, options):
    """MathML of a node; a formula that the converter does not know is a warning, and shown as it was typed."""
    text = " ".join(node.astext().split())
    try:
        return latex2mathml.tex2mathml(text, **options).strip()
    except (SyntaxError, ValueError, AttributeError, IndexError, KeyError) as error:
        _LOG.warning("formula that docutils cannot convert to MathML: %s (%s)", text, error, location=node)
        return f"<code>{writer.encode(text)}</code>"


def visit_inline(writer, node):
    writer.body.append(_convert(writer, node, {}).replace("\n", ""))
    raise nodes.SkipNode


def visit_block(writer, node):
    writer.body.append(writer.starttag(node, "div", "", CLASS="math") + _convert(writer, node, _BLOCK) + "</div>\n")
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
