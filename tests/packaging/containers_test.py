#!/usr/bin/python3
"""What makes the container images, as far as it needs no Docker daemon; tests/container_site.py makes them and runs a site of them.

Usage: containers_test.py BIN_FOLDER [unittest arguments]
"""

import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest

CONTAINERS = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", "config", "containers"))
BIN = ""


def load_sbom():
    spec = importlib.util.spec_from_file_location("sbom", os.path.join(CONTAINERS, "sbom.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def build(*arguments, docker="exit 0"):
    """Exit status and output of build.sh, where `docker` is this script."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "docker")
        with open(path, "w") as file:
            file.write(f"#!/bin/sh\n{docker}\n")
        os.chmod(path, 0o755)
        done = subprocess.run([os.path.join(CONTAINERS, "build.sh"), *arguments], stdin=subprocess.DEVNULL, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, env={**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"})
    return done.returncode, done.stdout


class Build(unittest.TestCase):
    def test_it_says_what_it_does(self):
        status, said = build("--help")
        self.assertEqual(status, 0)
        for option in ("--base", "--bootstrap", "--packages", "--tag", "--sbom", "--network"):
            self.assertIn(f"  {option} ", said)

    def test_what_it_does_not_know_is_refused(self):
        status, said = build("--push")
        self.assertEqual(status, 2)
        self.assertTrue(said.startswith("Usage: "), said)

    def test_packages_that_are_not_there_are_named_with_the_commands_that_make_them(self):
        with tempfile.TemporaryDirectory() as folder:
            status, said = build("--packages", folder)
        self.assertEqual(status, 1)
        self.assertIn(f"{folder} has no package webots-cloud-session-server.", said)
        self.assertIn("cpack --preset release", said)

    def test_two_versions_of_a_package_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            for version in (1, 2):
                open(os.path.join(folder, f"webots-cloud-session-server_{version}_amd64.deb"), "w").close()
            status, said = build("--packages", folder)
        self.assertEqual(status, 1)
        self.assertIn(f"{folder} has more than one version of webots-cloud-session-server.", said)

    def test_a_daemon_that_does_not_answer_is_told(self):
        status, said = build(docker="exit 1")
        self.assertEqual(status, 1)
        self.assertIn("The Docker daemon does not answer.", said)


class Sbom(unittest.TestCase):
    IMAGE = {"Id": "sha256:0123", "Created": "2026-11-24T03:00:00.123456789Z", "Config": {"Labels": {"org.opencontainers.image.licenses": "Apache-2.0"}}}
    LIBRARY = {"binary:Package": "libstdc++6:amd64", "Version": "12.2.0-14+deb12u1", "Architecture": "amd64", "source:Package": "gcc-12",
               "source:Version": "12.2.0-14+deb12u1", "Maintainer": "Debian GCC Maintainers", "Homepage": ""}
    SERVER = {"binary:Package": "webots-cloud-session-server", "Version": "1.0.0-1", "Architecture": "amd64",
              "source:Package": "webots-cloud-session-server", "source:Version": "1.0.0-1", "Maintainer": "we", "Homepage": ""}

    def setUp(self):
        self.sbom = load_sbom()
        self.document = self.sbom.document("image:1", self.IMAGE, [self.sbom.package(each) for each in (self.LIBRARY, self.SERVER)])

    def test_the_document_describes_the_image_which_contains_the_packages(self):
        self.assertEqual((self.document["spdxVersion"], self.document["dataLicense"]), ("SPDX-2.3", "CC0-1.0"))
        self.assertEqual(self.document["creationInfo"]["created"], "2026-11-24T03:00:00Z")
        identifiers = [each["SPDXID"] for each in self.document["packages"]]
        self.assertEqual(identifiers[0], "SPDXRef-Image")
        self.assertEqual(len(set(identifiers)), 3)
        for each in identifiers:
            self.assertRegex(each, r"\ASPDXRef-[A-Za-z0-9.-]+\Z")
        self.assertEqual([(each["spdxElementId"], each["relationshipType"], each["relatedSpdxElement"]) for each in self.document["relationships"]],
                         [("SPDXRef-DOCUMENT", "DESCRIBES", "SPDXRef-Image"), *(("SPDXRef-Image", "CONTAINS", each) for each in identifiers[1:])])

    def test_scanners_find_packages_by_their_addresses(self):
        library, server = (each["externalRefs"][0]["referenceLocator"] for each in self.document["packages"][1:])
        self.assertEqual(library, "pkg:deb/debian/libstdc%2B%2B6@12.2.0-14%2Bdeb12u1?arch=amd64&upstream=gcc-12%4012.2.0-14%2Bdeb12u1")
        self.assertTrue(server.startswith("pkg:deb/webots_cloud/webots-cloud-session-server@1.0.0-1?"), server)


class Configurations(unittest.TestCase):
    def test_that_of_the_simulation_server_is_good(self):
        done = subprocess.run([os.path.join(BIN, "webots-simulation-server"), "--check-config", os.path.join(CONTAINERS, "simulation.json")],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop(1))
    unittest.main()
