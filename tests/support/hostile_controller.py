#!/usr/bin/python3
"""The controller of a hostile project. When the pipe "go" tells it to begin, it makes every attempt of sandbox_attempts.py that it finds
in targets.json; after each it says in the file "said" what came of it, and waits to be told to go on.
"""

import json
import os

import sandbox_attempts


def writes(path):
    try:
        sandbox_attempts.append(path)
        os.unlink(path)
        return True
    except OSError:
        return False


def say(said):
    with open("said.new", "w") as file:
        json.dump(said, file)
    os.rename("said.new", "said")


def wait():
    with open("go") as go:
        go.read()


os.mkfifo("go.new")
os.chmod("go.new", 0o666)
os.rename("go.new", "go")
wait()
with open("targets.json") as targets_file:
    targets = json.load(targets_file)
outcomes = {}
for name, target in targets.items():
    outcomes[name] = sandbox_attempts.outcome(name, target)
    say({"outcomes": outcomes})
    wait()
say({"outcomes": outcomes, "own": all(writes(each) for each in ("own", f"/tmp/own_{os.getpid()}", os.path.expanduser("~/own"))),
     "environment": sorted(os.environ)})
