#!/usr/bin/python3
"""The templates of config/simulation/docker, as text: what each service gets. Protocol section 6.3; docker_test.py runs them."""

import json
import os
import re
import socket
import stat
import unittest

TEMPLATES = os.path.join(os.path.dirname(__file__), "..", "..", "config", "simulation", "docker")
# What the server writes into `.env`; the last two for an editor only.
VALUES = {"IMAGE", "PROJECT_PATH", "MAKE", "PORT", "COMPOSE_PROJECT_NAME", "WEBOTS", "DISPLAY", "SERVER", "RUNTIME", "GRAPHICS_DEVICE",
          "PORT_PREFIX"}
EDITOR_VALUES = {"THEIA_VOLUME", "THEIA_PORT"}
IPC = ("/tmp/webots-${PORT}/ipc/participant", "/tmp/webots/root/${PORT}/ipc/participant")


def read(name):
    with open(os.path.join(TEMPLATES, name)) as file:
        return file.read()


def services(kind):
    """The text of each service of a template."""
    body = read(f"docker-compose-{kind}.yml").split("\nservices:\n")[1].split("\nvolumes:\n")[0]
    parts = re.split(r"(?m)^  (\w+):\n", body)
    return dict(zip(parts[1::2], parts[2::2]))


class Templates(unittest.TestCase):
    def test_each_has_its_services(self):
        self.assertEqual({kind: list(services(kind)) for kind in ("default", "theia", "competition")},
                         {"default": ["webots"], "theia": ["webots", "theia"], "competition": ["webots", "controller", "theia"]})

    def test_no_value_is_asked_for_that_the_server_does_not_give(self):
        for kind, values in (("default", VALUES), ("theia", VALUES | EDITOR_VALUES), ("competition", VALUES | EDITOR_VALUES)):
            with self.subTest(kind):
                self.assertLessEqual(set(re.findall(r"\$\{(\w+)", read(f"docker-compose-{kind}.yml"))), values)

    def test_the_simulator_has_its_port_its_screen_its_graphics_and_a_terminal(self):
        for kind in ("default", "theia", "competition"):
            simulator = services(kind)["webots"]
            for line in ("    command: ${WEBOTS}\n", '      - "${PORT_PREFIX}${PORT}:${PORT}"\n', "      DISPLAY: ${DISPLAY}\n",
                         "      - /tmp/.X11-unix:/tmp/.X11-unix\n", "      - ${GRAPHICS_DEVICE}\n", "    runtime: ${RUNTIME}\n",
                         "    stdin_open: true\n", "    tty: true\n"):
                with self.subTest(kind=kind, line=line.strip()):
                    self.assertIn(line, simulator)

    def test_the_image_is_built_with_what_its_dockerfile_asks_for(self):
        asked = re.findall(r"(?m)^ARG (\w+)", read("Dockerfile.default"))
        self.assertTrue(asked)
        for kind in ("default", "theia", "competition"):
            with self.subTest(kind):
                given = re.findall(r"(?m)^        (\w+): \$\{\w+\}$", services(kind)["webots"])
                self.assertEqual(sorted(given), sorted(asked))

    def test_an_editor_shows_the_folder_of_the_simulator_or_of_the_participant_alone(self):
        for kind, owner in (("theia", "webots"), ("competition", "controller")):
            with self.subTest(kind):
                self.assertIn('      - "${PORT_PREFIX}${THEIA_PORT}:3000"\n', services(kind)["theia"])
                self.assertIn("      - project:/home/project/webots-project\n", services(kind)["theia"])
                self.assertIn("      - project:/usr/local/${THEIA_VOLUME}\n", services(kind)[owner])
        self.assertNotIn("project:", services("competition")["webots"].replace("webots-project:", ""))

    def test_the_controller_of_a_competition_reaches_the_simulator(self):
        both = services("competition")
        for service in ("webots", "controller"):
            for folder in IPC:
                self.assertIn(f"      - ipc:{folder}\n", both[service])
            self.assertIn("      USER: root\n", both[service], "a part of one of these folders")
        for line in ("        WEBOTS_CONTROLLER_URL: participant\n", "        PROJECT_PATH: ${PROJECT_PATH}\n", "      PORT: ${PORT}\n",
                     "      WEBOTS_STDOUT_REDIRECT: 1\n", "      WEBOTS_STDERR_REDIRECT: 1\n", "    tty: true\n"):
            self.assertIn(line, both["controller"])

    def test_the_list_of_system_calls_makes_no_namespaces_and_no_sockets_to_other_machines_but_of_the_internet(self):
        calls = json.loads(read("seccomp.json"))
        self.assertEqual(calls["defaultAction"], "SCMP_ACT_ERRNO")
        plain = {name for rule in calls["syscalls"] if "args" not in rule and rule["action"] == "SCMP_ACT_ALLOW" for name in rule["names"]}
        self.assertLessEqual({"execve", "fork", "futex", "openat", "rseq", "newfstatat"}, plain)
        self.assertFalse(plain & {"bpf", "clone", "clone3", "io_uring_setup", "keyctl", "mknod", "mknodat", "mount", "perf_event_open",
                                  "setns", "socket", "unshare"})
        sockets = [rule["args"] for rule in calls["syscalls"] if rule["names"] == ["socket"]]
        self.assertEqual({each[0]["value"] for each in sockets}, {socket.AF_UNIX, socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK})
        types = {each[1]["valueTwo"] for each in sockets if each[0]["value"] in (socket.AF_INET, socket.AF_INET6)}
        self.assertEqual(types, {socket.SOCK_STREAM, socket.SOCK_DGRAM}, "no raw ones")
        made = {rule["args"][0]["valueTwo"] for rule in calls["syscalls"] if rule["names"] in (["mknod"], ["mknodat"])}
        self.assertEqual(made, {0, stat.S_IFREG, stat.S_IFIFO, stat.S_IFSOCK}, "no devices")

    def test_no_service_can_gain_privileges_and_every_volume_is_the_projects_own(self):
        for kind in ("default", "theia", "competition"):
            for name, service in services(kind).items():
                with self.subTest(kind=kind, service=name):
                    self.assertIn("    security_opt:\n      - no-new-privileges:true\n", service)
                    for volume in re.findall(r"      - (\w+):/", service):
                        self.assertRegex(read(f"docker-compose-{kind}.yml"), rf"(?ms)^volumes:\n.*^  {volume}:$")


if __name__ == "__main__":
    unittest.main(verbosity=2)
