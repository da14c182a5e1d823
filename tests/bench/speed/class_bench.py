#!/usr/bin/python3
"""What a class costs the session server: pictures of 30 students on a teacher's wall. No test: it says figures.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/class_bench.py [--students 30] [--seconds 20]

Students are sockets that send what their pages send: a state each second, and pictures as often and as large as the server lets
them be, all of the largest size. Bits are those of the WebSocket frames, without TCP and IP. The share of a processor is the
session server's alone, from /proc; what the machine's other programs do delays it, and does not count.
"""

import argparse
import asyncio
import base64
import json
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../.."))
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.servers import SessionServer, SimulationServer  # noqa: E402

from support import web_sockets as websockets  # noqa: E402

PASSWORD = "abcd-efgh-jkmn"
PATIENCE = 30
FRAME = b"\xff\xd8\xff\xc0\x00\x0b\x08\x00\x78\x00\xa0\x01\x01\x11\x00"  # of a JPEG of 160x120 pixels
SETTLING_S = 3


class Client:
    """One socket of /class, which counts the bytes of frames both ways."""

    def __init__(self, server):
        self.server = server
        self.sent = self.received = 0
        self.pictures = 0

    async def connect(self, message, answer):
        self.socket = await websockets.connect(f"ws://localhost:{self.server.port}/class", max_size=None, compression=None)
        await self.send(message)
        while True:
            heard = await asyncio.wait_for(self.hear(), PATIENCE)
            if answer in heard:
                return heard[answer]
            if "error" in heard:
                raise SystemExit(f"the server says {heard}")

    async def send(self, message):
        text = json.dumps(message, separators=(",", ":"))
        self.sent += frame_bytes(len(text), masked=True)
        await self.socket.send(text)

    async def hear(self):
        text = await self.socket.recv()
        self.received += frame_bytes(len(text.encode()), masked=False)
        message = json.loads(text)
        self.pictures += "picture" in message
        return message


def frame_bytes(size, masked):
    return size + (2 if size < 126 else 4 if size < 65536 else 10) + (4 if masked else 0)


class Student(Client):
    """Sends its state, and pictures while they are wanted."""

    terms = None

    async def attend(self, code, number):
        self.number = number
        await self.connect({"join": {"code": code, "name": f"Student {number}"}}, "joined")
        await asyncio.gather(self._listen(), self._tell(), self._show())

    async def _listen(self):
        while True:
            heard = await self.hear()
            if "pictures" in heard:
                self.terms = heard["pictures"]

    async def _tell(self):
        milliseconds = 0
        while True:
            await self.send({"state": {"state": "running", "time": milliseconds, "simulator": "ws://localhost:2001"}})
            milliseconds += 1000
            await asyncio.sleep(1)

    async def _show(self):
        while True:
            await asyncio.sleep((self.terms or {"interval": 100})["interval"] / 1000)
            if self.terms is not None:
                jpeg = FRAME + os.urandom(self.terms["bytes"] - len(FRAME))
                await self.send({"picture": base64.b64encode(jpeg).decode()})


def processor_seconds(pid):
    with open(f"/proc/{pid}/stat") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def measure(session, teacher, students, seconds):
    def figures():
        return (processor_seconds(session.process.pid), teacher.received, sum(student.sent for student in students),
                teacher.pictures, time.monotonic())

    before = figures()
    await asyncio.sleep(seconds)
    used, received, sent, pictures, elapsed = (after - first for after, first in zip(figures(), before))
    return {"processor": used / elapsed, "teacher": 8 * received / elapsed, "students": 8 * sent / elapsed, "pictures": pictures / elapsed}


def say(name, figures, count):
    print(f"{name:24} {figures['teacher'] / 1e6:6.2f} Mbit/s to the teacher ({figures['pictures']:.1f} pictures/s), "
          f"{figures['students'] / 1e6:6.2f} Mbit/s from {count} students, {100 * figures['processor']:5.2f} % of a core")


async def lesson(session, count, seconds):
    teacher = Client(session)
    opened = await teacher.connect({"teach": {"password": PASSWORD, "world": WORLD, "mode": "mjpeg", "seats": count}}, "class")
    students = [Student(session) for _ in range(count)]
    tasks = [asyncio.ensure_future(student.attend(opened["code"], i + 1)) for i, student in enumerate(students)]

    async def listen():
        while True:
            await teacher.hear()

    tasks.append(asyncio.ensure_future(listen()))
    await asyncio.sleep(SETTLING_S)
    say("the page is hidden", await measure(session, teacher, students, seconds), count)
    await teacher.send({"watch": True})
    await asyncio.sleep(SETTLING_S)
    say("the teacher watches", await measure(session, teacher, students, seconds), count)
    print(f"each student sends {students[0].terms}")
    failed = [task for task in tasks if task.done()]
    if failed:
        raise SystemExit(f"{len(failed)} sockets ended: {failed[0].exception()!r}")
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    await asyncio.gather(*(client.socket.close() for client in [teacher, *students]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--students", type=int, default=30)
    parser.add_argument("--seconds", type=float, default=20)
    options = parser.parse_args()
    with SimulationServer(**LOCAL) as simulation, SessionServer([simulation.address], teacherPassword=PASSWORD, debug=False) as session:
        asyncio.run(lesson(session, options.students, options.seconds))


if __name__ == "__main__":
    main()
