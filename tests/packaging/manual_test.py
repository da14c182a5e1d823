#!/usr/bin/python3
"""The manual pages and completions that are generated of the programs' options, and the pages of their configurations.

Usage: manual_test.py FOLDER_OF_PROGRAMS FOLDER_OF_MANUALS
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAMS, MANUALS = "", ""
SERVERS = ("webots-session-server", "webots-simulation-server")
ALL = (*SERVERS, "webots-process-guard")
PAGES = {**{program: f"{program}.8" for program in ALL}, "webots-demo-simulator": "webots-demo-simulator.1"}
CONFIGURATIONS = {program: f"{program}.json.5" for program in SERVERS}


def output_of(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=True, **options).stdout


def options_of(program):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", output_of(os.path.join(PROGRAMS, program), "--help")))


def need(test, program, package):
    if not shutil.which(program):
        test.skipTest(f"{program} is missing (package {package})")


class Pages(unittest.TestCase):
    def rendered(self, file):
        need(self, "man", "man-db")
        done = subprocess.run(["man", "--warnings", "--no-hyphenation", "-l", os.path.join(MANUALS, "man", file)], capture_output=True, text=True,
                              timeout=60, env={**os.environ, "MANWIDTH": "200", "LC_ALL": "C.UTF-8", "MAN_KEEP_FORMATTING": ""})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout.replace("\u2010", "-")

    def test_pages_have_no_faults_and_every_option_of_help(self):
        for program in PAGES:
            page = self.rendered(PAGES[program])
            self.assertEqual(sorted(options_of(program) - set(re.findall(r"--[a-z][a-z-]+", page))), [], program)
            for heading in ("NAME", "SYNOPSIS", "OPTIONS", "SIGNALS", "EXIT STATUS", "SEE ALSO"):
                self.assertRegex(page, rf"(?m)^{heading}$")

    def test_help_fits_a_terminal(self):
        for program in (*PAGES, "webots-site", "webots-website-host"):
            for line in output_of(os.path.join(PROGRAMS, program), "--help").splitlines():
                self.assertLessEqual(len(line), 80, f"{program}: {line}")

    def test_whoever_starts_the_guard_is_told_whose_program_it_is(self):
        for arguments in ((), ("--nope",), ("1000",)):
            done = subprocess.run([os.path.join(PROGRAMS, "webots-process-guard"), *arguments], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertEqual(done.stderr, "webots-process-guard: these arguments are not understood. webots-simulation-server starts this program; --help says how.\n")

    def test_help_and_page_say_the_same_of_signals_and_exit_statuses(self):
        for program in SERVERS:
            said = output_of(os.path.join(PROGRAMS, program), "--help")
            page = " ".join(self.rendered(PAGES[program]).split())
            rows = re.search(r"\nSignals:\n(.*?)\nExit statuses:\n(.*)", said, re.S)
            lines = [line.split(maxsplit=1) for line in (rows[1] + rows[2]).splitlines()]
            self.assertGreaterEqual(len(lines), 6)
            for _, meaning in lines:
                self.assertIn(meaning.split("  ")[-1].strip(), page)

    def test_every_key_of_a_configuration_is_explained_as_help_does(self):
        for program, file in CONFIGURATIONS.items():
            page = self.rendered(file)
            words = " ".join(page.split())
            keys = json.loads(output_of(os.path.join(PROGRAMS, program), "--schema"))["properties"]
            self.assertGreater(len(keys), 40)
            for name, key in keys.items():
                if "x-aliasOf" in key:
                    self.assertIn(f"Older name: {name}.", words)
                    continue
                self.assertRegex(page, rf"(?m)^ {{7}}{re.escape(name)}$|^ {{7}}{re.escape(name)} ")
                said = output_of(os.path.join(PROGRAMS, program), "--help", name)
                purpose = " ".join(said.split("\n\n")[0].splitlines()[1:])
                self.assertIn(" ".join(purpose.split()), words, name)
                for fact in re.findall(r"(?ms)^  (?:Default: (?!none, the key)|SIGHUP|A change).*?\.$", said):
                    self.assertIn(" ".join(fact.split()), words, name)

    def test_mandoc_finds_nothing_to_correct(self):
        need(self, "mandoc", "mandoc")
        for file in (*PAGES.values(), *CONFIGURATIONS.values()):
            said = subprocess.run(["mandoc", "-Tlint", "-Werror", os.path.join(MANUALS, "man", file)], capture_output=True, text=True, timeout=60)
            self.assertEqual((said.returncode, said.stdout), (0, ""))


class Bash(unittest.TestCase):
    def completed(self, program, *words):
        """What is proposed for the last word."""
        script = ('source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); name=$(complete -p "$1" | sed "s/.* -F \\([^ ]*\\) .*/\\1/"); '
                  '"$name"; printf "%s\\n" "${COMPREPLY[@]}"')
        return output_of("bash", "-c", script, "bash", os.path.join(MANUALS, "bash", program), program, *words, cwd=self.folder).split()

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="webots_cloud_completion_")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for name in ("lab.json", "notes.txt"):
            open(os.path.join(self.folder, name), "w").close()

    def test_every_option_of_help_is_proposed(self):
        for program in ALL:
            self.assertEqual(set(self.completed(program, "--")), options_of(program), program)

    def test_what_begins_so_is_proposed(self):
        self.assertEqual(self.completed("webots-session-server", "--do"), ["--doctor"])
        self.assertEqual(self.completed("webots-simulation-server", "--drain"), ["--drain", "--drain-and-exit"])
        self.assertEqual(self.completed("webots-session-server", "--log-format", "j"), ["json"])
        self.assertEqual(self.completed("webots-session-server", "--drain", ""), [])

    def test_configurations_are_proposed_and_other_files_are_not(self):
        self.assertEqual(self.completed("webots-session-server", "--doctor", ""), ["lab.json"])


class OtherShells(unittest.TestCase):
    def test_zsh_understands_its_completions(self):
        need(self, "zsh", "zsh")
        for program in ALL:
            output_of("zsh", "-n", os.path.join(MANUALS, "zsh", f"_{program}"))

    def test_fish_understands_its_completions_and_completes(self):
        need(self, "fish", "fish")
        for program in ALL:
            file = os.path.join(MANUALS, "fish", f"{program}.fish")
            output_of("fish", "--no-execute", file)
            proposed = output_of("fish", "-c", f"source {file}; complete -C '{program} --'", env={**os.environ, "HOME": tempfile.gettempdir()})
            self.assertLessEqual(options_of(program), {line.split("\t")[0] for line in proposed.splitlines()}, program)


def main():
    global PROGRAMS, MANUALS
    PROGRAMS, MANUALS = (os.path.abspath(argument) for argument in sys.argv[1:3])
    return 0 if unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2, exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
