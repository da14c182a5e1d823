#!/usr/bin/python3
"""What pages say exists in every language, with the same values, and is said somewhere. Keys are spelled in one way.

Keys are used as say('key') in scripts, and as data-say="key", data-say-label="key", data-say-placeholder="key" or
data-say-title="key" in pages. Those of refusals are used by the codes of the table in src/core/refusals.cpp: each code has a text,
`refusal.noWorld` for "no-world", whose values are arguments of all sentences with that code, or `why`, the sentence.

Pages of refusals (src/service/error_page.cpp) say what the servers' code says in English: src/web/viewer/error.json has each of
these sentences in all other languages, and none that nobody says any more.
"""

import glob
import json
import os
import re
import sys

WEB = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../src/web")
KEY = re.compile(r"[a-z]+\.[a-z][a-zA-Z0-9]*")  # part.whatItSays
REFUSALS = os.path.join(WEB, "../core/refusals.cpp")
# A row: its code and its sentence, a literal or several in a row.
ROW = re.compile(r"""\{R::\w+, "([a-z-]+)", errc::\w+, \w+,\s*((?:"(?:[^"\\]|\\.)*"\s*)+)""")
SAID_IN_ENGLISH = os.path.join(WEB, "viewer/error.json")
LITERALS = re.compile(r'''(?:"(?:[^"\\\n]|\\.)*"\s*)+''')  # one, or several in a row
UNSAID = {"time-limit": {"minutes"},  # Arguments that are no part of the sentence,
          "ended-early": {"words"}}  # or that only some sentences with the code have: pages say nothing there.
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
    """By language: those of the pages, a file for each, and of the monitors, all in one table."""
    languages = {os.path.basename(file)[:-5]: json.loads(read(file), object_pairs_hook=unique)
                 for file in sorted(glob.glob(os.path.join(WEB, "view/texts/*.json")))}
    for key, translations in json.loads(read(os.path.join(WEB, "monitor/texts.json")), object_pairs_hook=unique).items():
        for language, text in translations.items():
            if key in languages.setdefault(language, {}):
                raise ValueError(f"of the pages and of the monitors: {key}")
            languages[language][key] = text
    return languages


def used():
    files = glob.glob(os.path.join(WEB, "**/*.js"), recursive=True) + glob.glob(os.path.join(WEB, "**/*.html"), recursive=True)
    return {next(filter(None, match.groups())) for file in files for match in USE.finditer(read(file))}


def refusals():
    """The sentences of each code."""
    sentences = {}
    for code, sentence in ROW.findall(read(REFUSALS)):
        sentences.setdefault(code, []).append(sentence)
    return sentences


def sentences_of_code():
    """All literals of the servers, without the ends of lines that some have."""
    sources = glob.glob(os.path.join(WEB, "../**/*.[ch]pp"), recursive=True)
    literals = (match[0] for file in sources for match in LITERALS.finditer(read(file)))
    pieces = ("".join(re.findall(r'"((?:[^"\\\n]|\\.)*)"', literal)) for literal in literals)
    return {piece.replace('\\"', '"').removesuffix("\\r\\n") for piece in pieces}


def key_of(code):
    return "refusal." + re.sub(r"-(\w)", lambda match: match[1].upper(), code)


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
    codes = refusals()
    if sum(map(len, codes.values())) != read(REFUSALS).count("{R::"):
        yield f"{REFUSALS} has rows that are written in another way"
    for code, sentences in sorted(codes.items()):
        known = {"why"} | UNSAID.get(code, set()) | set.intersection(*(set(values_of(sentence)) for sentence in sentences))
        for value in sorted(set(values_of(english.get(key_of(code), ""))) - known):
            yield f"{key_of(code)!r} has the value {value!r}, which not all sentences with the code {code!r} have"
    said = used() | {key_of(code) for code in codes}
    for key in sorted(said - set(english)):
        yield f"{key!r} is said, and is in no file"
    for key in sorted(set(english) - said):
        yield f"nobody says {key!r}"


def problems_of_refusals(languages):
    said = sentences_of_code()
    for sentence, translations in json.loads(read(SAID_IN_ENGLISH), object_pairs_hook=unique).items():
        if sentence not in said:
            yield f"error.json has {sentence!r}, which no server says"
        if set(translations) != languages - {"en"} or "" in map(str.strip, translations.values()):
            yield f"error.json: {sentence!r} is in {sorted(translations)} rather than in every language but English"


found = [*problems(), *problems_of_refusals(set(texts()))]
print("\n".join(found) or "Every text is there in every language.")
sys.exit(1 if found else 0)
