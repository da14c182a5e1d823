#!/usr/bin/python3
"""The script at the beginning of our pages, which loads them again when something did not arrive, is the same on all of them, is allowed by
their Content-Security-Policy, and speaks every language.

    inline_scripts.py [--write]     --write: takes that of the viewer, puts it into the other pages, and allows it
"""

import base64
import hashlib
import os
import re
import sys

WEB = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../src/web")
PAGES = ("viewer/index.html", "viewer/worlds/index.html", "class/index.html")
SCRIPT = re.compile(r"(<script>)(.*?)(</script>)", re.S)
HASH = re.compile(r"'sha256-[A-Za-z0-9+/=]*'")


def read(name):
    with open(os.path.join(WEB, name), encoding="utf-8") as file:
        return file.read()


def right(page, script):
    """The page with this script, and with a policy that allows it."""
    page = SCRIPT.sub(lambda found: found[1] + script + found[3], page, count=1)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return HASH.sub(f"'sha256-{digest}'", page, count=1)


def problems(write):
    script = SCRIPT.search(read(PAGES[0]))[2]
    announced = set(re.findall(r"(\w\w): '", re.search(r"LANGUAGES = \{(.*)\}", read("view/texts.js"))[1]))
    spoken = set(re.findall(r"^ *(\w\w): '", script, re.M))
    if spoken != announced:
        yield f"{PAGES[0]}: the script speaks {sorted(spoken)}, texts.js knows {sorted(announced)}"
    for name in PAGES:
        page = read(name)
        if page == right(page, script):
            continue
        if write:
            with open(os.path.join(WEB, name), "w", encoding="utf-8") as file:
                file.write(right(page, script))
        else:
            yield f"{name}: its first script is not that of {PAGES[0]}, or its policy does not allow it: tests/hygiene/inline_scripts.py --write"


found = list(problems("--write" in sys.argv))
print("\n".join(found) or "The pages begin with the same script.")
sys.exit(1 if found else 0)
