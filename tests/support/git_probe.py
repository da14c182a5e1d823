"""Drives the program git_source_probe, which fetches worlds with the git source."""

import ctypes
import json
import os
import shutil
import subprocess
import tempfile

from .servers import program

WORLD = "#VRML_SIM R2023b utf8\nWorldInfo { }\n"
HEADER = "#VRML_SIM R2023b utf8"


def _lose_the_right_to_mount():
    """In the child: drops root's privileges for the program that it executes."""
    PR_CAPBSET_DROP, CAP_SYS_ADMIN = 24, 21
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_SYS_ADMIN)


class Probe:
    """A cache and a folder of projects; each `fetch` is a process of its own that uses them."""

    def __init__(self, forge, folder=None):
        self.program = program("git_source_probe")
        self.forge = forge
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_probe_", dir=folder)
        self.cache = os.path.join(self.folder, "cache")
        self.log = ""
        self.order = []  # the numbers of the last run's worlds, as they were done
        self.longest_pause_ms = 0.0  # of the event loop, whatever kept it: itself or other programs
        self.longest_work_ms = 0.0  # of the event loop itself, in processor time
        self.may_mount = True
        self.place = self.folder  # where runs put their projects
        self.into = ""  # the folder of the last run's projects
        self._runs = 0

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)

    def command(self, worlds, *options):
        """The command line of a run."""
        self._runs += 1
        self.into = os.path.join(self.place, f"run{self._runs}")
        os.mkdir(self.into)
        addresses = [world if "://" in world else f"{self.forge}/{world}" for world in worlds]
        command = [self.program, "--cache", self.cache, "--forge", self.forge, "--into", self.into, *options, *addresses]
        return command

    def fetch_all(self, worlds, *options, timeout=120):
        """The result for each world: dictionaries with root, revision, header and ms, or error; bytes, objects."""
        command = self.command(worlds, *options)
        finished = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=timeout,
                                  preexec_fn=None if self.may_mount else _lose_the_right_to_mount)
        self.log = finished.stderr.decode()
        if finished.returncode != 0:
            raise AssertionError(f"the probe ended with {finished.returncode}: {self.log}")
        answers, self.order = {}, []
        for line in finished.stdout.decode().splitlines():
            answer = json.loads(line)
            if "world" in answer:
                answers[answer["world"]] = answer
                self.order.append(answer["world"])
            self.longest_pause_ms = answer.get("longest_pause_ms", self.longest_pause_ms)
            self.longest_work_ms = answer.get("longest_work_ms", self.longest_work_ms)
            if "discard" in answer:
                raise AssertionError(f"discard failed: {answer['discard']}")
        return [answers[i] for i in range(len(worlds))]

    def fetch(self, world, *options):
        return self.fetch_all([world], *options)[0]

    def way(self):
        """How the last run put projects into their folders."""
        return self.log.partition("handed out by ")[2].partition(".")[0]


def tree(root):
    """Everything below a folder by relative path: bytes of files, "-> target" for links, None for folders."""
    found = {}
    for folder, folders, files in os.walk(root):
        for name in folders + files:
            path = os.path.join(folder, name)
            relative = os.path.relpath(path, root)
            if os.path.islink(path):
                found[relative] = "-> " + os.readlink(path)
            elif os.path.isdir(path):
                found[relative] = None
            else:
                with open(path, "rb") as file:
                    found[relative] = file.read()
    return found
