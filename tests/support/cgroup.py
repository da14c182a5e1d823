"""A control group for the memory of what a test starts: of version 1 or 2, whichever the machine has."""

import contextlib
import os
import tempfile
import unittest

from .servers import wait_until

ROOT = "/sys/fs/cgroup"


class MemoryGroup:
    """A group of our own; SkipTest where none can be made.

        with MemoryGroup() as group:
            group.limit(100)  # megabytes
            subprocess.run(..., preexec_fn=group.join)
    """

    def __enter__(self):
        first = os.path.exists(f"{ROOT}/memory/memory.limit_in_bytes")
        parent = f"{ROOT}/memory" if first else ROOT
        self.limits = "memory.limit_in_bytes" if first else "memory.max"
        self.events = "memory.oom_control" if first else "memory.events"
        try:
            self.folder = tempfile.mkdtemp(prefix="webots_cloud_test_", dir=parent)
        except OSError as error:
            raise unittest.SkipTest(f"no control group can be made here: {error}")
        # Without such a file, the folder is no control group, or its memory controller is not delegated to us.
        if not os.access(os.path.join(self.folder, self.limits), os.W_OK):
            self.__exit__()
            raise unittest.SkipTest(f"control groups below {parent} limit no memory")
        return self

    def __exit__(self, *_):
        wait_until(self._remove, f"{self.folder} still has processes")  # guards end after their server

    def _remove(self):
        with contextlib.suppress(OSError):
            os.rmdir(self.folder)
        return not os.path.isdir(self.folder)

    def limit(self, megabytes):
        with open(os.path.join(self.folder, self.limits), "w") as file:
            file.write(str(megabytes << 20))

    def join(self):
        """Puts the calling process there."""
        with open(os.path.join(self.folder, "cgroup.procs"), "w") as file:
            file.write(str(os.getpid()))

    def killed(self):
        """How many processes the kernel has killed there for their memory."""
        with open(os.path.join(self.folder, self.events)) as file:
            return next(int(line.split()[1]) for line in file if line.startswith("oom_kill "))


class DelegatedGroups:
    """A group of our own in each hierarchy, in which another user may make others; SkipTest where none can be made.

        with DelegatedGroups(NOBODY) as groups:
            subprocess.run([*groups.joining("setpriv", ...), ...])
    """

    CONTROLLERS = ("memory", "pids", "cpu", "cpuacct")
    OF_THE_OWNER = ("", "cgroup.procs", "cgroup.subtree_control", "cgroup.threads")  # as systemd has it; some are of version 2 alone

    def __init__(self, user):
        self.user = user
        self.folders = []

    def __enter__(self):
        first = {os.path.realpath(f"{ROOT}/{each}") for each in self.CONTROLLERS if os.path.exists(f"{ROOT}/{each}/cgroup.procs")}
        try:
            for parent in first or [ROOT]:
                if not first:
                    with open(f"{ROOT}/cgroup.subtree_control", "w") as file:
                        file.write("+memory +pids +cpu")
                folder = tempfile.mkdtemp(prefix="webots_cloud_test_", dir=parent)
                self.folders.append(folder)
                os.chmod(folder, 0o755)
                for name in self.OF_THE_OWNER:
                    path = os.path.join(folder, name)
                    if os.path.exists(path):
                        os.chown(path, self.user, self.user)
        except OSError as error:
            self.__exit__()
            raise unittest.SkipTest(f"no control group can be made here: {error}")
        return self

    def __exit__(self, *_):
        wait_until(self._remove, f"{self.folders} still have processes")

    def _remove(self):
        """With the groups in them."""
        for folder in self.folders:
            for each, _, _ in os.walk(folder, topdown=False):
                with contextlib.suppress(OSError):
                    os.rmdir(each)
        return not any(map(os.path.isdir, self.folders))

    def joining(self, *command):
        """A command line that enters them, and then runs this and what is put behind it."""
        enter = "".join(f"echo 0 > {folder}/cgroup.procs && " for folder in self.folders)
        return ("sh", "-c", f'{enter}exec "$@"', "sh", *command)
