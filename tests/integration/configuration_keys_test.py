#!/usr/bin/python3
"""What both servers say of the keys of their configurations: the shipped schemas are those that the programs print, all shipped
configurations conform to them, and each key has a page in the terminal."""

import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from support.servers import main, program  # noqa: E402

SERVERS = ("session", "simulation")


def run(server, *arguments):
    return subprocess.run([program(f"webots-{server}-server"), *arguments], capture_output=True, text=True, timeout=30)


class Keys(unittest.TestCase):
    def schema(self, server):
        return json.loads((ROOT / f"config/{server}.schema.json").read_text())

    def test_the_shipped_schemas_are_those_of_the_programs(self):
        for server in SERVERS:
            printed = run(server, "--schema")
            self.assertEqual((printed.returncode, printed.stderr), (0, ""))
            self.assertEqual(printed.stdout, (ROOT / f"config/{server}.schema.json").read_text(),
                             "run tests/hygiene/configuration_reference.py --write build/release/bin")

    def test_shipped_configurations_conform_to_them(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        for server in SERVERS:
            schema = self.schema(server)
            jsonschema.Draft7Validator.check_schema(schema)
            files = sorted((ROOT / "config" / server).glob("*.json"))
            self.assertGreaterEqual(len(files), 4)
            for file in files:
                config = json.loads(file.read_text())
                jsonschema.validate(config, schema)
                folder = "/usr/share/webots_cloud/config" if file.name.startswith("installed") else ".."  # they go to /etc
                self.assertEqual(config.get("$schema"), f"{folder}/{server}.schema.json", file)
                self.assertLessEqual(config.keys(), schema["properties"].keys())
            with self.assertRaises(jsonschema.ValidationError):
                jsonschema.validate({"port": 70000, "simulationServers": []}, schema)
        wrong = {"port": 1, "simulationServers": [{"weight": 1}]}
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.validate(wrong, self.schema("session"))

    def test_each_key_has_a_page_in_the_terminal(self):
        for server in SERVERS:
            for name, key in self.schema(server)["properties"].items():
                shown = run(server, "--help", name)
                self.assertEqual((shown.returncode, shown.stderr), (0, ""), name)
                self.assertTrue(shown.stdout.startswith(key.get("x-aliasOf", name)), shown.stdout)
                self.assertIn("SIGHUP applies" if key["x-reloaded"] else "at the next start", shown.stdout)
                self.assertNotIn("](", shown.stdout)
                for line in shown.stdout.split("\n"):
                    self.assertTrue(len(line) <= 79 or " " not in line.strip(), line)

    def test_a_page_says_what_a_key_takes(self):
        self.assertEqual(run("session", "--help", "loadRefresh").stdout,
                         "loadRefresh\n"
                         "  time between two polls of a machine.\n"
                         "\n"
                         "  Value: a number from 0.1 to 10000000 (seconds).\n"
                         "  Default: 5 seconds.\n"
                         "  SIGHUP applies a change.\n")

    def test_of_an_unknown_key_the_nearest_is_named(self):
        shown = run("simulation", "--help", "cachSize")
        self.assertEqual((shown.returncode, shown.stdout), (2, ""))
        self.assertEqual(shown.stderr, 'webots-simulation-server: There is no key "cachSize". Did you mean "cacheSize"?\n')
        self.assertTrue(run("simulation", "--help").stdout.startswith("Usage: "))
        self.assertTrue(run("simulation", "c.json", "--help").stdout.startswith("Usage: "))


if __name__ == "__main__":
    main()
