"""Name servers: a real one (dnsmasq), one that misbehaves, and one that says nothing."""

import errno
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import threading

from .ports import free_port
from .processes import Startable, end_with_parent, required_program
from .waiting import wait_until


class NameServer(Startable):
    """Knows the names below `.test` that it is told, with a TTL of 0. With a `wrapper` it runs on another machine, which is at `host`."""

    def __init__(self, addresses=None, services=(), host="127.0.0.1", wrapper=()):
        self.program = required_program("dnsmasq", "dnsmasq-base")
        self.port = free_port()
        self.host = host
        self.wrapper = wrapper
        self.address = f"{host}:{self.port}"
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_names_")
        self.hosts = os.path.join(self.folder, "hosts")
        self.services = services
        self.process = None
        self.names = dict(addresses or {})

    def start(self):
        self._write()
        self.process = subprocess.Popen(
            [*self.wrapper, self.program, "--keep-in-foreground", f"--port={self.port}", f"--listen-address={self.host}", "--bind-interfaces", "--conf-file",
             "--pid-file", "--no-resolv", "--no-hosts", f"--addn-hosts={self.hosts}", "--local=/test/", "--log-facility=-",
             *(["--user=root"] if os.geteuid() == 0 else []), *(f"--srv-host={service}" for service in self.services)],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=end_with_parent)
        wait_until(self._answers, "dnsmasq does not answer")

    def close(self):
        if self.process:
            self.process.terminate()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def tell(self, **addresses):
        """From now on: `sim=["127.0.0.2"]` is `sim.test`; an empty list: there is no such name."""
        self.names.update(addresses)
        self._write()
        self.process.send_signal(signal.SIGHUP)

    def _write(self):
        with open(self.hosts, "w") as file:
            os.chmod(self.folder, 0o755)
            for name, addresses in self.names.items():
                file.writelines(f"{address} {name}.test\n" for address in addresses)

    def _answers(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
            asker.settimeout(0.2)
            try:
                asker.connect((self.host, self.port))
                asker.send(b"\x12\x34\x01\x00\x00\x01\x00\x00\x00\x00\x00\x00\x03sim\x04test\x00\x00\x01\x00\x01")
                return bool(asker.recv(512))
            except OSError:
                return False


class BadNameServer(Startable):
    """Gets questions, and answers what `answer` makes of each: nothing, or any bytes."""

    def __init__(self, answer=lambda question: None):
        self.answer = answer
        self.questions = 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.socket.getsockname()[1]}"
        self.thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        self.thread.start()

    def close(self):
        self.socket.close()

    def _run(self):
        while True:
            try:
                question, asker = self.socket.recvfrom(512)
                self.questions += 1
                answer = self.answer(question)
                if answer is not None:
                    self.socket.sendto(answer, asker)
            except OSError:
                return


class HangingNames:
    """A name server that never answers, and what makes a program ask it: a mount namespace with a resolv.conf of its own. Needs root, for that and
    for the port."""

    def __enter__(self):
        self.socket, address = self._listen()
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_names_")
        path = os.path.join(self.folder, "resolv.conf")
        with open(path, "w") as file:
            file.write(f"nameserver {address}\noptions timeout:30 attempts:5\n")
        self.wrapper = ("unshare", "--mount", "sh", "-c", f'mount --bind {path} /etc/resolv.conf && exec "$@"', "sh")
        return self

    @staticmethod
    def _listen():
        """At an address of the loopback where the port of name servers is free: tests run side by side."""
        for number in range(1, 255):
            listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            address = f"127.53.53.{number}"
            try:
                listener.bind((address, 53))
                return listener, address
            except OSError as error:
                listener.close()
                if error.errno != errno.EADDRINUSE:
                    raise
        raise AssertionError("port 53 is taken at all addresses")

    def __exit__(self, *_):
        self.socket.close()
        shutil.rmtree(self.folder, ignore_errors=True)
