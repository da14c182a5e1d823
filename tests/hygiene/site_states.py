#!/usr/bin/python3
"""What a site is: the table of docs/visitors.md, the rows of site_state_test.cpp, the words and sentences of site_state.cpp, and the
English texts of the pages say the same."""

import json
import os
import re
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def described():
    """Of the documentation: (situation, state, sentence) of each row, in order."""
    section = re.search(r"^## What a site is$(.*?)^## ", read("docs/visitors.md"), re.MULTILINE | re.DOTALL)[1]
    return re.findall(r"^\| (.*?) \| `(\w+)` \| (.*?) \|$", section, re.MULTILINE)


def tested():
    """Of the unit test: (situation, state)."""
    return re.findall(r'^    \{"(.*?)", .*SiteState::(\w+)\},$', read("tests/unit/core/site_state_test.cpp"), re.MULTILINE)


def said(function):
    """What a function of site_state.cpp returns, by state."""
    body = re.search(rf"^std::string_view {function}\(.*?^}}", read("src/core/site_state.cpp"), re.MULTILINE | re.DOTALL)[0]
    return dict(re.findall(r'case SiteState::(\w+):\s+return "(.*?)";', body))


def problems():
    rows = described()
    if not rows or [(what, state) for what, state, _ in rows] != tested():
        yield "docs/visitors.md and site_state_test.cpp have different situations, or states of them"
    sentences = said("sentence_of")
    for what, state, sentence in rows:
        if sentence != sentences[state]:
            yield f"docs/visitors.md, {what!r}: people read {sentences[state]!r}"
    for state, word in said("word_of").items():
        if word != state:
            yield f"{state} is called {word!r}"
    texts = json.loads(read("src/web/view/texts/en.json"))
    for state, sentence in sentences.items():
        if texts.get(f"site.{state}") != sentence:
            yield f"en.json says {texts.get(f'site.{state}')!r} for {state}, the server {sentence!r}"


found = list(problems())
print("\n".join(found) or "They say the same.")
sys.exit(1 if found else 0)
