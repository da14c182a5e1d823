#!/usr/bin/python3
"""The environment of simulators, printed by a script that stands in for Webots. Protocol section 6.1.

The twin: the Python server passes on all that it has. Ours gives simulators the same of what Webots, drivers, languages, ROS and the
network need, and nothing that is the server's or a secret.
"""

import os
import shlex
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.servers import SimulationServer, main, program, wait_until  # noqa: E402

# The environment of a machine in a lab: ROS 2 with a middleware of its own, NVIDIA and VirtualGL, a campus proxy with its authority, sound over the
# network, Python and MATLAB beside the system's.
LAB = {
    "PYTHONPATH": "/opt/lab/python", "CLASSPATH": "/opt/lab/java", "MATLAB_HOME": "/opt/matlab", "MLM_LICENSE_FILE": "27000@licences",
    "ROS_DOMAIN_ID": "42", "ROS_DISTRO": "jazzy", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp", "AMENT_PREFIX_PATH": "/opt/ros/jazzy",
    "COLCON_PREFIX_PATH": "/home/lab/install", "CYCLONEDDS_URI": "file:///etc/cyclonedds.xml",
    "FASTRTPS_DEFAULT_PROFILES_FILE": "/etc/fastdds.xml",
    "http_proxy": "http://proxy.example.edu:3128", "HTTPS_PROXY": "http://proxy.example.edu:3128", "no_proxy": "localhost,.example.edu",
    "all_proxy": "socks5://proxy.example.edu", "SSL_CERT_FILE": "/etc/ssl/campus.pem", "SSL_CERT_DIR": "/etc/ssl/campus",
    "REQUESTS_CA_BUNDLE": "/etc/ssl/campus.pem", "CURL_CA_BUNDLE": "/etc/ssl/campus.pem",
    "__GLX_VENDOR_LIBRARY_NAME": "nvidia", "__NV_PRIME_RENDER_OFFLOAD": "1", "__EGL_VENDOR_LIBRARY_FILENAMES": "/etc/egl.json",
    "VGL_DISPLAY": ":1", "LIBGL_ALWAYS_SOFTWARE": "0", "CUDA_VISIBLE_DEVICES": "0", "NVIDIA_VISIBLE_DEVICES": "all",
    "PULSE_SERVER": "tcp:sound.example.edu", "LC_NUMERIC": "C", "TZ": "Europe/Zurich", "XDG_SESSION_TYPE": "x11",
}

SECRETS = {
    "GITHUB_TOKEN": "x", "AWS_SECRET_ACCESS_KEY": "x", "MAIL_PASSWORD": "x", "WEBOTS_API_KEY": "x", "SSH_AUTH_SOCK": "/tmp/agent",
    "NOTIFY_SOCKET": "", "CREDENTIALS_DIRECTORY": "/run/credentials/x", "INVOCATION_ID": "1", "JOURNAL_STREAM": "8:1", "LISTEN_FDS": "0",
    "ftp_proxy": "http://user:hunter2@proxy.example.edu:3128",
}


class Environments(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = folder.name
        webots = os.path.join(self.home, "webots")
        with open(webots, "w") as file:
            file.write(f"#!/bin/sh\nenv -0 >{self.home}/environment\nexec {shlex.quote(program('webots-demo-simulator'))} \"$@\"\n")
        os.chmod(webots, 0o755)

    async def run_in(self, environment, **settings):
        """The environment of a simulator of a server in this environment, and the server's log."""
        simulation = server(webotsHome=self.home, **settings)
        around = {"PATH": os.environ["PATH"], "HOME": simulation.folder, "WEBOTS_DEMO_ADDRESS": "127.0.0.1", **environment}
        simulation.wrapper = ("/usr/bin/env", "-i", *(f"{name}={value}" for name, value in around.items()))
        with simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            log = simulation.log()
        with open(os.path.join(self.home, "environment")) as file:
            return dict(entry.split("=", 1) for entry in file.read().split("\0") if entry), log

    async def test_it_is_the_python_servers_but_for_secrets(self):
        python = {**LAB, "DISPLAY": ":0"}  # which sets that alone
        os.mkdir(os.path.join(self.home, "bin"))  # without Xvfb
        os.symlink("/usr/bin/env", os.path.join(self.home, "bin/env"))
        found, log = await self.run_in({**LAB, **SECRETS, "DISPLAY": "", "PATH": os.path.join(self.home, "bin")})
        self.assertEqual({name: found.get(name) for name in python}, python)
        self.assertEqual([name for name in SECRETS if name in found], [])
        for name in ("AWS_SECRET_ACCESS_KEY", "GITHUB_TOKEN", "MAIL_PASSWORD", "SSH_AUTH_SOCK", "WEBOTS_API_KEY"):
            self.assertRegex(log, rf"INFO.*Simulators do not get these variables of the server's environment: .*\b{name}\b")
        self.assertRegex(log, r"WARNING.*Simulators do not get ftp_proxy: there is a password in it")
        self.assertNotIn("hunter2", log)

    async def test_the_key_passes_on_names_and_patterns_and_sets_values(self):
        entries = ["LAB_*", "GITHUB_TOKEN", "ftp_proxy", "ROS_DOMAIN_ID=7", "LAB_MODE=two words = 1", "ABSENT"]
        found, log = await self.run_in({**LAB, **SECRETS, "LAB_HOST": "h", "LAB_KEY": "x", "LAB_MODE": "old"},
                                       simulatorEnvironment=entries)
        wanted = {"LAB_HOST": "h", "GITHUB_TOKEN": "x", "ftp_proxy": SECRETS["ftp_proxy"], "ROS_DOMAIN_ID": "7",
                  "LAB_MODE": "two words = 1"}
        self.assertEqual({name: found.get(name) for name in wanted}, wanted)
        self.assertNotIn("LAB_KEY", found)  # it looks like a secret and was not named
        self.assertNotIn("ABSENT", found)
        self.assertRegex(log, r'WARNING.*"simulatorEnvironment" names ABSENT, which the server\'s own environment does not have')

    def test_a_wrong_entry_stops_the_server_with_a_sentence_that_has_no_value(self):
        simulation = SimulationServer(simulatorEnvironment=["LAB_*", "API KEY=hunter2"])
        self.addCleanup(simulation.close)
        path = simulation.configure()
        for option in (["--check-config"], []):
            finished = subprocess.run([program("webots-simulation-server"), *option, path], capture_output=True, text=True, timeout=30,
                                      cwd=simulation.folder)
            said = finished.stdout + finished.stderr
            self.assertEqual(finished.returncode, 2, said)
            self.assertIn('key "simulatorEnvironment", entry 2: expected the name of a variable, the beginning of one as in "ROS_*", '
                          'or "NAME=value", found the string "API KEY=..."', said)
            self.assertNotIn("hunter2", said)

    def test_it_takes_effect_at_the_next_start_and_the_log_says_so(self):
        with server(webotsHome=self.home) as simulation:
            simulation.reread(simulatorEnvironment=["A=1"])
            wait_until(lambda: "take effect at the next start: simulatorEnvironment\n" in simulation.log(),
                       simulation.log)


if __name__ == "__main__":
    main()
