#!/usr/bin/python3
"""webots-process-guard alone: a program ends as it would without it, and nothing that it started outlives the program, the guard or the owner.

Every case runs as the user of the tests, as an unprivileged user, and where PID namespaces are not allowed.
Protocol section 6.5, quirk Q10.
"""

import contextlib
import ctypes
import errno
import fcntl
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, descendants, is_alive, main, program, wait_until  # noqa: E402

NOBODY = 65534
# Children of every kind, which are found by a mark in their command lines; the shell then waits.
FAMILY = "trap '' TERM; setsid sleep 600.{mark} & (setsid sleep 600.{mark} &) ; sleep 600.{mark} & echo ready; wait"


def find(mark):
    """Living processes with this in their command line."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as line:
                if mark.encode() in line.read() and is_alive(int(entry)):
                    found.append(int(entry))
        except (OSError, ValueError):
            pass
    return found


class Guard(unittest.TestCase):
    arguments = []  # in front of the guard's own
    user = None
    namespace = None  # True or False where it is known

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_guard_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        os.chmod(cls.folder, 0o755)
        cls.guard = shutil.copy(program("webots-process-guard"), cls.folder)  # where everybody may reach it
        cls.count = 0

    def start(self, script, grace=200, cleanup=(), options=(), name="sh", stderr=None, control=subprocess.PIPE):
        last = ["--cleanup", str(len(cleanup)), *cleanup] if cleanup else []
        last += options
        started = subprocess.Popen([*self.arguments, self.guard, *last, str(grace), "/bin/sh", "-c", script, name], stdin=control,
                                   stdout=subprocess.PIPE, stderr=stderr, text=True, user=self.user, group=self.user, extra_groups=self.user and [])
        self.addCleanup(self.end, started)
        return started

    def end(self, started):
        for pipe in (started.stdin, started.stdout, started.stderr):
            if pipe:
                pipe.close()
        started.wait(30)

    def own_folder(self, name):
        """A folder of the user who runs the guard."""
        folder = tempfile.mkdtemp(prefix=name, dir=self.folder)
        if self.user:
            os.chown(folder, self.user, self.user)
        return folder

    def lock(self, folder):
        """As a living guard has it."""
        lock = os.open(folder, os.O_RDONLY)
        self.addCleanup(os.close, lock)
        fcntl.flock(lock, fcntl.LOCK_EX)

    def start_family(self, options=()):
        """A program whose children try to escape; returns it and the mark of its processes."""
        type(self).count += 1
        mark = f"{os.getpid()}{type(self).count}{abs(hash(type(self).__name__)) % 10000}"
        started = self.start(FAMILY.format(mark=mark), options=options)
        self.assertEqual(started.stdout.readline(), "ready\n")
        wait_until(lambda: len(find(f"600.{mark}")) >= 4, "the family is not complete")  # the shell has it in its arguments too
        return started, f"600.{mark}"

    def is_in_namespace(self):
        started = self.start("readlink /proc/self/ns/pid")
        inside = started.stdout.readline().strip()
        started.wait(30)
        return inside != os.readlink("/proc/self/ns/pid")

    def require_namespace(self):
        if not self.is_in_namespace():
            self.skipTest("no PID namespace may be made here")

    def test_the_cleanup_command_runs_when_nothing_is_left_and_changes_no_status(self):
        seen = os.path.join(self.folder, f"seen_{type(self).__name__}")
        with open(seen, "w"):
            os.chmod(seen, 0o666)
        mark = f"601.{os.getpid()}"
        script = f"echo noise; cat /proc/[0-9]*/cmdline | tr '\\0' '\\n' | grep -cx {mark.replace('1', '[1]', 1)} > {seen}; exit 7"
        for asked, status in ((True, -signal.SIGTERM), (False, -signal.SIGKILL)):
            with self.subTest(asked=asked):
                started = self.start(f"(setsid sleep {mark} &) ; echo ready; exec sleep {mark}", cleanup=["/bin/sh", "-c", script])
                self.assertEqual(started.stdout.readline(), "ready\n")
                if asked:
                    started.stdin.write("T")
                    started.stdin.flush()
                else:
                    started.stdin.close()
                self.assertEqual(started.wait(30), status)
                with open(seen) as file:
                    self.assertEqual(file.read(), "0\n", "processes of the tree")
                self.assertEqual(started.stdout.read(), "")

    def test_it_ends_as_the_program_does(self):
        for script, status in (("exit 0", 0), ("exit 3", 3), ("kill -SEGV $$", -signal.SIGSEGV), ("kill -TERM $$", -signal.SIGTERM),
                               ("exec /nowhere", 127)):
            with self.subTest(script):
                self.assertEqual(self.start(script).wait(30), status)

    def test_a_byte_on_the_control_socket_asks_the_program_to_end(self):
        started = self.start("trap 'exit 7' TERM; echo ready; while :; do sleep 0.05; done", grace=30_000)
        self.assertEqual(started.stdout.readline(), "ready\n")
        started.stdin.write("T")
        started.stdin.flush()
        self.assertEqual(started.wait(30), 7)

    def test_after_the_grace_the_whole_family_is_killed(self):
        started, mark = self.start_family()
        started.stdin.write("T")
        started.stdin.flush()
        self.assertEqual(started.wait(30), -signal.SIGKILL)
        self.assertEqual(find(mark), [])

    def test_the_end_of_the_control_socket_kills_the_whole_family(self):
        started, mark = self.start_family()
        started.stdin.close()
        self.assertEqual(started.wait(30), -signal.SIGKILL)
        self.assertEqual(find(mark), [])

    def test_the_end_of_the_program_is_the_end_of_its_children(self):
        started, mark = self.start_family()
        shell = next(pid for pid in find(mark) if b"trap" in self.command_line(pid) and b"guard" not in self.command_line(pid))
        os.kill(shell, signal.SIGKILL)
        started.wait(30)
        self.assertEqual(find(mark), [])

    @staticmethod
    def command_line(pid):
        with open(f"/proc/{pid}/cmdline", "rb") as line:
            return line.read()

    def test_a_guard_that_is_killed_itself_takes_the_family_along(self):
        self.require_namespace()
        started, mark = self.start_family()
        started.kill()
        started.wait(30)
        wait_until(lambda: not find(mark), "the family lives on")

    def test_the_program_can_signal_nobody_outside(self):
        self.require_namespace()
        with subprocess.Popen(["sleep", "600"], user=self.user, group=self.user) as stranger:
            started = self.start(f"kill -KILL {stranger.pid} 2>/dev/null && echo killed; echo tried")
            self.assertEqual(started.stdout.read(), "tried\n")
            self.assertIsNone(stranger.poll())
            stranger.kill()

    def test_the_owners_death_is_the_end_even_when_somebody_else_holds_the_control_socket(self):
        mark = f"602.{os.getpid()}"
        holder, end = socket.socketpair()
        owner = "import subprocess, sys; subprocess.Popen(sys.argv[1:], stdin=0).wait()"
        command = [*self.arguments, self.guard, "200", "/bin/sh", "-c", f"setsid sleep {mark} & echo ready; exec sleep {mark}"]
        with holder, end, subprocess.Popen([sys.executable, "-c", owner, *command], stdin=end, stdout=subprocess.PIPE, user=self.user,
                                           group=self.user, extra_groups=self.user and []) as started:
            end.close()
            started.stdout.readline()
            wait_until(lambda: len(find(mark)) >= 3, "it does not run")  # the owner has it in its arguments too
            started.kill()
            wait_until(lambda: not find(mark), "the tree lives on")

    def probe(self, *arguments):
        """The isolation that the guard reports."""
        return subprocess.run([*self.arguments, self.guard, "--probe", *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              text=True, user=self.user, group=self.user, extra_groups=self.user and [], timeout=30, check=True).stdout

    def test_a_probe_says_in_one_line_what_programs_get(self):
        said = self.probe("--read-only", self.folder)
        if not self.is_in_namespace():
            self.assertRegex(said, r"^(signals|none): [A-Z].*\n$")
            return
        self.assertRegex(said, r"^namespace( proc)?( read-only)?\n$")
        self.assertNotIn("read-only", self.probe("--read-only", os.path.join(self.folder, "nowhere")))
        tried = self.start("ls -d /proc/[0-9]*; touch $0/file 2>/dev/null || echo kept", options=["--read-only", self.folder], name=self.folder)
        lines = tried.stdout.read().splitlines()
        self.assertEqual("kept" in lines, "read-only" in said or self.user == NOBODY)
        if "proc" in said:
            self.assertLess(len(lines), 6, "it sees others")

    def test_programs_of_root_can_not_trace_mount_or_load(self):
        started = self.start("grep -E 'CapEff|CapBnd' /proc/self/status")
        beyond = 1 << 19 | 1 << 21 | 1 << 16 | 1 << 27  # CAP_SYS_PTRACE, CAP_SYS_ADMIN, CAP_SYS_MODULE, CAP_MKNOD
        lines = started.stdout.read().splitlines()
        self.assertEqual(int(lines[0].split()[1], 16) & beyond, 0, lines)

    def test_programs_that_run_as_somebody_else_do_so_where_that_is_asked_for(self):
        """For instance firejail, in which Webots R2021b and older run controllers."""
        if os.geteuid() != 0:
            self.skipTest("only root can make a program that runs as root")
        who = shutil.copy(shutil.which("id"), self.folder)
        os.chmod(who, 0o4755)
        self.assertEqual(self.start(f"{who} -u", options=["--set-user-id"]).stdout.read(), "0\n")
        started, mark = self.start_family(options=["--set-user-id"])
        started.stdin.close()
        self.assertEqual(started.wait(30), -signal.SIGKILL)
        self.assertEqual(find(mark), [])

    def test_a_filtered_program_has_fewer_system_calls(self):
        def filtered(*command):
            return subprocess.run([*self.arguments, self.guard, "--filter", *command], capture_output=True, text=True, user=self.user,
                                  group=self.user, extra_groups=self.user and [])

        said = filtered("/usr/bin/grep", "-E", "^(NoNewPrivs|Seccomp):", "/proc/self/status")
        self.assertEqual(said.stdout.split(), ["NoNewPrivs:", "1", "Seccomp:", "2"])
        self.assertEqual(filtered("/bin/sh", "-c", "exit 7").returncode, 7)
        secret_memory = "import ctypes; libc = ctypes.CDLL(None, use_errno=True); print(libc.syscall(447, 0), ctypes.get_errno())"
        self.assertEqual(filtered("/usr/bin/python3", "-c", secret_memory).stdout, f"-1 {errno.EPERM}\n")
        missing = filtered("/nowhere/program")
        self.assertEqual((missing.returncode, missing.stdout), (127, "can't run /nowhere/program: No such file or directory\n"))

    def test_a_program_gets_files_open_where_it_wants_them_and_no_others(self):
        file = os.path.join(self.folder, "opened")
        with open(file, "w") as out:
            print("the text", file=out)
        started = self.start("cat <&7; cat <&8; echo $(cat <&9) beside; ls /proc/self/fd | tr '\\n' ' '",
                             options=("--open", "7", file, "--open", "8", "/nowhere", "--open", "9", file))
        self.assertEqual(started.stdout.read(), "the text\nthe text beside\n0 1 2 3 7 8 9 ")

    def test_a_program_with_a_network_of_its_own_is_reached_by_sockets_alone_that_are_handed_out(self):
        self.require_namespace()
        folder = self.own_folder("broker_")
        broker = os.path.join(folder, "socket")
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]  # nobody listens on it once this is closed
        speak = f"import socket; s = socket.create_server(('127.0.0.1', {port})); c = s.accept()[0]; c.sendall(b'hello'); c.recv(1)"
        started = self.start(f'exec /usr/bin/python3 -c "{speak}"', options=["--network", "none", str(port), "--broker", broker])
        with contextlib.closing(wait_until(lambda: handed_out(broker), "no socket is handed out")) as inside:
            with self.assertRaises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", port))
            self.assertEqual(inside.recv(5, socket.MSG_WAITALL), b"hello")
            inside.sendall(b"x")  # and the program ends
            self.assertEqual(started.wait(30), 0)
        self.assertEqual(os.listdir(folder), [])

    def test_the_server_is_told_once_when_the_port_of_a_program_is_reached(self):
        """Not before, and it need not look: the first attempt to connect succeeds."""
        self.require_namespace()
        port, broker = free_port(), os.path.join(self.own_folder("broker_"), "socket")
        listen = f"import socket; s = socket.create_server(('127.0.0.1', {port})); s.accept()[0].sendall(b'hello'); s.accept()"
        reach = {"port": ((), lambda: socket.create_connection(("127.0.0.1", port))), "broker": (("--broker", broker), lambda: handed_out(broker))}
        for way, (options, connect) in reach.items():
            with self.subTest(way):
                ours, theirs = socket.socketpair()
                with ours, theirs:
                    ours.setblocking(False)
                    os.mkfifo(os.path.join(self.folder, way))
                    os.chmod(os.path.join(self.folder, way), 0o666)
                    started = self.start(f'read line < {self.folder}/{way}; exec /usr/bin/python3 -c "{listen}"', control=theirs,
                                         options=["--network", "none", str(port), *options])
                    theirs.close()
                    self.assertRaises(BlockingIOError, ours.recv, 1)
                    ours.settimeout(PATIENCE)
                    self.let(way)
                    self.assertEqual(ours.recv(10), b"L")
                    with contextlib.closing(connect()) as inside:
                        self.assertEqual(inside.recv(5, socket.MSG_WAITALL), b"hello")
                    ours.sendall(b"T")
                    started.wait(30)
                    self.assertEqual(ours.recv(10), b"")

    def let(self, name):
        """Ends the wait of a program that reads this pipe."""
        with open(os.path.join(self.folder, name), "w") as pipe:
            print(file=pipe)

    def test_a_program_ends_with_what_leads_to_its_port(self):
        self.require_namespace()
        broker = os.path.join(self.own_folder("broker_"), "socket")
        started = self.start("echo ready; exec sleep 600", options=["--network", "none", str(free_port()), "--broker", broker])
        self.assertEqual(started.stdout.readline(), "ready\n")
        _, relay = [pid for pid in descendants(started.pid) if pid in find(self.guard)]  # and above it the first of the namespace
        os.kill(relay, signal.SIGKILL)
        self.assertEqual(started.stdout.read(), "webots-process-guard: the process that leads to the program's port has been killed, "
                                                "so the program ends\n")
        self.assertEqual(started.wait(30), -signal.SIGKILL)

    def test_a_job_says_where_it_runs_and_on_which_port_it_listens_and_has_no_control_socket(self):
        port = free_port(1)
        listen = "import socket, signal; s = socket.create_server(('127.0.0.1', {})); signal.pause()"
        script = f'echo "$1"; echo error >&2; /usr/bin/python3 -c "{listen.format(port + 1)}" & wait'
        job = self.start(script, options=["--job", str(port), str(port + 1)], stderr=subprocess.PIPE)
        word = re.fullmatch(rf"webots-process-guard ([0-9a-f]{{16}}) runs on {re.escape(socket.gethostname())} in 0\n",
                            job.stdout.readline())[1]
        self.assertEqual(job.stdout.readline(), "\n")  # of the program, which starts after that
        self.assertEqual(job.stdout.readline(), "error\n")
        job.stdin.close()
        told = []  # where the program can't read it
        while not told or not told[-1].startswith(f"webots-process-guard {word} listens"):
            told.append(job.stderr.readline())
            self.assertTrue(told[-1], "it does not say where it listens")
        self.assertEqual(told[-1], f"webots-process-guard {word} listens on {port + 1}\n")
        job.send_signal(signal.SIGTERM)
        self.assertEqual(job.wait(30), -signal.SIGTERM)
        self.assertEqual(job.stdout.read(), "")
        other = self.start(script, options=["--job", str(port), str(port + 1)], stderr=subprocess.DEVNULL)
        self.assertNotIn(word, other.stdout.readline())
        other.send_signal(signal.SIGTERM)
        other.wait(30)

    def test_a_job_says_every_second_what_it_uses(self):
        script = "/usr/bin/python3 -c 'b = bytearray(50 << 20)\nwhile True: pass' & wait"
        job = self.start(script, options=["--job", "1", "1"], stderr=subprocess.PIPE)
        processor, memory, own, threads = 0, 0, 0, 0
        while processor < 1000 or own < 50 << 20:
            words = job.stderr.readline().split()
            self.assertEqual(words[2], "uses")
            processor, memory, own, threads, whole, disk, too_many = map(int, words[3:])
            self.assertEqual((whole, disk, too_many), (1, 0, 0))
        self.assertLess(own, memory)
        self.assertLess(own, 80 << 20)
        self.assertGreaterEqual(threads, 2)  # the shell and its child
        job.send_signal(signal.SIGTERM)
        job.wait(30)

    def start_copy(self, sent, script, node, name="webots-cloud-job.it"):
        """A guard that sends a folder to one that receives it, as on a node."""
        received = os.path.join(node, name)
        return self.start(script, stderr=subprocess.PIPE, options=["--send", "1", sent, "200", self.guard, "--job", "1", "1", "--receive",
                                                                   received, received + sent])

    def project(self):
        folder = self.own_folder("project_")
        with open(os.path.join(folder, "-rf *\nname"), "w") as file:
            file.write("text")
        os.symlink("-rf *\nname", os.path.join(folder, "link"))
        os.chmod(folder, 0o755)
        return folder

    def test_a_project_is_sent_and_received_and_removed_at_the_end(self):
        node = self.own_folder("node_")
        project = self.project()
        # Modes and depths that only make trouble.
        script = f"pwd; cat link; echo; ls {node}; stat -c %a {node}/*; for i in $(seq 100); do mkdir d; cd d; done; mkdir x; chmod 0 x ."
        copy = self.start_copy(project, script, node)
        lines = copy.stdout.read().splitlines()
        self.assertEqual(lines[1:], [f"{node}/webots-cloud-job.it{project}", "text", "webots-cloud-job.it", "700"], copy.stderr.read())
        self.assertEqual(copy.wait(30), 0)
        self.assertEqual(os.listdir(node), [])
        self.assertEqual(len(os.listdir(project)), 2)

    def test_a_project_that_can_not_be_sent_or_received_starts_nothing(self):
        node = self.own_folder("node_")
        project = self.project()
        missing = self.start_copy(project + "/nothing", "echo it runs", node)
        self.assertIn("webots-process-guard can't send\n", missing.stdout.read())
        taken = os.path.join(node, "webots-cloud-job.it")
        os.mkdir(taken)
        self.lock(taken)
        refused = self.start_copy(project, "echo it runs", node)
        self.assertIn("can't receive\n", refused.stderr.read())
        self.assertNotIn("it runs", refused.stdout.read())
        self.assertEqual(refused.wait(30), 127)
        self.assertEqual(os.listdir(node), ["webots-cloud-job.it"])

    def test_what_killed_guards_have_left_is_removed_and_nothing_else(self):
        node = self.own_folder("node_")
        for name in ("webots-cloud-job.dead/x/y", "webots-cloud-job.alive", "webots-cloud-other"):
            os.makedirs(os.path.join(node, name))
        subprocess.run(["chown", "-R", f"{self.user or 0}", node], check=True)
        os.symlink(self.project(), os.path.join(node, "webots-cloud-job.link"))
        self.lock(os.path.join(node, "webots-cloud-job.alive"))
        copy = self.start_copy(self.project(), "true", node)
        copy.stderr.read()
        self.assertEqual(copy.wait(30), 0)
        self.assertEqual(sorted(os.listdir(node)), ["webots-cloud-job.alive", "webots-cloud-job.link", "webots-cloud-other"])

    def test_the_programs_number_is_unique_outside(self):
        self.require_namespace()
        if not has_clone3():
            self.skipTest("clone3, which gives a process its number, is not allowed here")
        started = self.start("echo $$")
        self.assertEqual(started.stdout.read(), f"{started.pid}\n")


def handed_out(broker):
    """The socket that comes from a broker; None: it does not listen yet."""
    with socket.socket(socket.AF_UNIX) as asker:
        asker.settimeout(30)
        try:
            asker.connect(broker)
        except OSError:
            return None
        _, descriptors, _, _ = socket.recv_fds(asker, 1, 1)
        made = socket.socket(fileno=descriptors[0])
        made.settimeout(30)
        return made


def has_clone3():
    """Calls clone3 with invalid arguments: the kernel refuses them with one error, a filter for system calls with another."""
    ctypes.set_errno(0)
    ctypes.CDLL(None, use_errno=True).syscall(435, None, 0)
    return ctypes.get_errno() == errno.EINVAL


# Where all mounts are shared, as with systemd: prints how a program under a guard ended, and whether anything was mounted meanwhile.
SEE_MOUNTS = """
import select, subprocess, sys
mounts = open("/proc/self/mountinfo")
changes = select.poll()
changes.register(mounts, select.POLLPRI)
mounts.read()
changes.poll(0)
guard = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE)
guard.wait()
print("mounted" if changes.poll(0) else "nothing mounted")
"""


class Networks(unittest.TestCase):
    """What can't be made is named, and the program is not started. What is made is seen by nobody else."""

    def setUp(self):
        self.slirp, self.ip = (shutil.which(each, path="/usr/bin:/usr/sbin:/bin:/sbin") for each in ("slirp4netns", "ip"))
        if not self.slirp or not self.ip:
            self.skipTest("slirp4netns or ip is missing (packages slirp4netns, iproute2)")

    def reason(self, slirp, rules):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write(rules)
            file.flush()
            command = [program("webots-process-guard"), "--network", "internet", "0", slirp, self.ip, file.name, "200", "/bin/echo", "ran"]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as guard:
                return guard.stdout.read().rpartition(": ")[2].strip()

    def test_routes_that_ip_refuses(self):
        self.assertEqual(self.reason(self.slirp, "route replace nonsense\n"), "ip can't set its routes")

    def test_a_slirp4netns_that_does_not_start(self):
        self.assertRegex(self.reason("/bin/false", ""), "slirp4netns does not work")

    def test_a_network_mounts_nothing_that_others_see(self):
        """slirp4netns covers /tmp, which would hide the files of everybody for a moment."""
        # Shared with nobody but the guard's own namespace: what other programs mount meanwhile does not arrive here.
        shared = ["unshare", "--mount", "--propagation", "private", "sh", "-c", 'mount --make-rshared / && exec "$@"', "sh"]
        if subprocess.run([*shared, "true"], stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("a mount namespace needs root")
        with tempfile.NamedTemporaryFile("w") as rules:
            guard = [program("webots-process-guard"), "--network", "internet", "0", self.slirp, self.ip, rules.name, "200", "/bin/echo", "ran"]
            said = []
            while len(said) < 5 and "ran\nnothing mounted\n" not in said:  # Others may remove a folder on which something is mounted here, too.
                done = subprocess.run([*shared, sys.executable, "-c", SEE_MOUNTS, *guard], stdout=subprocess.PIPE, text=True, timeout=60)
                said.append(done.stdout)
        self.assertIn("ran\nnothing mounted\n", said, "a mount of the guard would be seen each time")


class WithoutPrivileges(Guard):
    """In a user namespace, where that is allowed."""

    user = NOBODY

    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0:
            raise unittest.SkipTest("the tests run without privileges anyway")
        super().setUpClass()


class WithoutNamespaces(Guard):
    """As in containers and kernels that allow no namespaces: the guard alone, as child subreaper."""

    # In a user namespace of its own the test may forbid itself to make others.
    arguments = ["unshare", "--user", "--map-root-user", "sh", "-c",
                 'echo 0 > /proc/sys/user/max_pid_namespaces && exec "$@"', "sh"]

    @classmethod
    def setUpClass(cls):
        if subprocess.run([*cls.arguments, "true"], stderr=subprocess.DEVNULL).returncode != 0:
            raise unittest.SkipTest("user namespaces, with which this is arranged, are not allowed here")
        super().setUpClass()

    def test_there_is_none(self):
        self.assertFalse(self.is_in_namespace())


if __name__ == "__main__":
    main()
