# SPDX-License-Identifier: MIT
"""Docstrings are written to be read in a terminal: formulas with bars and stars, code that is indented, names with
their meaning beside them in columns. Here they become reStructuredText; sections of parameters are left to napoleon."""

import re

CODE = re.compile(r"(``.+?``|`[^`]+`)")
MARKUP = re.compile(r"([|*]|(?<=\w)_(?!\w))")
COLUMNS = re.compile(r"\s*\S+(?: \S+)*? {2,}(?=\S)")


def indentOf(line):
    return len(line) - len(line.lstrip())


def escaped(line):
    """Bars, stars and underscores at the end of words as they are; `code` keeps what is in it."""
    return "".join(part if CODE.fullmatch(part) else MARKUP.sub(r"\\\1", part) for part in CODE.split(line))


def definitions(lines):
    """A paragraph of names with their meaning beside them as a definition list; nothing if it is not one."""
    columns = [match.end() for match in map(COLUMNS.match, lines) if match]
    if not columns or indentOf(lines[0]) == min(columns):
        return None
    column, indent, result = min(columns), indentOf(lines[0]), []
    for line in lines:
        name, text = line[:column].strip(), line[column:].strip()
        if indentOf(line) == indent and not line[column - 2 : column].strip():
            result += [f"{' ' * indent}``{name}``", f"{' ' * indent}    {escaped(text)}"]
        elif indentOf(line) == indent and line is not lines[0]:  # a name wider than its column
            result.append(f"{' ' * indent}``{line.strip()}``")
        elif indentOf(line) >= column and result:
            result.append(f"{' ' * indent}    {escaped(text)}")
        else:
            return None
    return result


def paragraphs(lines):
    """[lines between blank ones]"""
    found = [[]]
    for line in lines:
        if line.strip():
            found[-1].append(line)
        elif found[-1]:
            found.append([])
    return [paragraph for paragraph in found if paragraph]


def withCode(paragraph):
    """Running text; what is indented below a line that ends with a colon is code."""
    result, indent = [], None  # of the line above the code
    for line, below in zip(paragraph, [*paragraph[1:], ""]):
        if indent is not None and indentOf(line) > indent:
            result.append(line)
            continue
        if indent is not None:
            result.append("")
        indent = None
        if line.endswith(":") and indentOf(below) > indentOf(line):
            indent = indentOf(line)
            result += [escaped(line) + ":", ""]
        else:
            result.append(escaped(line))
    return result


def reStructured(lines):
    """The lines of a plain docstring with its code and columns marked and everything else escaped."""
    result, outer = [], 0  # indent of the text around a block of code
    for paragraph in paragraphs(line.rstrip() for line in lines):
        indent = indentOf(paragraph[0])
        if result and indent > outer:
            result += [*([" " * outer + "::", ""] if not inCode(result, outer) else []), *paragraph, ""]
            continue
        outer = indentOf(paragraph[-1])
        result += [*(definitions(paragraph) or withCode(paragraph)), ""]
    return result


def inCode(result, outer):
    """Whether the last line that is not indented announces code."""
    return next(line for line in reversed(result) if line.strip() and indentOf(line) <= outer).endswith("::")


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
