"""The simulation server as another user, or where the kernel allows no namespaces."""

import os
import shutil
import subprocess
import tempfile
import unittest

from .browser_client import LOCAL
from .servers import SimulationServer, program

NOBODY = 65534
GREEDY_USER = 65532  # whoever uses up what the kernel gives a user, while other tests run as nobody
PROGRAMS = ("webots-simulation-server", "webots-process-guard", "webots-demo-simulator")
# In a user namespace of its own a test may forbid itself to make others, without effect outside.
WITHOUT_NAMESPACES = ("unshare", "--user", "--map-root-user", "sh", "-c",
                      'echo 0 > /proc/sys/user/max_user_namespaces && echo 0 > /proc/sys/user/max_pid_namespaces && exec "$@"', "sh")


# Like a machine that hides the processes of other users; switches to another user.
WITH_HIDDEN_PROCESSES = ("unshare", "--mount", "sh", "-c", 'mount -t proc -o hidepid=2 proc /proc && '
                         f'exec setpriv --reuid {NOBODY} --regid {NOBODY} --clear-groups "$@"', "sh")


FIRST = 1_900_000_000  # nobody's on this machine
RANGE = f"nobody:{FIRST}:65536\n"
# systemd gives root's commands of a unit with mounts of its own such mounts too.
AS_OF_A_UNIT = ("unshare", "--mount", "--propagation", "slave")
PINNED = 0x74000000 + NOBODY % 1024 * 65536  # the numbers that the guard gives this user with --pin-users


def require_subordinate_users():
    """SkipTest where a server of `nobody` can have no numbers of /etc/subuid."""
    if os.geteuid() != 0:
        raise unittest.SkipTest("only root can start servers as another user")
    for name in ("newuidmap", "newgidmap"):
        if not shutil.which(name, path=os.environ["PATH"] + ":/usr/bin"):
            raise unittest.SkipTest(f"{name} is not installed (Debian's package uidmap)")
    if not may_make_namespaces(NOBODY):
        raise unittest.SkipTest("users other than root may make no namespaces here")
    for path in ("/etc/subuid", "/etc/subgid"):
        if not os.path.exists(path):
            raise unittest.SkipTest(f"there is no {path}")


def as_nobody_with_numbers(lines=RANGE, mask="022"):
    """The command line that the server's is put behind: it alone has these lines in /etc/subuid, in a mount namespace of its own, and
    switches to another user."""
    return ("unshare", "--mount", "sh", "-c",
            f'mount -t tmpfs none /mnt && printf %s "$0" > /mnt/ranges && mount --bind /mnt/ranges /etc/subuid && '
            f'mount --bind /mnt/ranges /etc/subgid && umount -l /mnt && umask {mask} && exec setpriv --reuid {NOBODY} --regid {NOBODY} --clear-groups "$@"',
            lines)


def works(wrapper):
    return subprocess.run([*wrapper, "true"], stderr=subprocess.DEVNULL).returncode == 0


def may_make_namespaces(user=None):
    """Whether the kernel lets another user, or us, make a PID namespace: root can, other users need a user namespace."""
    commands = [["unshare", "--user", "--map-root-user", "--pid", "--fork", "true"]]
    if user is None and os.geteuid() == 0:
        commands.append(["unshare", "--pid", "--fork", "true"])
    return any(subprocess.run(command, stderr=subprocess.DEVNULL, user=user, group=user, extra_groups=None if user is None else []
                              ).returncode == 0 for command in commands)


class OwnedServer(SimulationServer):
    """All its files belong to the user who runs it, also copies of the programs, which that user might not be able to reach."""

    def __init__(self, user=None, wrapper=(), wrapper_drops_privileges=False, **config):
        super().__init__(**{**LOCAL, **config})
        self.owner = user
        self.user = None if wrapper_drops_privileges else user
        self.wrapper = wrapper

    def program(self):
        if self.owner is None:
            return super().program()
        return os.path.join(self.folder, "bin", self.PROGRAM)

    def start(self):
        if self.owner is not None and not os.path.isdir(os.path.join(self.folder, "bin")):
            os.mkdir(os.path.join(self.folder, "bin"))
            for name in PROGRAMS:
                shutil.copy(program(name), os.path.join(self.folder, "bin"))
            if self.config["forges"] == LOCAL["forges"]:
                projects = shutil.copytree(LOCAL["forges"][0]["directory"], os.path.join(self.folder, "projects"),
                                           ignore=lambda folder, names: [name for name in names
                                                                         if "." in name and folder.endswith("examples")])
                self.config["forges"] = [{"url": "local:", "directory": projects}]
        self.configure()
        os.makedirs(os.path.join(self.folder, "tmp"), exist_ok=True)
        if self.owner is not None:
            subprocess.run(["chown", "-R", "-h", f"{self.owner}:{self.owner}", self.folder], check=True)
        super().start()


class ServiceServer(OwnedServer):
    """As the unit of config/systemd runs it: root has made users for its simulations, and the server may gain no privileges."""

    def __init__(self, mask="022", user=NOBODY, **config):
        super().__init__(user, ("sh", "-c", f'umask {mask} && exec setpriv --reuid {user} --regid {user} --clear-groups --no-new-privs '
                                  '--bounding-set=-all --inh-caps=-all "$@"', "sh"), True, **config)
        self.runtime = tempfile.mkdtemp(prefix="webots-runtime-")
        os.chown(self.runtime, user, user)
        self.environment["RUNTIME_DIRECTORY"] = self.runtime

    def guard(self, option):
        """As ExecStartPre= and ExecStopPost= do; what it says."""
        return subprocess.run([*AS_OF_A_UNIT, program("webots-process-guard"), option, self.runtime], capture_output=True, text=True, timeout=30).stderr

    def operator_socket(self):
        return os.path.join(self.runtime, f"simulation-{self.port}.sock")

    def start(self):
        self.guard("--pin-users")
        super().start()

    def close(self):
        super().close()
        self.guard("--unpin-users")
        if os.path.isdir(self.runtime):
            os.rmdir(self.runtime)
