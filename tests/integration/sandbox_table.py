#!/usr/bin/python3
"""The table of docs/sandboxes.md says what the tests of the sandboxes have found.

    sandbox_table.py [--write]

Without an option it fails where the document says something else; a column whose sandbox was not tested on this machine stays as it is.
"""

import difflib
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.sandbox_attempts import ATTEMPTS, DONE, NOT_HERE, ROWS  # noqa: E402
from support.sandbox_contract import results_folder  # noqa: E402

DOCUMENT = os.path.join(os.path.dirname(__file__), "../../docs/sandboxes.md")
BEGIN = "<!-- Written by tests/integration/sandbox_table.py --write from the results of the tests. -->\n"
END = "<!-- End of the written part. -->\n"
COLUMNS = {"bubblewrap": "`bubblewrap`", "firejail": "`firejail`", "docker": "`docker`", "none": "`none`",
           "none, other users": "`none`, with [other users](#another-user)"}
FIRST = "a simulation tries to"


def titles(attempts):
    return ", ".join(each.title for each in attempts)


def verdict(row, outcomes):
    """One cell for one variant of a sandbox."""
    tried = [each for each in ATTEMPTS.values() if each.row == row and outcomes.get(each.id, NOT_HERE) != NOT_HERE]
    done = [each for each in tried if outcomes[each.id] == DONE]
    refused = [each for each in tried if each not in done]
    if not tried:
        return "was not tried"
    if not done:
        return "not there" if all(outcomes[each.id] == "ENOENT" for each in tried) else "can't"
    if not refused:
        return "can"
    return f"can, but not: {titles(refused)}" if len(done) > len(refused) else f"can only: {titles(done)}"


def cell(row, results):
    """What all variants have in common; where one is different, that as well."""
    usual = verdict(row, results[0]["outcomes"])
    others = [(each["variant"], verdict(row, each["outcomes"])) for each in results[1:]]
    return "; ".join([usual, *[f"{variant}: {other}" for variant, other in others if other != usual]])


def read_results():
    """By sandbox; the result without a variant comes first."""
    results = {}
    folder = results_folder()
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
        with open(os.path.join(folder, name)) as file:
            result = json.load(file)
        results.setdefault(result["sandbox"], []).append(result)
    for each in results.values():
        each.sort(key=lambda result: result["variant"])
    return {sandbox: each for sandbox, each in results.items() if each[0]["variant"] == ""}


def parse(table):
    """Cells by column and row of the table as it is."""
    lines = [[cell.strip() for cell in line.strip().strip("|").split(" | ")] for line in table.splitlines() if line.startswith("|")]
    if not lines:
        return {}
    names = {heading: name for name, heading in COLUMNS.items()}
    return {names[heading]: {line[0]: line[number] for line in lines[2:]} for number, heading in enumerate(lines[0]) if number}


def write(old, results):
    cells = {}
    for sandbox in COLUMNS:
        if sandbox in results:
            cells[sandbox] = {text: cell(row, results[sandbox]) for row, text in ROWS.items()}
        elif sandbox in old:
            cells[sandbox] = {text: old[sandbox].get(text, "was not tried") for text in ROWS.values()}
    lines = [f"| {FIRST} | " + " | ".join(COLUMNS[each] for each in cells) + " |", "|---" * (len(cells) + 1) + "|"]
    lines += ["| " + " | ".join([text, *[column[text] for column in cells.values()]]) + " |" for text in ROWS.values()]
    return "\n".join(lines) + "\n"


def main():
    results = read_results()
    if not results:
        print("skipped: no sandbox was tested on this machine")
        sys.exit(77)
    with open(DOCUMENT) as file:
        document = file.read()
    before, _, rest = document.partition(BEGIN)
    table, _, after = rest.partition(END)
    assert after, f"{DOCUMENT} has no place for the table"
    new = write(parse(table), results)
    for sandbox in COLUMNS:
        if sandbox not in results:
            print(f"{sandbox} was not tested on this machine")
    if "--write" in sys.argv[1:]:
        with open(DOCUMENT, "w") as file:
            file.write(before + BEGIN + new + END + after)
    elif new != table:
        print("docs/sandboxes.md says something else than what was found (sandbox_table.py --write changes it):")
        print("".join(difflib.unified_diff(table.splitlines(True), new.splitlines(True), "said", "found", n=0)))
        sys.exit(1)


if __name__ == "__main__":
    main()
