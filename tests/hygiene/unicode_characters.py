#!/usr/bin/python3
"""The tables of src/core/unicode_characters.cpp are Unicode's, as this Python has them. With --write: makes them so.

An older or newer Unicode than that of the file says nothing about it: then this is skipped."""

import re
import sys
import unicodedata
from pathlib import Path

CODE = Path(__file__).resolve().parents[2] / "src/core/unicode_characters.cpp"
VERSION = re.compile(r"Unicode (\d+\.\d+\.\d+)")
TABLES = re.compile(r"(// Tables: begin\n).*(// Tables: end)", re.S)
PER_LINE = 6

# https://www.unicode.org/Public/UCD/latest/ucd/PropList.txt: Other_Default_Ignorable_Code_Point and Variation_Selector.
FILLERS = [0x34F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x3164, 0xFFA0]
SELECTORS = [*range(0x180B, 0x180E), 0x180F, *range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0)]
JOINERS = [0x200C, 0x200D]
BLANK = 0x2800  # a pattern of Braille without dots
PICTOGRAPHS = range(0x1F000, 0x1FB00)  # whose gaps are for later ones (emoji-data.txt: Extended_Pictographic)


def kind(code):
    category = unicodedata.category(chr(code))
    if code in JOINERS or code in SELECTORS:
        return "joining"
    if code in FILLERS or code == BLANK or category in ("Cc", "Cf", "Cs", "Co", "Zl", "Zp"):
        return "hidden"
    if category == "Cn":
        return "visible" if code in PICTOGRAPHS else "hidden"
    return {"M": "marks", "Z": "spaces"}.get(category[0], "visible")


def ranges(wanted):
    first = None
    for code in range(0x110001):
        has = code < 0x110000 and kind(code) == wanted
        if has and first is None:
            first = code
        if not has and first is not None:
            yield first, code - 1
            first = None


def table(wanted):
    found = [f"{{0x{first:X}, 0x{last:X}}}" for first, last in ranges(wanted)]
    lines = [", ".join(found[at:at + PER_LINE]) for at in range(0, len(found), PER_LINE)]
    return f"constexpr Range {wanted}[] = {{\n    " + ",\n    ".join(lines) + "};\n"


def main():
    text = CODE.read_text()
    version = VERSION.search(text)[1]
    if sys.argv[1:] == ["--write"]:
        text = VERSION.sub(f"Unicode {unicodedata.unidata_version}", text, 1)
    elif version != unicodedata.unidata_version:
        print(f"skipped: this Python has Unicode {unicodedata.unidata_version}, the file {version}")
        sys.exit(77)
    made = TABLES.sub(lambda match: match[1] + "".join(table(each) for each in ("hidden", "joining", "marks", "spaces")) + match[2], text)
    if sys.argv[1:] == ["--write"]:
        CODE.write_text(made)
    elif made != text:
        sys.exit(f"{CODE.name} is not what Unicode says: tests/hygiene/unicode_characters.py --write")


if __name__ == "__main__":
    main()
