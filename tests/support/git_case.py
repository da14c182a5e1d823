"""What the tests of the git source have in common: a git server, a probe with a cache of its own, disks that are full or special."""

import os
import subprocess
import sys
import unittest

from .git_probe import Probe, require_probe
from .git_server import GitServer, require_git_server


class GitCase(unittest.TestCase):
    """`self.server` and `self.probe`, once a case has made them with `serve` and `fetch_from`; both end with the case."""

    def serve(self, **options):
        """Starts a server (options: as GitServer's) and lets the probe ask it."""
        self.server = GitServer(**options)
        self.addCleanup(self.server.close)
        self.server.start()
        self.fetch_from(self.server.url)
        return self.server

    def fetch_from(self, url):
        """The probe asks there from now on; its cache stays."""
        if not hasattr(self, "probe"):
            self.probe = Probe(url)
            self.addCleanup(self.probe.close)
        self.probe.forge = url

    def requests(self, since=0):
        """(method, address, status) of what the server was asked."""
        return [request[:3] for request in self.server.requests()[since:]]

    def left_in_cache(self):
        """What is there of fetches that are over."""
        return os.listdir(os.path.join(self.probe.cache, "incoming"))

    def small_disk(self, size="2m"):
        """A folder on a file system of this size."""
        return self._mount("disk", "-t", "tmpfs", "-o", f"size={size}", "tmpfs")

    def xfs_disk(self):
        """A folder on a file system whose files can share their bytes."""
        image = os.path.join(self.probe.folder, "image")
        with open(image, "wb") as file:
            file.truncate(320 << 20)
        try:
            subprocess.run(["mkfs.xfs", "-q", image], check=True, stderr=subprocess.DEVNULL,
                           env=dict(os.environ, PATH=os.environ.get("PATH", "") + ":/usr/sbin:/sbin"))
        except (OSError, subprocess.CalledProcessError):
            self.skipTest("mkfs.xfs is missing (package xfsprogs)")
        return self._mount("xfs", "-o", "loop", image)

    def _mount(self, name, *what):
        if os.geteuid() != 0:
            self.skipTest("only root can mount a disk")
        disk = os.path.join(self.probe.folder, name)
        os.mkdir(disk)
        if subprocess.run(["mount", *what, disk], stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("this machine allows no such mount")
        self.addCleanup(subprocess.run, ["umount", "-l", disk])
        return disk


def main():
    try:
        require_git_server()
        require_probe()
    except unittest.SkipTest as missing:
        print(f"skipped: {missing}")
        sys.exit(77)
    unittest.main(verbosity=2)
