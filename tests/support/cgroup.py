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
