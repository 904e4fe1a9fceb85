# SPDX-License-Identifier: MIT
"""Links that the pages need not spell out: from the tag of an equation, [T7], to the section with that tag in its
heading, and from the name of a page, `flow.md` or docs/flow.md, to the page, by its title."""

import re

from docutils import nodes
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util import logging

TAG = re.compile(r"\[([AT]\d+)\]")
PAGE = re.compile(r"(?:docs/)?([\w-]+)\.md")
MENTION = re.compile(r"(\[[AT]\d+\]|\bdocs/[\w-]+\.md)")  # in running text, where a bare name of a file is no page
LOGGER = logging.getLogger(__name__)
KEY = "theory tags"


def collectTags(app, doctree):
    """Remember which section of the document at hand each tag in a heading belongs to."""
    places = app.env.metadata[app.env.docname].setdefault(KEY, {})
    for section in doctree.findall(nodes.section):
        for tag in TAG.findall(section[0].astext()):
            places[tag] = section["ids"][0]


class CrossLinks(SphinxPostTransform):
    """Replaces mentions; headings, code and what is a link already stay as they are."""

    default_priority = 20

    def run(self, **options):
        self.places = {
            tag: (name, anchor)
            for name, metadata in self.env.metadata.items()
            for tag, anchor in metadata.get(KEY, {}).items()
        }
        for literal in list(self.document.findall(nodes.literal)):
            link = self.linkToPage(literal.astext())
            if link and not self.isInside(literal.parent, nodes.title, nodes.reference):
                literal.parent.replace(literal, link)
        fixed = (nodes.title, nodes.literal, nodes.literal_block, nodes.math, nodes.math_block, nodes.reference)
        for text in list(self.document.findall(nodes.Text)):
            if MENTION.search(text) and not self.isInside(text, *fixed):
                text.parent.replace(text, [self.replaced(part, text) for part in MENTION.split(text) if part])

    @staticmethod
    def isInside(node, *kinds):
        while node is not None:
            if isinstance(node, kinds):
                return True
            node = node.parent
        return False

    def replaced(self, part, text):
        tag = TAG.fullmatch(part)
        return (self.linkToTag(tag[1], text) if tag else self.linkToPage(part)) or nodes.Text(part)

    def linkToTag(self, tag, text):
        if tag not in self.places:
            if any(tag[0] == other[0] for other in self.places):
                LOGGER.warning("no section has [%s] in its heading", tag, location=text.parent, type="crosslinks")
            return None
        document, anchor = self.places[tag]
        return self.link(f"{self.addressOf(document)}#{anchor}", nodes.Text(f"[{tag}]"))

    def linkToPage(self, text):
        page = PAGE.fullmatch(text)
        if not page or page[1] not in self.env.found_docs:
            return None
        return self.link(self.addressOf(page[1]), nodes.emphasis("", self.env.titles[page[1]].astext()))

    def addressOf(self, document):
        return self.app.builder.get_relative_uri(self.env.docname, document)

    @staticmethod
    def link(address, content):
        return nodes.reference("", "", content, internal=True, refuri=address)


def setup(app):
    app.connect("doctree-read", collectTags)
    app.add_post_transform(CrossLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
