#!/usr/bin/python3
"""Starts a site in many odd but real environments (support/environment_rows.py). In each one it works (the page, a start, a picture that moves, a
stop after which nothing is left), or the first sentence that people see says what is wrong. Prints a table.

    WEBOTS_CLOUD_BIN=build/release/bin tests/environments.py [--jobs N] [PART OF A NAME ...]

As root, since each row gets a network, processes and mounts of its own. Nothing is compiled: the programs are the release's, and cmake does
nothing. The clock is changed where libfaketime is installed, or FAKETIME_LIBRARY names it.
"""

import argparse
import asyncio
import concurrent.futures
import glob
import json
import os
import re
import shlex
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import traceback
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support.browser_client import WORLD, websockets  # noqa: E402
from support.environment_rows import ROWS  # noqa: E402
from support.servers import BIN  # noqa: E402
from support.waiting import wait_until  # noqa: E402

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
PATIENCE = 120  # seconds for one command, page or picture
ROW_PATIENCE = 400
USERS = {"root": 0, "ada": 1001, "nobody": 65534}
PICTURE = b"\xff\xd8\xff"  # how a JPEG begins
PROGRAMS = ("webots-session-server", "webots-simulation-server", "webots-process-guard", "webots-demo-simulator", "webots-site", "webots-website-host")

# Mounts of a row. The machine's own folders stay as they are, below.
MOUNTS = r"""
ip link set lo up
for folder in /srv /home /root /run /dev/shm; do mount -t tmpfs -o mode=755 none $folder; done
chmod 1777 /dev/shm; mkdir -m 755 -p /srv/bin /home/ada /run/user; chown 1001:1001 /home/ada
mount --bind "$BIN" /srv/bin
{ cat /etc/passwd; echo ada:x:1001:1001::/home/ada:/bin/bash; } >/srv/passwd; mount --bind /srv/passwd /etc/passwd
{ cat /etc/group; echo ada:x:1001:; } >/srv/group; mount --bind /srv/group /etc/group
printf '#!/bin/sh\nexit 0\n' >/srv/cmake; chmod 755 /srv/cmake; mount --bind /srv/cmake "$(command -v cmake)"
"""

# What rows call.
WORDS = r"""
listen() { python3 -c '
import os, signal, socket, sys
family = socket.AF_INET6 if ":" in sys.argv[1] else socket.AF_INET
held = socket.create_server((sys.argv[1], int(sys.argv[2])), family=family)
if os.fork() == 0:
    os.closerange(0, 3)
    signal.pause()' "$1" "$2"; }
set_key() { python3 -c '
import json, sys
keys = json.load(open(sys.argv[1]))
keys[sys.argv[2]] = json.loads(sys.argv[3])
json.dump(keys, open(sys.argv[1], "w"), indent=2)' "$1" "$2" "$3"; }
without() {
    local folder
    mkdir -p /srv/over; mount -t tmpfs none /srv/over
    for folder in /usr/bin /usr/sbin; do
        mkdir -p /srv/over/$folder.upper /srv/over/$folder.work
        mount -t overlay -o lowerdir=$folder,upperdir=/srv/over/$folder.upper,workdir=/srv/over/$folder.work none $folder
        (cd $folder && rm -f "$@")
    done
    [[ " $* " == *" cmake "* ]] || mount --bind /srv/cmake /usr/bin/cmake
}
certificate() {
    mkdir -p tls
    openssl req -newkey ${key:-rsa:2048} -nodes -subj /CN=localhost -addext subjectAltName=DNS:localhost -keyout tls/key.pem -out /srv/request 2>/dev/null
    openssl x509 -req -in /srv/request -signkey tls/key.pem -copy_extensions copy -out tls/certificate.pem "$@" 2>/dev/null
}
dated_certificate() {
    certificate -days 1
    mkdir -p /srv/ca; : >/srv/ca/index; echo 01 >/srv/ca/serial
    printf '[ca]\ndefault_ca=a\n[a]\ndir=/srv/ca\ndatabase=/srv/ca/index\nserial=/srv/ca/serial\nnew_certs_dir=/srv/ca\ndefault_md=sha256\npolicy=p\ncopy_extensions=copy\n[p]\ncommonName=supplied\n' >/srv/ca/config
    openssl ca -batch -notext -config /srv/ca/config -selfsign -keyfile tls/key.pem -in /srv/request -startdate "$1" -enddate "$2" \
        -out tls/certificate.pem 2>/dev/null
}
as_user() { (cd "$FOLDER"; $AS_USER "$@"); }
get() { python3 -c '
import ssl, sys, urllib.request
print(urllib.request.urlopen(sys.argv[-1], timeout=20, context=ssl._create_unverified_context()).read().decode())' "$@"; }
log() { cat "$FOLDER"/log/{session,simulation}/output.log; }
"""


class Fault(Exception):
    pass


class Site:
    """A checkout in the namespaces of a row; the programs are there already."""

    def __init__(self, row):
        self.row = row
        self.folder = os.path.join("/srv", row.folder)
        self.number = USERS.get(row.user) if row.user in USERS else int(row.user)
        self.made = 0

    def make(self):
        os.makedirs(self.folder)
        copied = ("server.sh", ".gitattributes", "cmake/packages", "config", "examples/demo_projects", "examples/website_host")
        for name in copied:
            source, target = os.path.join(ROOT, name), os.path.join(self.folder, name)
            os.makedirs(os.path.dirname(target), exist_ok=True)
            if os.path.isdir(source):
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("node_modules", "*.cpp", "*.hpp"))
            else:
                shutil.copy(source, target)
        for name in ("src/web/view", "src/web/class"):  # what npm would install is there
            for place in (name, f"build/node/{name}"):
                os.makedirs(os.path.join(self.folder, place), exist_ok=True)
                shutil.copy(os.path.join(ROOT, name, "package-lock.json"), os.path.join(self.folder, place))
        # The machine that runs this may be busy: that is not what these rows are about.
        for path in glob.glob(os.path.join(glob.escape(self.folder), "config/session/*.json")):
            with open(path) as file:
                config = json.load(file)
            with open(path, "w") as file:
                json.dump({**config, "loadThreshold": 1000}, file, indent=2)
        programs = os.path.join(self.folder, "build/release/bin")
        os.makedirs(programs)
        subprocess.run(["mount", "--bind", "/srv/bin", programs], check=True)
        subprocess.run(["chown", "-R", f"{self.number}:{self.number}", self.folder], check=True, stderr=subprocess.DEVNULL)

    def environment(self):
        name = {0: "root", 1001: "ada"}.get(self.number, "somebody")
        home = {0: "/root", 1001: "/home/ada"}.get(self.number, "/nonexistent")
        path = "/usr/local/bin:/usr/bin:/bin" if self.number else "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        return {"HOME": home, "USER": name, "LOGNAME": name, "PATH": path, "LANG": "C.UTF-8", "TERM": "dumb",
                "FAKETIME_LIBRARY": os.environ["FAKETIME_LIBRARY"]}

    def as_user(self):
        return [] if self.number == 0 else ["setpriv", f"--reuid={self.number}", f"--regid={self.number}", "--clear-groups"]

    def type(self, verb):
        """What people type; returns exit status, standard output and standard error, which are kept in files: servers live on."""
        self.made += 1
        words = verb.split()
        command = self.row.typed.replace("{}", "./server.sh " + " ".join(words))
        environment = {**self.environment(), "VERB": verb, **({"OLDPWD": self.folder})}
        names = [f"/srv/.{kind}{self.made}" for kind in ("out", "err")]
        with open(names[0], "w") as out, open(names[1], "w") as err:
            done = subprocess.run([*self.as_user(), "bash", "-c", command], cwd=self.folder, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                  timeout=PATIENCE)
        return done.returncode, *(open(name, errors="replace").read() for name in names)

    def run(self, script, what, started=""):
        """As root, with the words of rows; raises what it says."""
        as_user = shlex.join([*self.as_user(), "env", "-i", *(f"{name}={value}" for name, value in self.environment().items() if value)])
        environment = {**os.environ, "STARTED": started, "FOLDER": self.folder, "AS_USER": as_user, "BIN": "/srv/bin", "PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}
        done = subprocess.run(["bash", "-c", f"set -e -o pipefail; . /srv/words\n{script}"], cwd=self.folder, env=environment, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, errors="replace", timeout=PATIENCE)
        if done.returncode != 0 or done.stdout.strip():
            raise Fault(f"{what}: {(done.stdout + done.stderr).strip() or script}")


def running():
    """Our servers, as /proc knows them."""
    found = []
    for path in glob.glob("/proc/[0-9]*/cmdline"):
        try:
            with open(path) as file:
                program = os.path.basename(file.read().partition("\0")[0])
            with open(os.path.join(os.path.dirname(path), "stat")) as file:
                is_alive = file.read().rpartition(")")[2].split()[0] not in "ZX"
        except OSError:
            continue
        if program in PROGRAMS and is_alive:
            found.append(program)
    return found


def resolve_as_browsers():
    """localhost is the loopback, whatever the machine's files say."""
    of_machine = socket.getaddrinfo

    def resolve(host, port, *more, **named):
        if host != "localhost":
            return of_machine(host, port, *more, **named)
        return [(family, socket.SOCK_STREAM, socket.IPPROTO_TCP, "", address)
                for family, address in ((socket.AF_INET6, ("::1", int(port), 0, 0)), (socket.AF_INET, ("127.0.0.1", int(port))))]

    socket.getaddrinfo = resolve


def fetch(address):
    request = urllib.request.urlopen(address, timeout=PATIENCE, context=ssl._create_unverified_context())
    with request as answer:
        return answer.read().decode()


def two_pictures(address):
    """Reads the stream of pictures until two of them differ."""
    first, rest = None, b""
    with urllib.request.urlopen(address, timeout=PATIENCE, context=ssl._create_unverified_context()) as stream:
        while received := stream.read1(1 << 16):
            *pictures, rest = (rest + received).split(PICTURE)
            for picture in (each.partition(b"\r\n--")[0] for each in pictures if len(each) > 1000):
                if first not in (None, picture):
                    return
                first = picture
    raise Fault("the pictures have ended")


async def look(page):
    """What people see who open the page, start a simulation, and watch it."""
    if "<html" not in fetch(page + "viewer/worlds/"):
        raise Fault(f"{page} leads to no page")
    server = fetch(page + "session").strip()
    if not server.startswith("ws"):
        raise Fault(f"/session: {server}")
    trust = {"ssl": ssl._create_unverified_context()} if server.startswith("wss:") else {}
    async with websockets.connect(f"{server}/client", **trust) as client:
        await client.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
        told = ""
        while not told.startswith("webots:"):
            told = await asyncio.wait_for(client.recv(), PATIENCE)
            if "Error" in told:
                raise Fault(told)
        address = told.removeprefix("webots:").rstrip("/") + "/"
        async with websockets.connect(address, max_size=None, max_queue=None, **trust) as viewer:
            await viewer.send("mjpeg: 320x240")
            await asyncio.wait_for(viewer.recv(), PATIENCE)
            await viewer.send("fast:-1")
            await asyncio.wait_for(asyncio.to_thread(two_pictures, address.replace("ws", "http", 1) + "mjpeg"), PATIENCE)


def in_one_line(text):
    lines = [line for line in text.splitlines() if line.strip() and "No Webots is installed" not in line]
    return " / ".join(lines)[:1000]


def first_line(text):
    return next((line.strip() for line in text.splitlines() if line.strip()), "")


def expect_refusal(site, status, output, errors):
    row = site.row
    sentence = first_line(errors) or first_line(output)
    if status == 0:
        raise Fault("a site was started: " + in_one_line(output + errors))
    if not re.search(row.says, sentence):
        raise Fault("it does not say what is wrong: " + in_one_line(errors or output))
    if not row.others_run and (left := running()):
        raise Fault(f"{sentence} / still running: {', '.join(left)}")
    if row.after:
        site.run(row.after, "afterwards")
    return sentence


def expect_warning(site, status, output, errors):
    sentence = first_line(errors) or first_line(output)
    if status != 0:
        raise Fault("the start failed: " + in_one_line(errors or output))
    if not re.search(site.row.warns, sentence):
        raise Fault("it does not say what is wrong: " + in_one_line(errors + output))
    stop(site)
    return sentence


def stop(site):
    status, output, errors = site.type("stop")
    if status != 0:
        raise Fault("the stop failed: " + in_one_line(errors or output))
    wait_until(lambda: not running(), lambda: f"after the stop these run: {running()}", patience=10)


def expect_site(site, status, output, errors):
    row = site.row
    said = output + errors
    if status != 0:
        raise Fault("the start failed: " + in_one_line(errors or output))
    if not re.search(row.tells, said):
        raise Fault(f"it does not tell {row.tells}: " + in_one_line(said))
    page = re.search(r"^Open (http\S+)$", output, re.M)
    if not page and not row.silent:
        raise Fault("no address is printed: " + in_one_line(said))
    asyncio.run(look(page[1] if page else "http://localhost:1999/"))
    if row.check:
        site.run(row.check, "meanwhile", said)
    stop(site)
    return next((line for line in said.splitlines() if row.tells and re.search(row.tells, line)), first_line(errors))


def inside(number):
    """In the namespaces of the row: prints as JSON whether all is as expected, and a sentence."""
    row = ROWS[number]
    site = Site(row)
    resolve_as_browsers()
    try:
        subprocess.run(["bash", "-ec", MOUNTS], check=True)
        site.make()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "mode=1777", "none", "/tmp"], check=True)
        with open("/srv/words", "w") as file:
            file.write(WORDS)
        if row.before:
            site.run("{\n" + row.before + "\n} >&2", "the environment can't be made")
        begun = site.type(f"start {row.config}")
        expect = expect_refusal if row.says else expect_warning if row.warns else expect_site
        good, sentence = True, expect(site, *begun)
    except subprocess.TimeoutExpired as late:
        good, sentence = False, f"not done within {PATIENCE} s: {late.cmd[-1].splitlines()[-1]}"
    except (Fault, AssertionError, OSError) as fault:
        good, sentence = False, str(fault)
    except Exception as fault:  # a fault of a row is its result
        good, sentence = False, "".join(traceback.format_exception_only(fault)).strip()
    print(json.dumps([good, sentence]))


def missing(row):
    for each in row.needs:
        if each == "libfaketime" and not os.environ["FAKETIME_LIBRARY"]:
            return "libfaketime is missing (package libfaketime)"
        if each != "libfaketime" and not shutil.which(each):
            return f"{each} is missing"
    return None


def run_row(number):
    """ok, FAILED or skipped, and a sentence."""
    if lacking := missing(ROWS[number]):
        return "skipped", lacking
    # A shell is process 1, which sees orphans off.
    here = [sys.executable, "-B", os.path.abspath(__file__), "--inside", str(number)]
    command = ["unshare", "--net", "--mount", "--pid", "--ipc", "--uts", "--fork", "--kill-child", "--mount-proc", "--propagation", "private",
               "bash", "-c", '"$@"; exit $?', "bash", *here]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=ROW_PATIENCE)
        good, sentence = json.loads(done.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        good, sentence = False, f"not done within {ROW_PATIENCE} s"
    except (IndexError, ValueError):
        good, sentence = False, f"the row itself failed: {done.stderr[-500:]}"
    return "ok" if good else "FAILED", sentence


def main():
    arguments = argparse.ArgumentParser(description="Starts a site in many environments.")
    arguments.add_argument("names", nargs="*", help="parts of names of rows: these alone")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count(), help="rows at once")
    arguments.add_argument("--inside", type=int, help=argparse.SUPPRESS)
    chosen = arguments.parse_args()
    if chosen.inside is not None:
        return inside(chosen.inside)
    absent = [name for name in PROGRAMS if not os.access(os.path.join(BIN, name), os.X_OK)]
    if os.geteuid() != 0 or absent:
        print("skipped: " + (f"{', '.join(absent)} not built (WEBOTS_CLOUD_BIN={BIN!r})" if absent else "namespaces need root"))
        return 77
    os.environ["BIN"] = BIN
    os.environ.setdefault("FAKETIME_LIBRARY", next(iter(glob.glob("/usr/lib/*/faketime/libfaketime.so.1")), ""))
    numbers = [number for number, row in enumerate(ROWS) if not chosen.names or any(name in row.name for name in chosen.names)]
    counts = {}
    with concurrent.futures.ThreadPoolExecutor(chosen.jobs) as pool:
        for number, (result, sentence) in zip(numbers, pool.map(run_row, numbers)):
            counts[result] = counts.get(result, 0) + 1
            wanted = "a sentence" if ROWS[number].says or ROWS[number].warns else "a site"
            print(f"{result:7} {wanted:10} {ROWS[number].name!r:60.100} {sentence}", flush=True)
    print(", ".join(f"{count} {result}" for result, count in sorted(counts.items())))
    return 1 if counts.get("FAILED") else 0


if __name__ == "__main__":
    sys.exit(main())
