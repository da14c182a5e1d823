#!/usr/bin/python3
"""300 configurations with mistakes that people make, several in each: `--check-config` names every one with its line, and nothing else.

The shipped configurations are written one key a line, with a few more keys, and then mutated with the same seeds each time. What is
planted as a fault ends with status 2; what is only warned of is told all the same."""

import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from support.servers import main, program  # noqa: E402

COUNT = 300
TOLD = re.compile(r"c\.json:(\d+):\d+: (.*)")
# What only tells that a key has another meaning now, or that files are missing here.
NOT_PLANTED = re.compile(r'can.t be used|there is no |is missing: expected |since without "sslCertificate"')


class Line:
    """A key and its value as text, and the sentence that is expected about this line, if any."""

    def __init__(self, key, value):
        self.key, self.value, self.name, self.text = key, value, json.dumps(key), json.dumps(value)
        self.before, self.after, self.comma, self.expected, self.is_fault = "", "", ",", "", True

    def plant(self, expected, is_fault=True):
        self.expected, self.is_fault = expected, is_fault


def wrong_type(line, about, _random):
    if not about.keys() & {"type", "enum", "anyOf"}:
        return False
    line.text = '{"no": [1]}'
    line.plant(f'key "{line.key}": expected ')
    return True


def out_of_range(line, about, chance):
    if about.get("type") not in ("integer", "number") or "minimum" not in about:
        return False
    line.text = str(chance.choice((about["minimum"] - 1, about["maximum"] * 10)))
    line.plant(f'key "{line.key}": expected ')
    return True


def no_choice(line, about, _random):
    if "enum" not in about:
        return False
    line.text = '"no such choice"'
    line.plant(f'key "{line.key}": expected one of ')
    return True


def typing_mistake(line, about, chance):
    at = chance.randrange(1, len(line.key) - 1) if len(line.key) > 3 else 0
    line.name = json.dumps(line.key[:at] + "x" + line.key[at:])
    line.plant(f"unknown key {line.name} is ignored", is_fault=False)
    return "minimum" not in about or line.key != "port"  # which the session server requires


def comment_above(line, _about, chance):
    line.before = "  " + chance.choice(("// {}", "# {}", "/* {} */")).format('they say "so", and more') + "\n"
    line.plant("not JSON: JSON has no comments")
    return True


def comment_behind(line, _about, chance):
    line.after = chance.choice((" // {", " # [", " /* 1 */"))
    line.plant("not JSON: JSON has no comments")
    return True


def no_comma(line, _about, _random):
    line.comma = ""
    line.plant("not JSON: a comma is missing here")
    return True


def two_commas(line, _about, _random):
    line.comma = ",,"
    line.plant("not JSON: there is a comma too many")
    return True


def single_quotes(line, _about, _random):
    line.name = f"'{line.key}'"
    line.plant("not JSON: JSON has double quotes, no single ones")
    return True


def no_quotes(line, _about, _random):
    line.name = line.key
    line.plant("not JSON: a key is in double quotes")
    return not line.key.startswith("$")


def with_unit(line, about, chance):
    line.text += chance.choice((" s", "MB", " %"))
    line.plant("not JSON: a number has no unit")
    return about.get("type") in ("integer", "number")


def python(line, about, _random):
    line.text = str(line.value)
    line.plant("not JSON: JSON has ")
    return about.get("type") == "boolean"


def open_string(line, _about, _random):
    line.text = line.text[:-1]
    line.plant("not JSON: this string has no quote at its end")
    return isinstance(line.value, str)


def no_colon(line, _about, _random):
    line.name += " "
    line.text = "\0" + line.text  # its mark
    line.plant('not JSON: a ":" is missing after the key')
    return True


def twice(line, _about, _random):
    line.before = f"  {line.name}: {line.text},\n"
    line.plant(f'key "{line.key}" is here for the second time', is_fault=False)
    return True


MUTATIONS = (wrong_type, out_of_range, no_choice, typing_mistake, comment_above, comment_behind, no_comma, two_commas, single_quotes, no_quotes,
             with_unit, python, open_string, no_colon, twice)


def mutated(config, properties, chance):
    """The text of a configuration with mistakes, and for each its line, its sentence and whether it is a fault."""
    config = dict(config)
    more = [key for key, about in properties.items() if "default" in about and "x-aliasOf" not in about and key not in config]
    for key in chance.sample(more, 5):
        config[key] = properties[key]["default"]
    lines = [Line(key, value) for key, value in config.items()]
    for line in chance.sample(lines, chance.randint(1, 4)):
        for mutate in chance.sample(MUTATIONS, len(MUTATIONS)):
            trial = Line(line.key, line.value)
            if line is lines[-1] and mutate in (no_comma, two_commas):
                continue
            if mutate(trial, properties[line.key], chance):
                lines[lines.index(line)] = trial
                break
    lines[-1].comma = ""
    planted = []
    begin = chance.choice(("", "", "", "\ufeff"))
    if begin:
        planted.append((1, "not JSON: the file begins with a byte order mark", True))
    end = chance.choice(("}\n", "}\n", "}\n", "cut", "comma"))
    if end == "cut":
        lines = lines[:chance.randint(max(1, len(lines) - 2), len(lines))]
        if "comma is missing" in lines[-1].expected:
            lines[-1].expected = ""  # nothing follows any more
    text, number = begin + "{\n", 2
    for line in lines:
        if line.expected:
            own = number if line.before.strip().startswith(("/", "#")) else number + line.before.count("\n")
            is_told = line.before and (own - 1, line.expected, True) in planted and "comments" in line.expected  # with the one right before it
            planted += [] if is_told else [(own, line.expected, line.is_fault)]
        if end == "comma" and line is lines[-1] and "no quote at its end" not in line.expected:  # to which the comma would belong
            planted.append((number + line.before.count("\n"), "not JSON: there is a comma after the last entry", True))
            line.comma = ","
        colon = " " if line.text.startswith("\0") else ": "
        written = line.before + "  " + line.name + colon + line.text.lstrip("\0") + line.comma + line.after + "\n"
        text, number = text + written, number + written.count("\n")
    if end == "cut":
        planted.append((number, "not JSON: the file ends within the object that begins at 1:", True))
    return text if end == "cut" else text + "}\n", planted


class Mutated(unittest.TestCase):
    def check(self, server, text):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "c.json").write_text(text)
            finished = subprocess.run([program(f"webots-{server}-server"), "--check-config", "c.json"], capture_output=True, text=True, timeout=30,
                                      cwd=folder, env={**os.environ, "HOME": folder, "RES_OPTIONS": "timeout:1 attempts:1"})
        return finished.stderr, finished.returncode

    def test_every_mistake_is_told_with_its_line_and_nothing_else(self):
        sources = []
        for server in ("session", "simulation"):
            properties = json.loads((ROOT / f"config/{server}.schema.json").read_text())["properties"]
            sources += [(server, properties, json.loads(file.read_text())) for file in sorted((ROOT / "config" / server).glob("*.json"))]
        faults = 0
        for seed in range(COUNT):
            chance = random.Random(seed)
            server, properties, config = sources[seed % len(sources)]
            text, planted = mutated(config, properties, chance)
            said, status = self.check(server, text)
            told = [(int(line), sentence) for line, sentence in TOLD.findall(said)]
            where = f"seed {seed}, {server}:\n{text}\n{said}\n{planted}"
            for line, sentence, is_fault in planted:
                self.assertTrue(any(line == at and sentence in found for at, found in told), f"{line}: {sentence} is not told: {where}")
                faults += is_fault
            for at, found in told:
                known = any(line == at and sentence in found for line, sentence, _ in planted) or NOT_PLANTED.search(found)
                self.assertTrue(known, f"{at}: {found} is no mistake: {where}")
            if any(is_fault for _, _, is_fault in planted):
                self.assertEqual(status, 2, where)
        self.assertGreater(faults, COUNT)


if __name__ == "__main__":
    main()
