# SPDX-License-Identifier: MIT
"""
What the tests of tests/torture tell of themselves, and the table of docs/robustness.md from it: for
each case what was tried, what must hold and what was measured on each platform.
"""
import json
import re
from pathlib import Path

HARD_CASE = "hard case"
TABLE = re.compile(r"(<!-- table (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


class HardCase:
    """
    One test on one platform. The first paragraph of its docstring says what is tried, the second
    what must hold.
    """

    def __init__(self, request):
        self.node = request.node
        paragraphs = [" ".join(text.split()) for text in request.function.__doc__.split("\n\n")]
        self.tried, self.holds = paragraphs[:2]
        self.area = request.path.stem.removeprefix("test_")
        parameters = dict(request.node.callspec.params) if hasattr(request.node, "callspec") else {}
        self.platform = parameters.pop("platformName", "") or ""
        self.variant = ", ".join(str(value) for value in parameters.values())
        self.long = request.config.getoption("long")
        self.measured = {}

    def measure(self, **values):
        """Numbers or words for the table, by name; of a number given again the larger one counts."""
        for name, value in values.items():
            previous = self.measured.get(name)
            self.measured[name] = value if previous is None else max(previous, value)

    def least(self, **values):
        """The same; of a number given again the smaller one counts."""
        for name, value in values.items():
            self.measured[name] = min(value, self.measured.get(name, value))

    def tell(self):
        told = {"area": self.area, "name": self.node.originalname, "tried": self.tried,
                "holds": self.holds, "platform": self.platform, "variant": self.variant,
                "measured": {name: asText(value) for name, value in self.measured.items()}}
        self.node.user_properties.append((HARD_CASE, json.dumps(told)))


def asText(value):
    return f"{value:.2g}" if isinstance(value, float) else str(value)


def writeTable(destination, reports):
    """
    Fill each `<!-- table AREA -->` of a Markdown file with what reports of teardowns tell of that
    area; a table of which none tells is left as it is.
    """
    path = Path(destination)
    areas = {}
    for report in reports:
        for title, text in report.user_properties:
            if title == HARD_CASE and report.when == "teardown":
                told = json.loads(text)
                areas.setdefault(told["area"], {}).setdefault(told["name"], []).append(told)

    def fill(match):
        cases = areas.get(match.group(2))
        return match.group(0) if not cases else match.group(1) + table(cases) + match.group(3)

    path.write_text(TABLE.sub(fill, path.read_text()))


def table(cases):
    lines = ["| tried | must hold | measured |", "|---|---|---|"]
    for told in cases.values():
        rows = [f"{where(row)}: " + ", ".join(f"{name} {value}" for name, value in row["measured"].items())
                for row in told]
        lines.append(f"| {told[0]['tried']} | {told[0]['holds']} | {'<br>'.join(rows)} |")
    return "\n".join(lines) + "\n"


def where(row):
    return " ".join(filter(None, (row["platform"], row["variant"])))
