"""The rows of a class that starts all at once: cold starts of one world until the last robot moves, and starts of staged simulations.

The floor is what nobody can do without: a shell copies the project and starts the simulator, as often, without any wall. The demo simulator needs some 30 ms
to load its world, where Webots computes for seconds; so there is a second row, with a simulator that computes before it loads, as both do then.
"""

import asyncio
import contextlib
import json
import os
import re
import shutil
import statistics
import tempfile
import time

import start_bench
import websockets
from row import Row, itself, ratio
from support.browser_client import LOCAL, WORLD, Browser
from support.ports import free_port
from support.projects import EXAMPLES
from support.servers import PATIENCE, SessionServer, SimulationServer, program, wait_until

STUDENTS = 30
PASSWORD = "abcd-efgh-jkmn"  # of teachers
WEBOTS = """#!/bin/sh
head -c {megabytes}M /dev/zero | sha256sum >/dev/null
exec {folder}/demo_simulator "$@"
"""
SLOW_MEGABYTES = 250  # about a second of a core


def make_home(folder, megabytes):
    """A folder with a `webots` that computes, and then is the demo simulator."""
    path = os.path.join(folder, "webots")
    with open(path, "w") as file:
        file.write(WEBOTS.format(megabytes=megabytes, folder=folder))
    os.chmod(path, 0o755)
    shutil.copy(program("webots-demo-simulator"), os.path.join(folder, "demo_simulator"))  # simulations see no more than this folder
    return folder


async def until_moving(address):
    """Lets the simulation run, and waits until its time goes on."""
    async with websockets.connect(address, max_size=None) as view:
        await view.send("x3d;broadcast")
        await view.send("real-time:-1")
        while True:
            message = await asyncio.wait_for(view.recv(), PATIENCE)
            if message.startswith("application/json:") and json.loads(message.partition(":")[2])["time"] > 0:
                return


async def start_and_move(server, stack):
    browser = await stack.enter_async_context(Browser(server))
    await browser.start(mode="x3d")
    await until_moving((await browser.hear("webots:")).removeprefix("webots:"))


async def seconds_of_ours(home, students):
    walls = start_bench.KINDS["bubblewrap, as shipped"]
    with SimulationServer(**LOCAL, **walls, webotsHome=home, maxConnections=students + 1, loadFormula="reference", simulationsPerAddress=0) as server:
        async with contextlib.AsyncExitStack() as stack:
            await start_and_move(server, stack)  # what a process does once
            began = time.monotonic()
            await asyncio.gather(*(start_and_move(server, stack) for _ in range(students)))
            return time.monotonic() - began


async def copy_and_move(home, folder, processes):
    port = free_port()
    world = os.path.join(folder, "worlds/arena.wbt")
    process = await asyncio.create_subprocess_shell(
        f"cp -r {EXAMPLES}/robots {folder} && exec {home}/webots --batch --mode=pause --stdout --stream=x3d --port={port} {world}",
        stdout=asyncio.subprocess.PIPE)
    processes.append(process)
    while b"listening" not in await asyncio.wait_for(process.stdout.readline(), PATIENCE):
        pass
    await until_moving(f"ws://127.0.0.1:{port}")


async def seconds_of_shell(home, students):
    processes = []
    try:
        with tempfile.TemporaryDirectory(prefix="webots_cloud_crowd_") as folder:
            began = time.monotonic()
            await asyncio.gather(*(copy_and_move(home, os.path.join(folder, str(number)), processes) for number in range(students)))
            return time.monotonic() - began
    finally:
        for process in processes:
            process.kill()
            await process.wait()


def crowd(megabytes):
    @contextlib.contextmanager
    def setting(quick):
        students = 3 if quick else STUDENTS
        with tempfile.TemporaryDirectory(prefix="webots_cloud_home_") as folder:
            os.chmod(folder, 0o755)  # simulations have users of their own
            home = make_home(folder, megabytes)
            yield lambda: {"ours": asyncio.run(seconds_of_ours(home, students)), "floor": asyncio.run(seconds_of_shell(home, students))}
    return setting


async def hear(page, key):
    """The first message with this key."""
    while True:
        message = json.loads(await asyncio.wait_for(page.recv(), PATIENCE))
        if key in message:
            return message[key]


async def until_staged(teacher, seats):
    while await hear(teacher, "staged") != {"ready": seats, "seats": seats}:
        pass


async def start_of_student(session, seat, wait):
    """Milliseconds from `start` to `webots:`, by way of the session server."""
    async with websockets.connect(f"ws://localhost:{session.port}/client") as client:
        await asyncio.sleep(wait)
        began = time.monotonic()
        await client.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg", "waiting": True, "class": seat}}))
        while not (await asyncio.wait_for(client.recv(), PATIENCE)).startswith("webots:"):
            pass
        return (time.monotonic() - began) * 1000


async def starts_of_class(session, students):
    """A class opens, is ready, and all its students start within a second."""
    async with contextlib.AsyncExitStack() as stack:
        def page():
            return stack.enter_async_context(websockets.connect(f"ws://localhost:{session.port}/class"))
        teacher = await page()
        await teacher.send(json.dumps({"teach": {"password": PASSWORD, "world": WORLD, "mode": "mjpeg", "seats": students}}))
        code = (await hear(teacher, "class"))["code"]
        await until_staged(teacher, students)
        seats = []
        for number in range(students):
            student = await page()
            await student.send(json.dumps({"join": {"code": code, "name": f"Student {number}"}}))
            seats.append((await hear(student, "joined"))["seat"])
        return await asyncio.gather(*(start_of_student(session, seat, number / students) for number, seat in enumerate(seats)))


@contextlib.contextmanager
def class_that_is_ready(quick):
    students = 3 if quick else STUDENTS
    walls = start_bench.KINDS["bubblewrap, as shipped"]
    settings = {"maxConnections": students + 1, "loadFormula": "reference", "simulationsPerAddress": 0}

    def measure():
        with SimulationServer(**LOCAL, **walls, **settings) as machine:
            with SessionServer([machine.address], relay=True, teacherPassword=PASSWORD, loadThreshold=1000) as session:
                wait_until(lambda: session.get("/") == "1", "the machine has not reported")
                took = asyncio.run(starts_of_class(session, students))
            taken = float(re.search(r"^webots_staged_taken_total (\S+)$", machine.get("/metrics"), re.MULTILINE)[1])
            if taken != students:
                raise AssertionError(f"{taken:.0f} of {students} starts got a staged simulation")
        return {"ours": max(took), "median": statistics.median(took)}
    yield measure


ROWS = [
    Row(f"the slowest of {STUDENTS} students who start within a second, all staged for their class, from `start` to `webots:`", "ms", "at most 15 ms", 15,
        itself, class_that_is_ready),
    Row(f"{STUDENTS} starts at once, as shipped, until the last robot moves", "s", "at most 1.15 × floor", 1.15, ratio("floor"), crowd(0)),
    Row("the same with a simulator that computes for a second", "s", "at most 1.15 × floor", 1.15, ratio("floor"), crowd(SLOW_MEGABYTES)),
]
