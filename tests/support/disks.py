"""File systems that are full, or have special features."""

import os
import subprocess


def mount(test, folder, *what):
    """Mounts over an existing folder until the test is over; skips it where that is not possible."""
    if os.geteuid() != 0:
        test.skipTest("only root can mount a disk")
    if subprocess.run(["mount", *what, folder], stderr=subprocess.DEVNULL).returncode != 0:
        test.skipTest("this machine allows no such mount")
    test.addCleanup(subprocess.run, ["umount", "-l", folder], stderr=subprocess.DEVNULL)


def mount_small_disk(test, folder, size):
    mount(test, folder, "-t", "tmpfs", "-o", f"size={size}", "tmpfs")


def mount_xfs(test, folder, image):
    """A file system whose files can share their bytes, in the new file `image`."""
    with open(image, "wb") as file:
        file.truncate(320 << 20)
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    try:
        subprocess.run(["mkfs.xfs", "-q", image], check=True, stderr=subprocess.DEVNULL, env=dict(os.environ, PATH=path))
    except (OSError, subprocess.CalledProcessError):
        test.skipTest("mkfs.xfs is missing (package xfsprogs)")
    mount(test, folder, "-o", "loop", image)
