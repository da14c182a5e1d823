"""A Docker daemon of the test's own, apart from the machine's: everything of it lies in one folder.

    with DockerDaemon() as docker:
        docker.import_image("name:tag", {"bin/program": "/path/of/program"})
        docker.run("ps", "--all")
"""

import contextlib
import json
import os
import re
import shutil
import subprocess
import tarfile
import tempfile
import unittest

from .processes import Startable, end_with_parent
from .servers import SimulationServer, end, is_alive, wait_until

# Debian's programs, whatever else is on the machine.
PATH = "/usr/sbin:/usr/bin:/sbin:/bin:/usr/local/sbin:/usr/local/bin"
# What ships for containers, and Webots in them as far as tests have it.
TEMPLATES = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", "config", "simulation", "docker"))
IMAGES = "webots_cloud_test/webots"
# Another compose than the machine's: the program of Debian 13's package docker-compose, say.
COMPOSE_PLUGIN = os.environ.get("COMPOSE_PLUGIN")


def require_docker():
    for name, package in {"dockerd": "docker.io", "docker": "docker.io or docker-cli"}.items():
        if not shutil.which(name, path=PATH):
            raise unittest.SkipTest(f"{name} is missing (package {package})")
    if os.geteuid() != 0:
        raise unittest.SkipTest("only root can start a Docker daemon")


def compose_command():
    """How compose is called here."""
    require_docker()
    if COMPOSE_PLUGIN or subprocess.run(["docker", "compose", "version"], env={"PATH": PATH}, capture_output=True).returncode == 0:
        return ["docker", "compose"]
    if shutil.which("docker-compose", path=PATH):
        return ["docker-compose"]
    raise unittest.SkipTest("there is no docker compose (package docker-compose)")


def docker_server(docker, git, **settings):
    """A simulation server that runs the projects of this git server in containers."""
    environment = {**docker.environment, "DISPLAY": ""}
    return SimulationServer(environment=environment, docker=True, forges=[git.url], allowedRepositories=[git.url], maxConnections=8,
                            **{"dockerDir": TEMPLATES, "dockerImages": IMAGES, **settings})


def libraries_of(program):
    """The libraries that a program loads; none of a file that is no program."""
    with open(program, "rb") as file:
        if file.read(4) != b"\x7fELF":
            return []
    said = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return [word for word in said.split() if word.startswith("/")]


def python_files(*modules):
    """The machine's own Python, as far as a script with these modules needs it."""
    list_them = f"""import sys, {', '.join(modules)}
for each in list(sys.modules.values()):
    print(getattr(each, '__file__', None) or '')"""
    said = subprocess.run(["/usr/bin/python3", "-I", "-c", list_them], capture_output=True, text=True, check=True).stdout
    return ["/usr/bin/python3", *sorted({path for path in said.split("\n") if path.startswith("/usr/lib/python3.")})]


def files_below(folder):
    return [os.path.join(path, name) for path, _, names in os.walk(folder) for name in names]


def xvfb_files():
    """What `xvfb-run` needs; SkipTest where it is not installed."""
    programs = ("xvfb-run", "Xvfb", "xkbcomp", "xauth", "getopt", "mktemp", "mcookie", "touch", "rm")
    found = {name: shutil.which(name, path=PATH) for name in programs}
    if not all(found.values()):
        raise unittest.SkipTest(f"{', '.join(name for name in found if not found[name])} is missing (packages xvfb and xauth)")
    return [*found.values(), *files_below("/usr/share/X11/xkb")]


class DockerDaemon(Startable):
    def __init__(self, bridges=False, options=()):
        """`bridges`: with Docker's default network and its rules of the firewall, which want a network namespace of the test's own."""
        require_docker()
        self.options = [*([] if bridges else ["--bridge=none", "--iptables=false", "--ip6tables=false"]), *options]
        self.folder = tempfile.mkdtemp(prefix="docker_", dir="/tmp")  # short: a socket is in it
        self.host = f"unix://{self.folder}/docker.sock"
        self.environment = {"PATH": PATH, "DOCKER_HOST": self.host, "DOCKER_CONFIG": os.path.join(self.folder, "config")}
        if COMPOSE_PLUGIN:
            os.makedirs(f"{self.folder}/config/cli-plugins")
            os.symlink(os.path.abspath(COMPOSE_PLUGIN), f"{self.folder}/config/cli-plugins/docker-compose")
        self.process = None

    def start(self):
        """Without bridges, no firewall is changed: a proxy publishes ports."""
        command = ["dockerd", "--host", self.host, "--data-root", f"{self.folder}/data", "--exec-root", f"{self.folder}/exec",
                   "--pidfile", f"{self.folder}/pid", *self.options]
        with open(f"{self.folder}/log", "wb") as log:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            env={**os.environ, "PATH": PATH}, preexec_fn=end_with_parent)
        wait_until(lambda: self.process.poll() is not None or self.attempt("info").returncode == 0, "dockerd does not answer", 60)
        if self.process.poll() is not None or self.attempt("network", "create", "probe").returncode != 0:
            raise unittest.SkipTest(f"dockerd can't run here: {self.last_words()}")
        self.run("network", "rm", "probe")

    def crash(self):
        """Ends it without a word; `start` starts it again."""
        number = f"{self.folder}/exec/containerd/containerd.pid"
        with open(number) as file:
            containerd = int(file.read())
        self.process.kill()
        self.process.wait()
        wait_until(lambda: not is_alive(containerd), "containerd lives on")
        os.unlink(number)  # a dockerd that finds it while nobody has waited for that process takes it for running

    def last_words(self):
        with open(f"{self.folder}/log", errors="replace") as log:
            said = log.read().strip().splitlines() or ["nothing"]
        return next((line for line in said if re.search(r"level=(fatal|error)|^panic:|failed to", line)), said[-1])[:300]

    def attempt(self, *arguments):
        return subprocess.run(["docker", *arguments], env=self.environment, capture_output=True, text=True)

    def run(self, *arguments):
        """The output of a docker command."""
        done = self.attempt(*arguments)
        if done.returncode != 0:
            ended = f" (dockerd has ended with {self.process.returncode}: {self.last_words()})" if self.process.poll() is not None else ""
            raise AssertionError(f"docker {' '.join(arguments)}: {done.stderr}{ended}")
        return done.stdout

    def container_of(self, service):
        """The only container of this service of compose. A simulator in it may be heard before newer releases of Docker list it."""
        def found():
            return self.run("ps", "--quiet", "--filter", f"label=com.docker.compose.service={service}").split()
        wait_until(lambda: len(found()) == 1, f"there is no container of {service}, or more than one")
        return found()[0]

    def import_image(self, name, files, programs, command=("/bin/sleep", "1000")):
        """An image with these files (inside: outside), and with these programs at their own paths; and all libraries."""
        archive = os.path.join(self.folder, "image.tar")
        with tarfile.open(archive, "w", dereference=True) as tar:
            wanted = {**files, **{program: program for program in programs}}
            for program in list(wanted.values()):
                wanted.update({library: library for library in libraries_of(program)})
            for inside, outside in wanted.items():
                tar.add(outside, inside.lstrip("/"), recursive=False)
        self.run("import", "--change", f"CMD {json.dumps(command)}", archive, name)

    def import_old_image(self, source, name):
        """The image `source` once more, as if it had been made years ago."""
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            packed, unpacked = os.path.join(folder, "packed.tar"), os.path.join(folder, "image")
            self.run("save", "--output", packed, source)
            with tarfile.open(packed) as tar:
                tar.extractall(unpacked)
            with open(os.path.join(unpacked, "manifest.json")) as file:
                manifest = json.load(file)
            with open(os.path.join(unpacked, manifest[0]["Config"])) as file:
                config = json.load(file)
            config |= {"created": "2020-01-02T03:04:05Z", "author": name}  # an image of its own
            manifest[0] |= {"Config": "old.json", "RepoTags": [name]}
            for path, content in (("manifest.json", manifest), ("old.json", config)):
                with open(os.path.join(unpacked, path), "w") as file:
                    json.dump(content, file)
            with contextlib.suppress(FileNotFoundError):
                os.unlink(os.path.join(unpacked, "repositories"))
            with tarfile.open(packed, "w") as tar:
                tar.add(unpacked, ".")
            self.run("load", "--input", packed)

    def things(self):
        """Every container, network of compose, and volume that there is."""
        return {"containers": self.run("ps", "--all", "--format", "{{.Names}} {{.State}}").splitlines(),
                "networks": self.run("network", "ls", "--filter", "type=custom", "--format", "{{.Name}}").splitlines(),
                "volumes": self.run("volume", "ls", "--quiet").splitlines()}

    def close(self):
        if self.process:
            end(self.process)
        with open("/proc/self/mounts") as mounts:
            left = [line.split()[1] for line in mounts if line.split()[1].startswith(self.folder)]
        for mount in reversed(left):
            subprocess.run(["umount", "--lazy", mount], stderr=subprocess.DEVNULL)
        shutil.rmtree(self.folder, ignore_errors=True)
