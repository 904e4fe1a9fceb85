# SPDX-License-Identifier: MIT
"""The reference pages: every public module of openmmpse, the help of its commands, and a check that no public
name is left out."""

import contextlib
import inspect
import io
import os
import sys

import openmmpse
import plaindocstrings
from docutils import nodes
from docutils.statemachine import StringList
from publicnames import publicModules, publicNames
from sphinx.pycode import ModuleAnalyzer
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from openmmpse import __main__ as commandLine

LOGGER = logging.getLogger(__name__)
os.environ["COLUMNS"] = "88"  # of the help of commands
openmmpse.PSEBrownianIntegrator.__module__ = "openmmpse.binding"  # where autodoc finds the comments of constants


def commentOf(module, name):
    """What follows `#:` at the assignment of a constant, in a module or in those that it consists of."""
    parts = [module.__name__, *(key for key in sys.modules if key.startswith(module.__name__ + "."))]
    for part in parts:
        comments = ModuleAnalyzer.for_module(part).find_attr_docs()
        if ("", name) in comments:
            return comments["", name]
    return []


def entriesOf(moduleName, module):
    """Lines of reStructuredText for all that a module makes public: functions, classes, constants."""
    kinds = {"autoclass": [], "autofunction": [], "data": []}
    for name in module.__all__:
        value = getattr(module, name)
        kind = "autoclass" if inspect.isclass(value) else "autofunction" if callable(value) else "data"
        kinds[kind].append(name)
    lines = []
    for name in kinds["autofunction"]:
        lines += [f".. autofunction:: {moduleName}.{name}", ""]
    for name in kinds["autoclass"]:
        lines += [f".. autoclass:: {moduleName}.{name}", "   :members:", "   :undoc-members:", ""]
    for name in kinds["data"]:
        comment = plaindocstrings.reStructured(commentOf(module, name))
        lines += [f".. py:data:: {name}", f"   :value: {getattr(module, name)!r}", ""]
        lines += [*(f"   {line}" for line in comment), ""]
    return lines


class PublicModules(SphinxDirective):
    """`.. publicmodules::` all public modules but openmmpse itself, each with a heading of its own."""

    def run(self):
        found = []
        for name, module in publicModules().items():
            if name != "openmmpse":
                section = nodes.section(ids=[nodes.make_id(name)], names=[name])
                section += nodes.title("", "", nodes.literal(text=name))
                lines = [f".. automodule:: {name}", "   :no-members:", "", *entriesOf(name, module)]
                self.state.nested_parse(StringList(lines, source=name), 0, section)
                found.append(section)
        return found


class CommandHelp(SphinxDirective):
    """`.. commandhelp::` what `python -m openmmpse COMMAND --help` prints, for each command."""

    def run(self):
        found = []
        for name, (main, summary) in commandLine.COMMANDS.items():
            text = io.StringIO()
            with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
                main(["--help"])
            section = nodes.section(ids=[nodes.make_id(f"command-{name}")], names=[name])
            section += nodes.title("", "", nodes.literal(text=f"python -m openmmpse {name}"))
            section += nodes.paragraph("", summary[0].upper() + summary[1:] + ".")
            section += nodes.literal_block(text.getvalue(), text.getvalue(), language="none")
            found.append(section)
        return found


def checkThatAllIsThere(app, env):
    documented = set(env.domains["py"].objects)
    for name in sorted(publicNames() - documented):
        LOGGER.warning("%s is public, but the reference does not have it", name, type="reference")


def setup(app):
    app.add_directive("publicmodules", PublicModules)
    app.add_directive("commandhelp", CommandHelp)
    app.connect("env-check-consistency", checkThatAllIsThere)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
