# SPDX-License-Identifier: MIT
"""Docstrings are written to be read in a terminal: formulas with bars and stars, and code below a line that ends with
a colon. Here they become reStructuredText; sections of parameters are left to napoleon."""

import re

CODE = re.compile(r"(``.+?``|`[^`]+`)")
MARKUP = re.compile(r"([|*]|(?<=\w)_(?!\w))")


def indentOf(line):
    return len(line) - len(line.lstrip())


def escaped(line):
    """Bars, stars and underscores at the end of words as they are; `code` keeps what is in it."""
    return "".join(part if CODE.fullmatch(part) else MARKUP.sub(r"\\\1", part) for part in CODE.split(line))


def reStructured(lines):
    """The lines of a plain docstring with its blocks of code marked and everything else escaped."""
    result, indent = [], None  # indent of the line above a block of code
    for number, line in enumerate(lines):
        if indent is not None and line.strip() and indentOf(line) <= indent:
            indent = None
        if indent is not None:
            result.append(line)
            continue
        below = next((other for other in lines[number + 1 :] if other.strip()), "")
        if line.rstrip().endswith(":") and indentOf(below) > indentOf(line):
            indent = indentOf(line)
            result += [escaped(line.rstrip()) + ":", ""]
        else:
            result.append(escaped(line))
    return result


def setup(app):
    constants = {}

    def process(app, what, name, obj, options, lines):
        lines[:] = reStructured(lines)
        if what in ("attribute", "data"):
            constants[name] = list(lines)

    def restore(app, what, name, obj, options, lines):
        """Napoleon takes what stands before a colon for a type."""
        if what in ("attribute", "data"):
            lines[:] = constants[name]

    app.connect("autodoc-process-docstring", process, priority=100)  # before napoleon
    app.connect("autodoc-process-docstring", restore, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
