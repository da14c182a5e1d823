"""What the tests of the git source share: a git server, a probe with a cache of its own, and special file systems."""

import os
import sys
import unittest

from .disks import mount_small_disk, mount_xfs
from .git_probe import Probe
from .refusals import sentence
from .servers import program
from .git_server import GitServer, require_git_server
from .waiting import wait_until


def about_commit(row, commit):
    """The sentence of that row about a commit of the usual repository."""
    return sentence(row, commit=commit[:12], name="owner/robots")


class GitCase(unittest.TestCase):
    """`self.server` and `self.probe`, once a case has made them with `serve` and `fetch_from`; both end with the case."""

    def serve(self, **options):
        """Starts a server (options: as GitServer's) and has the probe fetch from it."""
        self.server = GitServer(**options)
        self.addCleanup(self.server.close)
        self.server.start()
        self.fetch_from(self.server.url)
        return self.server

    def fetch_from(self, url):
        """Has the probe fetch from another address from now on, with the same cache."""
        if not hasattr(self, "probe"):
            self.probe = Probe(url)
            self.addCleanup(self.probe.close)
        self.probe.forge = url

    def requests(self, since=0):
        """The requests to the server: (method, address, status)."""
        return [request[:3] for request in self.server.requests()[since:]]

    def sent_in_transfer(self, received):
        """How much the server has sent in the transfer that brought most of these bytes, once that is over for the server too."""
        def transfers():
            return [sent for method, _, _, sent, _ in self.server.requests() if method == "POST" and 2 * sent >= received]
        return max(wait_until(transfers, lambda: f"no transfer of {received} bytes in {self.server.requests()}"))

    def left_in_cache(self):
        """Files that finished fetches have left behind."""
        return os.listdir(os.path.join(self.probe.cache, "incoming"))

    def snapshots(self):
        """The folders in the cache."""
        repositories = os.path.join(self.probe.cache, "repositories")
        return [os.path.join(repositories, repository, name) for repository in os.listdir(repositories)
                for name in os.listdir(os.path.join(repositories, repository)) if name != "refs"]

    def small_disk(self, size="2m"):
        """A folder on a file system of this size."""
        disk = self._folder("disk")
        mount_small_disk(self, disk, size)
        return disk

    def xfs_disk(self):
        """A folder on a file system whose files can share their bytes."""
        disk = self._folder("xfs")
        mount_xfs(self, disk, os.path.join(self.probe.folder, "image"))
        return disk

    def _folder(self, name):
        folder = os.path.join(self.probe.folder, name)
        os.mkdir(folder)
        return folder


def require_git_and_probe():
    """Ends the program as skipped if git servers or the probe can't run here."""
    try:
        require_git_server()
        program("git_source_probe")
    except unittest.SkipTest as missing:
        print(f"skipped: {missing}")
        sys.exit(77)


def main():
    require_git_and_probe()
    unittest.main(verbosity=2)
