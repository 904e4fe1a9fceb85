# SPDX-License-Identifier: MIT
"""
What the tests of tests/torture measure, and the tables of docs/robustness.md from it. A run is kept, case by
case and platform by platform, in a file beside the page; what is said of a case comes from its docstring.
"""
import ast
import json
import math
import numbers
import operator
import re
from dataclasses import dataclass
from pathlib import Path

from platformnames import NAMES

HARD_CASE = "hard case"
SPLIT_OVER = "chunk" # the parameter of a test whose parts make one row
FOLDER = Path(__file__).parent / "torture"
FILL = re.compile(r"(<!-- (overview|table \S+) -->\n).*?(<!-- end -->)", re.DOTALL)


# ---------------------------------------------------------------- measuring

BOTH = {"larger": max, "smaller": min, "total": operator.add}


def isNumber(value):
    return not isinstance(value, float) or math.isfinite(value)


def together(how, *values):
    """Of two values; one that is not finite stays, whatever the other."""
    return next((value for value in values if not isNumber(value)), None) or BOTH[how](*values)


class HardCase:
    """One test on one platform, in one variant."""

    def __init__(self, request):
        self.node = request.node
        self.area = request.path.stem.removeprefix("test_")
        parameters = dict(request.node.callspec.params) if hasattr(request.node, "callspec") else {}
        self.platform = parameters.pop("platformName", "") or ""
        parameters.pop(SPLIT_OVER, None)
        self.variant = ", ".join(value if isinstance(value, str) else f"{name} = {value:.4g}"
                                 for name, value in parameters.items())
        self.long = request.config.getoption("long")
        self.measured = {}

    def measure(self, **values):
        """Numbers or words for the table, by name; of a number given again the larger one counts."""
        self.keep("larger", values)

    def least(self, **values):
        """The same; of a number given again the smaller one counts."""
        self.keep("smaller", values)

    def add(self, **values):
        """The same; numbers given again are added up, also those of all parts of a test that is split."""
        self.keep("total", values)

    def keep(self, how, values):
        for name, value in values.items():
            if isinstance(value, numbers.Real):
                value = int(value) if isinstance(value, numbers.Integral) else float(value)
            if name in self.measured:
                value = together(how, self.measured[name][1], value)
            self.measured[name] = how, value
            assert isNumber(value), f"{name} is {value}"

    def tell(self):
        told = {"area": self.area, "case": self.node.originalname, "platform": self.platform,
                "variant": self.variant, "form": "long" if self.long else "short",
                "order": self.node.session.items.index(self.node), "measured": self.measured}
        self.node.user_properties.append((HARD_CASE, json.dumps(told)))


# ---------------------------------------------------------------- what was measured

def identity(row):
    return row["area"], row["case"], row["platform"], row["variant"]


def rowsOf(reports, failed=()):
    """Rows in the order of their tests, from reports of teardowns, whatever the order of these."""
    told = [json.loads(text) | {"failed": report.nodeid in failed} for report in reports
            for title, text in report.user_properties if title == HARD_CASE and report.when == "teardown"]
    rows = {}
    for part in sorted(told, key=lambda part: part.pop("order")):
        row = rows.setdefault(identity(part), part)
        if row is not part:
            row["failed"] |= part["failed"]
            for name, (how, value) in part["measured"].items():
                known = row["measured"].get(name)
                row["measured"][name] = how, value if known is None else together(how, known[1], value)
    for row in rows.values():
        row["measured"] = {name: shortened(value) for name, (_, value) in row["measured"].items()}
    return list(rows.values())


def shortened(value):
    return float(f"{value:.3g}") if isinstance(value, float) else value


def described(row):
    """A line about it."""
    where = " ".join(filter(None, (row["area"], row["case"], row["platform"], row["variant"])))
    return f"{where}: " + ", ".join(f"{name} {asText(value)}" for name, value in row["measured"].items())


def asText(value):
    if isinstance(value, float) and 100 <= abs(value) < 1e5:
        return f"{float(f'{value:.2g}'):.0f}"
    return f"{value:.2g}" if isinstance(value, float) else str(value)


def readRows(page):
    file = Path(page).with_suffix(".json")
    return json.loads(file.read_text()) if file.exists() else []


def keepRows(page, rows):
    """Beside a page: the rows take the place of all that was known of their cases on their platforms."""
    def place(row):
        return row["area"], row["case"], row["platform"]

    new = {place(row) for row in rows}
    kept = [row for row in readRows(page) if place(row) not in new] + rows
    lines = ",\n".join(json.dumps(row) for row in sorted(kept, key=lambda row: (place(row)[:2], rank(row["platform"]))))
    Path(page).with_suffix(".json").write_text(f"[\n{lines}\n]\n")


# ---------------------------------------------------------------- the page

@dataclass(frozen=True)
class Case:
    """A test: the first paragraph of its docstring says what is tried, the second what must hold."""
    area: str
    name: str
    tried: str
    holds: str

    @property
    def title(self):
        words = re.sub(r"([A-Z])", lambda match: " " + match[1].lower(), self.name.removeprefix("test")).strip()
        return words[0].upper() + words[1:]


def casesOf(area):
    """As they stand in the file of the tests of an area."""
    cases = []
    for node in ast.parse((FOLDER/f"test_{area}.py").read_text()).body:
        isTest = isinstance(node, ast.FunctionDef) and node.name.startswith("test")
        if isTest and "hardCase" in [argument.arg for argument in node.args.args]:
            tried, holds = [" ".join(text.split()) for text in ast.get_docstring(node).split("\n\n")][:2]
            cases.append(Case(area, node.name, tried, holds))
    return cases


def rank(platform):
    return NAMES.index(platform) if platform in NAMES else -1


def platformsOf(rows):
    return sorted({row["platform"] for row in rows}, key=rank)


def writePage(page):
    page = Path(page)
    page.write_text(filled(page.read_text(), readRows(page)))


def filled(text, rows):
    """A page with each `<!-- table AREA -->` and the `<!-- overview -->` filled from all rows."""
    areas = re.findall(r"<!-- table (\S+) -->", text)
    known = {area: [(case, [row for row in rows if (row["area"], row["case"]) == (area, case.name)])
                    for case in casesOf(area)] for area in areas}

    def fill(match):
        kind, _, area = match[2].partition(" ")
        made = overview(known) if kind == "overview" else "\n".join(block(*case) for case in known[area])
        return match[1] + made + "\n" + match[3]

    return FILL.sub(fill, text)


def lines(header, alignments, cells):
    return [f"| {' | '.join(row)} |" for row in (header, alignments, *cells)]


def overview(known):
    platforms = [name for name in platformsOf([row for cases in known.values() for _, rows in cases for row in rows])
                 if name]
    cells = []
    for area, cases in known.items():
        rows = [row for _, rows in cases for row in rows]
        worst = {platform: [value for row in rows if row["platform"] == platform
                            for name, value in row["measured"].items() if name.endswith(("/tolerance", "/allowed"))]
                 for platform in platforms}
        drawn = [row["measured"] for row in rows if "scenes" in row["measured"]]
        cells.append([
            f"[{area.capitalize()}](#{area})" if area != "fuzz" else "[Random scenes](#random-scenes)", str(len(cases)),
            *(asText(max(worst[platform])) if worst[platform] else "" for platform in platforms),
            f"{sum(row['scenes refused'] for row in drawn)} of {sum(row['scenes'] for row in drawn)}" if drawn else "",
            " and ".join(sorted({row["form"] for row in rows}, reverse=True)),
            ", ".join(sorted({str(row["seed"]) for row in drawn})) or "fixed",
            str(sum(row["failed"] for row in rows) or "none")])
    return "\n".join(lines(["area", "cases", *platforms, "scenes refused", "form", "seed", "failed"],
                           ["---", "---:", *["---:"]*len(platforms), "---:", "---", "---", "---"], cells))


def block(case, rows):
    """A case folded: two sentences and a table whose columns are platforms; words are told below it."""
    platforms = platformsOf(rows)
    quantities = list(dict.fromkeys((row["variant"], name) for row in rows for name, value in row["measured"].items()
                                    if not isinstance(value, str)))
    order = list(dict.fromkeys(variant for variant, _ in quantities))
    quantities.sort(key=lambda quantity: order.index(quantity[0]))
    cells, shown = [], None
    for variant, name in quantities:
        values = {row["platform"]: row["measured"].get(name, "") for row in rows if row["variant"] == variant}
        cells.append([variant if variant != shown else "", name,
                      *(asText(values.get(platform, "")) for platform in platforms)])
        shown = variant
    first = 0 if any(order) else 1
    header = ["variant", "measured", *(platform or "value" for platform in platforms)]
    table = lines(header[first:], ["---", "---", *["---:"]*len(platforms)][first:], [row[first:] for row in cells])
    words = told(rows) + [f"- **Failed:** {' '.join(filter(None, (row['platform'], row['variant'])))}" for row in rows
                          if row["failed"]]
    return "\n".join(["<details>", f"<summary>{case.title}</summary>", "", f"*Tried:* {case.tried}", "",
                      f"*Must hold:* {case.holds}", *(["", *table] if cells else []), *(["", *words] if words else []),
                      "", "</details>", ""])


def told(rows):
    """Messages and the like; what all platforms say alike is said once."""
    said = {}
    for row in rows:
        for name, value in row["measured"].items():
            if isinstance(value, str):
                where = said.setdefault((row["variant"], name, value), [])
                where.append(row["platform"])
    everywhere = platformsOf(rows)
    return [f"- {' '.join(filter(None, (variant, name)))}"
            f"{'' if sorted(where, key=rank) == everywhere else ' (' + ', '.join(where) + ')'}: {value}"
            for (variant, name, value), where in said.items()]


if __name__ == "__main__": # the page from docstrings and the numbers that are there
    writePage(Path(__file__).resolve().parents[1]/"docs"/"robustness.md")
