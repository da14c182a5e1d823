#!/usr/bin/python3
"""Counts the instructions of the hot paths under callgrind and compares them with the figures of instruction_counts.json.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/instruction_counts.py [--store]

A path that takes over 5 % more than stored fails; one that takes 5 % less asks for new figures (--store). Instructions do not depend on
how busy the machine is, but on the compiler: with another one than stored, this says "skipped".
"""

import json
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
STORED = os.path.join(HERE, "instruction_counts.json")
PROGRAM = os.path.join(os.environ.get("WEBOTS_CLOUD_BIN", ""), "hot_paths")
TOLERANCE = 0.05
FEW, MANY = 1000, 3000


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def instructions(path, times):
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", PROGRAM, path, str(times)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def each(path):
    """Of one pass: what the program does once, and what the first passes do, is in both counts."""
    return round((instructions(path, MANY) - instructions(path, FEW)) / (MANY - FEW))


def compiler():
    return subprocess.run(["g++", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]


def main():
    if not shutil.which("valgrind"):
        skip("valgrind is not installed (package valgrind)")
    if not os.access(PROGRAM, os.X_OK):
        skip(f"{PROGRAM} is missing (WEBOTS_CLOUD_BIN names the folder of the built programs)")
    paths = subprocess.run([PROGRAM], capture_output=True, text=True, check=True).stdout.splitlines()
    if sys.argv[1:] == ["--store"]:
        with open(STORED, "w") as file:
            json.dump({"compiler": compiler(), "instructions": {path: each(path) for path in paths}}, file, indent=2)
            file.write("\n")
        return
    with open(STORED) as file:
        stored = json.load(file)
    if compiler() != stored["compiler"]:
        skip(f"the figures are those of {stored['compiler']}")
    failed = sorted(set(paths) ^ set(stored["instructions"]))
    for path, before in stored["instructions"].items():
        now = each(path)
        change = now / before - 1
        print(f"{path}: {now:,} instructions, {change:+.1%}")
        if change > TOLERANCE:
            failed.append(path)
        elif change < -TOLERANCE:
            print("    faster than stored: run this with --store and commit the figures")
    if failed:
        sys.exit("More instructions than stored, or not stored: " + ", ".join(failed))


if __name__ == "__main__":
    main()
