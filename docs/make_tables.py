"""Write docs/tables.md from the schemas; ``make tables`` runs it and a test checks that the page is current."""

from __future__ import annotations

from pathlib import Path

from wentry_cli.schemas import STATUS_WORDS, TABLES

PAGE = Path(__file__).parent / "tables.md"

FIGURES = """## figures/*.csv
Beside every picture `wentry report` writes the table that it is drawn from, under the same name, so that a figure can
be made again elsewhere. Units are suffixes (`t_ms`, `y_mm`); without one, it is 1 (`t_over_tp`, `speed_over_u0`).

| column | meaning |
|---|---|
| `series` | what the row belongs to: `measured`, `experiment`, `model`, a fit, a value of the paper, a band of \
theory, `moment` (a vertical line) |
| `part` | panel of a drop's sheet (`drop_*.csv`): position, stretch, velocity, acceleration |
| `drop`, `repeats` | the drop, or those of one condition that the row is the mean of, and how many they are |
| `rigid`, `g_inf_pa`, `diameter_m`, `seal_type`, `period` | what colour, size and symbol say |
| the others | the axes of the picture; `_unc` is the standard uncertainty, of repeated drops the spread; `_low` and \
`_high` bound a band |

`strip_*.csv` holds the rows of side.csv or top.csv that are drawn over the frames, with the label of each frame.
"""


def page() -> str:
    """The page as markdown."""
    parts = [
        "# Tables",
        "Made from `wentry_cli/columns.py` by `make tables`. One plain header row; an empty cell means not measured, "
        "never 0; `frame` counts from 0 in the clip, gaps included; `_unc` is a standard uncertainty (k = 1), "
        "`_unc_random` the part of it that differs by chance from frame to frame, and what is left the part that the "
        "frames of a clip share ([conventions.md](conventions.md#uncertainty) says of every table what is in which); "
        "times are of mid-exposure; heights are up positive, 0 at the undisturbed free surface.",
        "",
        "A row whose `status` is `ok` has every cell filled but those whose column says here when it may be empty; "
        "more on that in [conventions.md](conventions.md). Tables without a status promise nothing.",
        "",
        "Status words: " + ", ".join(f"`{word}`" for word in STATUS_WORDS) + ".",
    ]
    for table in TABLES.values():
        parts += ["", f"## {table.name}.csv", f"Stage `{table.stage}`, a row per {table.row}.", ""]
        parts += ["| column | unit | type | meaning | may be empty where `ok` |", "|---|---|---|---|---|"]
        parts += [f"| `{c.name}` | {c.unit} | {c.kind} | {c.meaning} | {c.may_be_empty} |" for c in table.columns]
    return "\n".join([*parts, "", FIGURES])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
