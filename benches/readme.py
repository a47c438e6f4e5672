"""Sections of the README that are written by the scripts which measure them."""

import sys
from pathlib import Path


def splice(path, section, text):
    """Puts `text` between the lines `<!-- SECTION: begin … -->` and `<!-- SECTION: end -->` of a file."""
    lines = Path(path).read_text().splitlines(keepends=True)
    marks = [[i for i, line in enumerate(lines) if line.startswith(f"<!-- {section}: {mark}")] for mark in ("begin", "end")]
    if [len(mark) for mark in marks] != [1, 1] or marks[0][0] > marks[1][0]:
        sys.exit(f"{path}: one line `<!-- {section}: begin -->` and one `<!-- {section}: end -->` after it expected")
    (begin,), (end,) = marks
    Path(path).write_text("".join([*lines[:begin + 1], "\n", text, "\n", *lines[end:]]))
