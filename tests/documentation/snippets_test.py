#!/usr/bin/python3
"""What the documents show can be typed in: commands parse, and their programs, scripts, options and presets exist; JSON is JSON; the servers
take the configurations; and scripts of pages parse."""

import itertools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import main, program  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*/README.md")]
PROGRAMS = ("webots-session-server", "webots-simulation-server", "webots-process-guard", "webots-website-host", "webots-demo-simulator")
# Options of other programs that sentences name alone: of git, docker, Slurm, Kubernetes; and properties of style sheets.
OF_OTHERS = {"--protocol", "--ip-address", "--robot-name", "--depth", "--device", "--security-opt", "--no-healthcheck", "--clusters", "--max-graceful-termination-sec",
             "--webots-accent", "--webots-line", "--webots-panel", "--webots-text"}
ENDS_OF_COMMANDS = {"|", "||", "&&", ";", "&"}
# What sentences show that is no setting: keys of messages, and what the Python servers took. docs/protocol.md has more of them.
NO_SETTINGS = {'"reconnect":true', '"mode":"mjpeg"', '"port": "1999"'}
OF_ENTRIES = {"internal", "ports", "weight", "drain", "labels", "trusted"}  # of simulationServers
# With fewer, this test no longer understands how the documents are written.
MIN_COMMANDS, MIN_SETTINGS, MIN_OPTIONS = 60, 30, 25

FENCED = re.compile(r"^( *)```(\w*)\n(.*?)^ *``` *$", re.M | re.S)
INLINE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")


def blocks(language):
    """(where, text) of each fenced block."""
    for path in DOCUMENTS:
        text = path.read_text()
        for match in FENCED.finditer(text):
            if match[2] == language:
                block = re.sub(rf"^{match[1]}", "", match[3], flags=re.M)
                yield f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 2}", block


def inline():
    """(where, text) of all code within sentences."""
    for path in DOCUMENTS:
        text = FENCED.sub(lambda match: "\n" * match[0].count("\n"), path.read_text())
        for match in INLINE.finditer(text):
            yield f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}", match[1]


def words(line):
    """The words of a line of the shell, without its remark; none where it is no whole command, as in a here document."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;()")
    lexer.whitespace_split = True
    lexer.commenters = "#"
    try:
        return list(lexer)
    except ValueError:
        return []


def commands():
    """(where, words) of each command in blocks, and of those of our programs in sentences."""
    for where, block in blocks("bash"):
        for line in block.replace("\\\n", " ").splitlines():
            yield from ((where, command) for command in split(words(line)))
    for where, text in inline():
        if re.match(rf"(?:sudo )?(?:\./\w+\.sh|\S*tests/\S+\.(?:py|sh)|(?:\S*/)?(?:{'|'.join(PROGRAMS)})) ", text):
            yield from ((where, command) for command in split(words(text)))


def split(line):
    command = []
    for word in [*line, ";"]:
        if word not in ENDS_OF_COMMANDS:
            command.append(word)
        elif command:
            yield command
            command = []


def options(line):
    return [word.split("=")[0] for word in line if re.match(r"--[a-z]", word)]


def manual(name):
    said = subprocess.run([program(name), "--help"], capture_output=True, text=True, timeout=30, check=False)
    return said.stdout + said.stderr


class Commands(unittest.TestCase):
    def test_they_parse(self):
        for where, block in blocks("bash"):
            checked = subprocess.run(["bash", "-n"], input=block, capture_output=True, text=True, timeout=30, check=False)
            self.assertEqual((checked.returncode, checked.stderr), (0, ""), f"{where}\n{block}")

    def test_their_programs_scripts_options_and_presets_exist(self):
        manuals = {name: manual(name) for name in PROGRAMS}
        faults, count = [], 0
        for where, command in commands():
            count += 1
            command = list(itertools.dropwhile(lambda word: word == "sudo" or "=" in word, command)) or [""]
            text = manuals.get(os.path.basename(command[0]))
            script = next((word for word in command if re.fullmatch(r"\./\w+\.sh|(?:\./)?tests/\S+\.(?:py|sh|mjs)", word)), None)
            if script is not None:
                path = ROOT / script
                if not path.is_file():
                    faults.append(f"{where}: there is no {script}")
                    continue
                text = path.read_text()
            if text is not None:
                faults += [f"{where}: {' '.join(command)}: there is no {option}" for option in options(command)
                           if not re.search(rf"{option}(?![\w-])", text)]
            if command[0] in ("cmake", "ctest") and "--preset" in command:
                faults += self.wrong_preset(where, command)
        self.assertEqual(faults, [])
        self.assertGreater(count, MIN_COMMANDS)

    def test_options_that_sentences_name_alone_exist(self):
        """One of our programs or scripts has each."""
        texts = [manual(name) for name in PROGRAMS]
        texts += [path.read_text() for pattern in ("*.sh", "config/**/*.sh", "tests/**/*.sh", "tests/bench/**/*.py") for path in ROOT.glob(pattern)]
        known = set(re.findall(r"(?<![\w-])--[a-z][\w-]*", "\n".join(texts))) | OF_OTHERS
        named = {(where, option) for where, text in inline() if text.startswith("--") for option in options(words(text))}
        self.assertEqual(sorted(f"{where}: there is no {option}" for where, option in named if option not in known), [])
        self.assertEqual(OF_OTHERS - {option for _, option in named}, set(), "nobody names these any more")
        self.assertGreater(len({option for _, option in named}), MIN_OPTIONS)

    def wrong_preset(self, where, command):
        presets = json.loads((ROOT / "CMakePresets.json").read_text())
        kind = "workflowPresets" if "--workflow" in command else "buildPresets" if "--build" in command else \
            "testPresets" if command[0] == "ctest" else "configurePresets"
        name = command[command.index("--preset") + 1]
        if name not in [preset["name"] for preset in presets[kind]]:
            yield f"{where}: there is no preset {name} in {kind}"


class Configurations(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.files = {}
        for key, name in (("sslCertificate", "certificate.pem"), ("sslKey", "key.pem"), ("caFile", "certificate.pem"), ("sessionSecret", "secret")):
            cls.files[key] = os.path.join(cls.folder, name)
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=sim.example.org",
                        "-keyout", cls.files["sslKey"], "-out", cls.files["sslCertificate"]], check=True, capture_output=True, timeout=60)
        with open(os.open(cls.files["sessionSecret"], os.O_CREAT | os.O_WRONLY, 0o600), "w", encoding="ascii") as file:
            file.write("0123456789abcdef" * 4)

    def check(self, server, config):
        """What the server says of a configuration whose files are there."""
        config = {key: self.files.get(key, value) for key, value in config.items()}
        path = os.path.join(self.folder, "c.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(config, file)
        checked = subprocess.run([program(f"webots-{server}-server"), "--check-config", path], capture_output=True, text=True, timeout=30, check=False,
                                 env={**os.environ, "HOME": self.folder})
        return checked.returncode, checked.stdout + checked.stderr

    def takes(self, server, setting):
        """Whether the server knows all keys of a setting, and finds nothing wrong with their values."""
        base = {"port": 1999, "server": "localhost", "simulationServers": [], "sslCertificate": "", "sslKey": "", "redirectPort": 80}
        if server == "simulation":
            del base["simulationServers"]
        said = self.check(server, {**base, **setting})[1]
        return not any(re.search(rf'unknown key "{key}"|"{key}".*: expected', said) for key in setting)

    @staticmethod
    def entry(setting):
        """A simulation server with this setting. Inside it has the port that it has outside."""
        internal = setting.get("internal", "10.0.0.2:2000")
        return {"address": f"sim.example.org/{internal.rpartition(':')[2]}", "internal": internal, **setting}

    def test_json_is_json(self):
        self.assertEqual([where for where, block in blocks("json") if self.parse(block) is None], [])

    @staticmethod
    def parse(text):
        for whole in (text, "{" + text + "}"):
            try:
                return json.loads(whole)
            except json.JSONDecodeError:
                pass
        return None

    def test_servers_take_whole_configurations(self):
        count = 0
        for where, block in blocks("json"):
            config = self.parse(block)
            if "simulationServers" in config:
                count += 1
                code, said = self.check("session", {"port": 443, **config})
                self.assertEqual((code, "unknown key" in said), (0, False), f"{where}: {said}")
        self.assertGreater(count, 1)

    def test_a_server_takes_each_setting_that_a_sentence_names(self):
        settings = {}
        for where, text in inline():
            setting = self.parse(text) if re.match(r'"\w+" ?:', text) and "..." not in text and text not in NO_SETTINGS else None
            if setting is not None and not where.startswith(("docs/protocol.md", "docs/messages.md")):
                settings.setdefault(text, (where, setting))
        faults = [f"{where}: {text}" for text, (where, setting) in settings.items()
                  if not (self.takes("simulation", setting) or self.takes("session", setting) or
                          self.takes("session", {"simulationServers": [self.entry(setting)]}) and set(setting) <= OF_ENTRIES)]
        self.assertEqual("\n".join(faults), "")
        self.assertGreater(len(settings), MIN_SETTINGS)


@unittest.skipUnless(shutil.which("node"), "there is no node (package nodejs)")
class Pages(unittest.TestCase):
    def test_scripts_parse(self):
        scripts = [(where, script) for where, block in blocks("html") for script in re.findall(r"<script[^>]*>(.+?)</script>", block, re.S)]
        self.assertGreater(len(scripts), 1)
        for where, script in scripts:
            checked = subprocess.run(["node", "--check", "--input-type=module", "-"], input=script, capture_output=True, text=True, timeout=30, check=False)
            self.assertEqual(checked.returncode, 0, f"{where}: {checked.stderr}")


if __name__ == "__main__":
    main()
