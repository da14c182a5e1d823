#!/usr/bin/python3
"""docs/metrics.md is what the table of all metrics says (src/core/pages/metrics_table.hpp). With --write: makes it so."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "src/core/pages/metrics_table.hpp"
PAGE = ROOT / "docs/metrics.md"
ENTRY = re.compile(r'^\s*\{"(\w+)", (counter|gauge|histogram), (both|session|simulation), "([^"]*)", "([^"]*)", "(.*)"\},$', re.M)
UNITS = ("seconds", "bytes", "ratio")

PAGE_TEXT = """# Metrics

These are the metrics of `GET /metrics` of both servers, in the text format of Prometheus. [monitoring.md](monitoring.md) leads from there to alerts and a dashboard;
[access.md](access.md#who-is-the-operator) says who may read it.

A *counter* only grows, and begins with 0 when its server starts: query `rate(...[5m])` or `increase(...[1h])`. A *histogram* `x` consists of `x_bucket`, `x_sum` and `x_count`;
`histogram_quantile(0.9, rate(x_bucket[15m]))` is the time within which nine of ten were done. A *ratio* of 1 is all.
Labels have few values, except `machine`, which is an address of `simulationServers`. *Only with* names the key of the configuration, or what else is needed.

This page is made from `src/core/pages/metrics_table.hpp`.
"""

SECTIONS = (("both", "Both servers"), ("session", "The session server"), ("simulation", "The simulation server"))


def entries(text):
    found = ENTRY.findall(text)
    lines = re.findall(r'^\s*\{"', text, re.M)
    assert found and len(found) == len(lines), f"{len(lines)} lines of {TABLE.name} look like entries, {len(found)} are"
    return found


def unit(name):
    words = name.removesuffix("_total").split("_")
    return next((each for each in UNITS if each == words[-1]), "")


def problems(table):
    names = [name for name, *_ in table]
    for name in {name for name in names if names.count(name) > 1}:
        yield f"{name} is in the table twice"
    for name, kind, _, labels, _, text in table:
        if (kind == "counter") != name.endswith("_total"):
            yield f"{name}: counters, and nothing else, end with _total"
        if not re.fullmatch(r"[A-Z1].*\.", text):
            yield f"{name}: {text!r} is no sentence"
        if set(name.split("_")) & {"milliseconds", "percent", "megabytes", "minutes", "hours"}:
            yield f"{name} has a unit that is not one of {', '.join(UNITS)}"
        if not re.fullmatch(r"(\w+(, \w+)*)?", labels):
            yield f"{name}: labels are {labels!r}"


def code(text):
    return f"`{text}`" if text and " " not in text else text


def page(table):
    parts = [PAGE_TEXT]
    for server, title in SECTIONS:
        parts.append(f"\n## {title}\n\n| metric | type | labels | only with |\n|---|---|---|---|\n")
        for name, kind, whose, labels, needs, text in table:
            if whose == server:
                labels = ", ".join(map(code, filter(None, labels.split(", "))))
                parts.append(f"| `webots_{name}`<br>{text} | {', '.join(filter(None, (kind, unit(name))))} | {labels} | {code(needs)} |\n")
    return "".join(parts)


def main():
    table = entries(TABLE.read_text())
    found = list(problems(table))
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(page(table))
    elif not PAGE.exists() or PAGE.read_text() != page(table):
        found.append("docs/metrics.md is not what the table says: tests/hygiene/metrics_page.py --write")
    print(*found, sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
