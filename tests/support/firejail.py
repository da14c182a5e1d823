"""Where firejail confines simulations."""

import os
import shutil
import subprocess
import unittest


def require_firejail():
    if os.geteuid() != 0:
        raise unittest.SkipTest("firejail confines simulations of root's servers only")
    if not shutil.which("firejail"):
        raise unittest.SkipTest("firejail is not installed")
    tried = subprocess.run(["firejail", "--noprofile", "true"], capture_output=True, text=True)
    if "an existing sandbox was detected" in tried.stdout + tried.stderr:
        raise unittest.SkipTest("firejail confines nothing in a PID namespace, as in a container (docs/sandboxes.md)")
