"""Servers that are reached as through an access point: a relay in another network namespace, at the other end of a cable.

    own_network.enter()
    with AccessPoint(port, ...) as cable: ...    # whoever asks FAR:port gets what this machine serves at that port
    with PoorNetwork(port, ...) as network: network.set(delay=0.1, lose_every=100)    # the same, but packets are late, or lost
"""

import fcntl
import os
import struct
import subprocess
import sys
import unittest

from .waiting import wait_until

NEAR, FAR = "10.78.0.1", "10.78.0.2"
BACK, BACK_FAR = "10.79.0.1", "10.79.0.2"
RELAY = r"""
import asyncio, os, sys
async def copy(reader, writer):
    try:
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
    except OSError:
        pass
    finally:
        writer.close()
async def relay(port):
    async def serve(reader, writer):
        try:
            back = await asyncio.open_connection(sys.argv[1], port)
        except OSError:
            return writer.close()
        await asyncio.gather(copy(reader, back[1]), copy(back[0], writer))
    await asyncio.start_server(serve, None, port)
async def all_ports():
    for port in sys.argv[2:]:
        await relay(int(port))
    print("ready", flush=True)
    await asyncio.Event().wait()
if sys.stdin.readline():
    asyncio.run(all_ports())
"""
# Carries packets between two interfaces, and does to them what `set` says. There is no `tc netem` in every kernel; here the packets of
# real TCP connections are late or lost, so that senders wait, slow down and repeat as they do on the way through the world.
WIRE = r"""
import asyncio, collections, contextlib, os, sys
BUFFER = 64 * 1024  # bytes that a slow link keeps; what comes when there are more is lost, as in a router
delay, lose_every, rate = 0.0, 0, 0.0
class Way:
    def __init__(self, source, target):
        self.source, self.target = source, target
        self.waiting, self.packets, self.free, self.last = collections.deque(), 0, 0.0, 0.0
        loop.add_reader(source, self.read)
    def read(self):
        try:
            while True:
                self.take(os.read(self.source, 65536), loop.time())
        except BlockingIOError:
            pass
    def take(self, packet, now):
        self.packets += 1
        if (lose_every and self.packets % lose_every == 0) or (rate and self.free - now > BUFFER / rate):
            return
        self.free = max(now, self.free) + (len(packet) / rate if rate else 0)
        self.last = max(self.last, self.free + delay)  # none overtakes another
        self.waiting.append((self.last, packet))
        if len(self.waiting) == 1:
            loop.call_at(self.last, self.give)
    def give(self):
        while self.waiting and self.waiting[0][0] <= loop.time():
            with contextlib.suppress(OSError):  # the other interface is not up yet
                os.write(self.target, self.waiting.popleft()[1])
        if self.waiting:
            loop.call_at(self.waiting[0][0], self.give)
def obey():
    global delay, lose_every, rate
    line = sys.stdin.readline()
    if not line:
        return loop.stop()
    delay, lose_every, rate = (kind(word) for kind, word in zip((float, int, float), line.split()))
    print("done", flush=True)
loop = asyncio.new_event_loop()
near, far = (int(number) for number in sys.argv[1:])
Way(near, far), Way(far, near)
loop.add_reader(0, obey)
print("ready", flush=True)
loop.run_forever()
"""
# Opens an interface in the namespace that it runs in, and becomes the wire from the descriptor that it is given.
OPEN = r"""
import os, sys
sys.path.insert(0, sys.argv[1])
from support import access_point
os.execv(sys.executable, [sys.executable, "-c", access_point.WIRE, sys.argv[2], str(access_point.open_interface(sys.argv[3]))])
"""
TUN = "/dev/net/tun"
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x1, 0x1000


def run(*command):
    subprocess.run(command, check=True)


def open_interface(name):
    """A new interface whose packets are read from, and written to, the descriptor that is returned; programs that we run inherit it."""
    descriptor = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(descriptor, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TUN | IFF_NO_PI))
    os.set_inheritable(descriptor, True)
    return descriptor


def hear(process, line):
    assert process.stdout.readline() == line + b"\n", f"{process.args[-1]} did not say {line}"


class AccessPoint:
    """The other end of the cable, with a relay to servers on this machine."""

    def __init__(self, *ports):
        self.ports = ports

    def __enter__(self):
        self.process = subprocess.Popen(["unshare", "-n", sys.executable, "-c", RELAY, BACK, *map(str, self.ports)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.number = str(self.process.pid)
        wait_until(lambda: os.readlink(f"/proc/{self.number}/ns/net") != os.readlink("/proc/self/ns/net"), "no other namespace")
        self.enter = ["nsenter", "-t", self.number, "-n"]
        self.inside = [*self.enter, "ip"]
        run(*self.inside, "link", "set", "lo", "up")
        self.add_pair("back", "backfar")
        self.lay_cable()
        for near, far, own, other in (("cable", "far", NEAR, FAR), ("back", "backfar", BACK, BACK_FAR)):
            for ip, interface, address in ((["ip"], near, own), (self.inside, far, other)):
                run(*ip, "address", "add", f"{address}/24", "dev", interface)
                run(*ip, "link", "set", interface, "up")
        self.process.stdin.write(b"\n")
        self.process.stdin.flush()
        hear(self.process, b"ready")
        return self

    def __exit__(self, *_):
        end(self.process)

    def add_pair(self, near, far):
        run("ip", "link", "add", near, "type", "veth", "peer", "name", far, "netns", self.number)

    def lay_cable(self):
        self.add_pair("cable", "far")

    def pull(self):
        run(*self.inside, "link", "set", "far", "down")

    def plug(self):
        run(*self.inside, "link", "set", "far", "up")


class PoorNetwork(AccessPoint):
    """The cable is a long way by other people's networks."""

    wire = None

    def __init__(self, *ports):
        if not os.access(TUN, os.R_OK | os.W_OK):
            raise unittest.SkipTest(f"{TUN} is missing: no packets of a network can be delayed or dropped")
        super().__init__(*ports)

    def lay_cable(self):
        near = open_interface("cable")
        folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
        self.wire = subprocess.Popen([*self.enter, sys.executable, "-c", OPEN, folder, str(near), "far"], pass_fds=[near],
                                     stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        os.close(near)
        hear(self.wire, b"ready")

    def set(self, delay=0.0, lose_every=0, rate=0.0):
        """From now on, in each direction: seconds that a packet takes, of how many packets one is lost, and bytes a second; 0: as on a cable.
        Each hundredth is lost and not one by chance in a hundred, so that no unlucky row of losses decides about a test."""
        self.wire.stdin.write(f"{delay} {lose_every} {rate}\n".encode())
        self.wire.stdin.flush()
        hear(self.wire, b"done")

    def __exit__(self, *arguments):
        if self.wire:
            end(self.wire)
        super().__exit__(*arguments)


def end(process):
    process.kill()
    process.wait()
    process.stdin.close()
    process.stdout.close()
