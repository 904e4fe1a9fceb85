# SPDX-License-Identifier: MIT
"""The targets of speed and memory: what was measured beside what must be met and what is aimed at."""
import argparse

from common import CYCLE, STYLE, markdown, panels, plainTicks, plt, save

import reach  # common has put its folder on the path

NAME = "targets"


def measure(effort):
    options = argparse.Namespace(quick=effort.quick, rounds=3 if effort.quick else 9, program=reach.PROGRAM)
    rows = []
    for name in reach.ROWS:
        if name in reach.NEED_PROGRAM and not options.program.exists():
            raise FileNotFoundError(f"{options.program} is missing; build it with ./run bench")
        rows += reach.measured(name, options)
    return [{key: row[key] for key in ("what", "must", "aim", "measured", "lowest", "highest", "byCpu", "others")}
            | {"less_is_better": int(reach.TARGETS[row["row"]][3])} for row in rows]


def score(row, value):
    """How many times as good as it must be."""
    return row["must"]/value if row["less_is_better"] else value/row["must"]


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (axes,) = panels(1, width=9.5, height=0.42*len(rows) + 1.3)
        for y, row in enumerate(reversed(rows)):
            axes.barh(y, score(row, row["measured"]), color=CYCLE[0], height=0.6, label="measured" if y == 0 else None)
            axes.plot([score(row, row["aim"])]*2, [y - 0.4, y + 0.4], color=CYCLE[1], linewidth=2.5,
                      label="aim" if y == 0 else None)
        axes.axvline(1, color="#444444", linewidth=1.2, label="must")
        axes.set(yticks=range(len(rows)), yticklabels=[row["what"] for row in reversed(rows)],
                 xlabel="times as good as it must be")
        axes.set_xscale("log")
        plainTicks(axis=axes.xaxis)
        axes.grid(False, axis="y")
        axes.legend(loc="upper right")
        save(figure, path)


def table(rows):
    return markdown(
        ["what", "must", "aim", "measured", "spread", "by processor time", "taken by others"],
        [[r["what"], reach.number(r["must"]), reach.number(r["aim"]), reach.number(r["measured"]),
          f"{reach.number(r['lowest'])} .. {reach.number(r['highest'])}",
          reach.number(r["byCpu"]) if r["byCpu"] not in (None, "") else "", f"{r['others']:.0%}"] for r in rows],
    )
