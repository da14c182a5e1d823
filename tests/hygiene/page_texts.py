#!/usr/bin/python3
"""What pages say exists in every language, with the same values, and is said somewhere. Keys are spelled in one way.

Keys are used as say('key') in scripts, and as data-say="key", data-say-label="key", data-say-placeholder="key" or
data-say-title="key" in pages.
"""

import glob
import json
import os
import re
import sys

WEB = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../src/web")
KEY = re.compile(r"[a-z]+\.[a-z][a-zA-Z0-9]*")  # part.whatItSays
USE = re.compile(r"""\bsay\(\s*'([^']+)'|\bdata-say(?:-label|-placeholder|-title)?="([^"]+)\"""")


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def unique(pairs):
    keys = [key for key, _ in pairs]
    twice = {key for key in keys if keys.count(key) > 1}
    if twice:
        raise ValueError(f"twice in one file: {', '.join(sorted(twice))}")
    return dict(pairs)


def texts():
    files = sorted(glob.glob(os.path.join(WEB, "view/texts/*.json")))
    return {os.path.basename(file)[:-5]: json.loads(read(file), object_pairs_hook=unique) for file in files}


def used():
    files = glob.glob(os.path.join(WEB, "**/*.js"), recursive=True) + glob.glob(os.path.join(WEB, "**/*.html"), recursive=True)
    return {next(filter(None, match.groups())) for file in files for match in USE.finditer(read(file))}


def values_of(text):
    return sorted(re.findall(r"\{(\w+)\}", text))


def problems():
    languages = texts()
    english = languages["en"]
    announced = set(re.findall(r"(\w\w): '", re.search(r"LANGUAGES = \{(.*)\}", read(os.path.join(WEB, "view/texts.js")))[1]))
    if announced != set(languages):
        yield f"texts.js knows {sorted(announced)}, there are files for {sorted(languages)}"
    for language, said in languages.items():
        for key in sorted(set(english) - set(said)):
            yield f"{language}.json lacks {key!r}"
        for key in sorted(set(said) - set(english)):
            yield f"{language}.json has {key!r}, which English lacks"
        for key in set(said) & set(english):
            if said[key].strip() == "":
                yield f"{language}.json: {key!r} is empty"
            if values_of(said[key]) != values_of(english[key]):
                yield f"{language}.json: {key!r} has the values {values_of(said[key])}, in English {values_of(english[key])}"
    for key in sorted(key for key in english if not KEY.fullmatch(key)):
        yield f"{key!r} is not spelled as part.whatItSays"
    for key in sorted(used() - set(english)):
        yield f"{key!r} is said, and is in no file"
    for key in sorted(set(english) - used()):
        yield f"nobody says {key!r}"


found = list(problems())
print("\n".join(found) or "Every text is there in every language.")
sys.exit(1 if found else 0)
