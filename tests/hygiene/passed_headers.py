#!/usr/bin/python3
"""The tables of docs/gateway.md are those of src/core/access/passed_headers.hpp. With --write: makes them so."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CODE = ROOT / "src/core/access/passed_headers.hpp"
PAGE = ROOT / "docs/gateway.md"
TABLE = re.compile(r"passed_(request|answer)_headers = .*?clang-format off\n(.*?)// clang-format on", re.S)
ENTRY = re.compile(r'^\s*\{"([\w-]+)", (simulation|machine|trusted_monitor), "([^"]+)"\},$', re.M)
MARKS = ("<!-- passed headers: begin -->", "<!-- passed headers: end -->")
TITLES = {"request": "of requests", "answer": "of answers"}
WITH = {"simulation": "all", "machine": "simulation servers and their monitors", "trusted_monitor": "monitors of trusted simulation servers"}


def tables(code):
    for direction, lines in TABLE.findall(code):
        rows = ENTRY.findall(lines)
        assert len(rows) == len(lines.strip().splitlines()), f"{CODE.name}: a line of {direction}s is not like the others"
        yield f"| {TITLES[direction]} | exchanged with | why |\n|---|---|---|\n" + "".join(
            f"| `{name}` | {WITH[least]} | {why} |\n" for name, least, why in rows)


def main():
    text = "\n".join(tables(CODE.read_text()))
    page = PAGE.read_text()
    begin, end = page.index(MARKS[0]) + len(MARKS[0]), page.index(MARKS[1])
    made = f"{page[:begin]}\n{text}{page[end:]}"
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(made)
    elif made != page:
        sys.exit("docs/gateway.md is not what the tables say: tests/hygiene/passed_headers.py --write")


if __name__ == "__main__":
    main()
