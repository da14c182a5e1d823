#!/usr/bin/python3
"""The design tokens (src/web/view/tokens.css): light ones are the same for all browsers, text can be read on what is behind it (WCAG 2: 4.5 to 1),
and no other style sheet of ours has colours, or uses a token that there is not. Black and white, of masks and codes, are no colours.
"""

import glob
import os
import re
import sys

WEB = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../src/web")
TOKENS = os.path.join(WEB, "view/tokens.css")
COLOUR = r"#[0-9a-f]{6}"
PLAIN = re.compile(rf"(--[a-z-]+): (?:var\(--webots-[a-z]+, )?({COLOUR})\)?;")
PAIR = re.compile(rf"(--[a-z-]+): (?:var\(--webots-[a-z]+, )?light-dark\(({COLOUR}), ({COLOUR})\)\)?;")
DARK_ALWAYS = {"--screen", "--screen-text", "--warning-line"}
# What is written on what.
READ = {"--text": ["--page", "--panel", "--notice", "--warning"], "--quiet": ["--page", "--panel"], "--accent": ["--page", "--panel"],
        "--accent-text": ["--accent"], "--good": ["--panel"], "--bad": ["--page", "--panel"], "--screen-text": ["--screen"]}
NEEDED = 4.5
OTHER_COLOUR = re.compile(r"#(?!000\b|fff\b)[0-9a-f]{3}(?:[0-9a-f]{3})?\b(?![^;{}]*\{)|\brgba?\(", re.I)
SET_BY_SCRIPTS = {"--empty", "--error", "--value"}
PAGES = {"--webots-accent", "--webots-panel", "--webots-text", "--webots-line"}  # set by who embeds a view


def read(path):
    with open(path, encoding="utf-8") as file:
        return re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)


def brightness(colour):
    parts = [int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    high, low = sorted((brightness(one), brightness(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def faults_of_tokens():
    text = read(TOKENS)
    fallback, both = text.split("@supports")
    plain = dict(PLAIN.findall(fallback))
    pairs = {name: (light, dark) for name, light, dark in PAIR.findall(both)}
    for name, light in plain.items():
        if name not in DARK_ALWAYS and pairs.get(name, ("none",))[0] != light:
            yield f"{name} is {light} in old browsers, and {pairs.get(name)} in others"
    for look in (0, 1):
        colours = {**plain, **{name: pair[look] for name, pair in pairs.items()}}
        for text_colour, backgrounds in READ.items():
            for background in backgrounds:
                if (found := contrast(colours[text_colour], colours[background])) < NEEDED:
                    yield f"{text_colour} on {background}, {('light', 'dark')[look]}: contrast {found:.2f}"


def faults_of_sheets():
    known = set(re.findall(r"(--[a-z-]+):", read(TOKENS))) | SET_BY_SCRIPTS | PAGES
    sheets = [*glob.glob(os.path.join(WEB, "**/*.css"), recursive=True), os.path.join(WEB, "view/view_style.js")]
    assert len(sheets) > 5, sheets
    for sheet in sheets:
        text, name = read(sheet), os.path.relpath(sheet, WEB)
        for token in set(re.findall(r"var\((--[a-z-]+)", text)) - known - set(re.findall(r"(--[a-z-]+):", text)):
            yield f"{name}: there is no {token}"
        if not os.path.samefile(sheet, TOKENS):
            for colour in OTHER_COLOUR.findall(text):
                yield f"{name}: {colour} belongs into view/tokens.css"


def main():
    faults = [*faults_of_tokens(), *faults_of_sheets()]
    print("\n".join(faults) or "The tokens are as they should be.")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
