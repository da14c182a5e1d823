#!/usr/bin/python3
"""Projects, sites and peers as they are in the world (support/real_project_rows.py), on real programs: git's server, nginx, Apache, HAProxy, a
Docker engine, Chromium. In each row it works, or the sentence that people read says what is wrong. Prints a table.

    WEBOTS_CLOUD_BIN=build/release/bin tests/real_projects.py [PART OF A NAME ...]

GAP: it is as the row says, and could be better; where the Python servers did otherwise, docs/migration.md says so. Docker needs root. A program
that is not installed skips its rows.
"""

import argparse
import asyncio
import contextlib
import http.client
import json
import os
import re
import ssl
import subprocess
import sys
import tempfile
import unittest
import urllib.parse

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support import apache, haproxy, nginx  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD, Browser, websockets  # noqa: E402
from support.docker import IMAGES, DockerDaemon, compose_command, docker_server  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.mailbox import Certificate  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.real_project_rows import (ROBOTS, ROWS, Check, Configuration, Container, Elsewhere, Link, Pasted, Proxy, Tree, Typed)  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, program, wait_until  # noqa: E402

TESTS = os.path.dirname(os.path.abspath(__file__))
EDITOR = "benjamindeleze/theia-test:test3"
HANDSHAKE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}


class Fault(Exception):
    pass


class Stage:
    """What rows share; each thing is there once the first row needs it, and ends with the stage."""

    def __init__(self):
        self.stack = contextlib.ExitStack()
        self.repositories = 0
        self.made = {}

    def the(self, make):
        if make not in self.made:
            self.made[make] = make(self)
        return self.made[make]

    def enter(self, context):
        return self.stack.enter_context(context)

    def repository(self, files, name="robots", owner="", branch="main"):
        """The address of a new one; of an owner of its own, unless it has to have a name."""
        git = self.the(git_server)
        self.repositories += 1
        owner = owner or f"owner{self.repositories}"
        path = git.add_repository(owner, name, branches={branch: files})
        return f"{git.url}/{owner}/{name}", path


def git_server(stage):
    return stage.enter(GitServer())


def machine(stage):
    git = stage.the(git_server)
    return stage.enter(SimulationServer(forges=[git.url], allowedRepositories=[git.url], maxConnections=4))


def viewer(stage):
    """A browser at the page of a site with the machine."""
    session = stage.enter(SessionServer([stage.the(machine).address], relay=True, viewerUrl=WORLD))
    driver = stage.enter(open_browser(1280, 800))
    wait_until(lambda: session.get("/") == "1", session.log)
    return driver, session


def engine(stage):
    simulator = program("webots-demo-simulator")
    compose_command()
    docker = stage.enter(DockerDaemon())
    docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator}, ["/bin/sh", "/bin/sleep", "/bin/false"])
    docker.import_image(EDITOR, {}, ["/bin/sleep"])
    return stage.enter(docker_server(docker, stage.the(git_server)))


def certificate(stage):
    return Certificate(stage.enter(tempfile.TemporaryDirectory(prefix="webots_cloud_real_")))


def site(stage):
    """A site that learns from a proxy where it is."""
    own = stage.enter(SimulationServer(**LOCAL, server="*", ssl=False, gateway=True, maxConnections=4, reconnectGrace=0))
    entry = {"address": f"*/{own.port}", "internal": f"127.0.0.1:{own.port}"}
    session = stage.enter(SessionServer([entry], server="localhost", ssl=False, relay=True))
    wait_until(lambda: session.get("/") == "1", session.log)
    return session, own


def compare(row, said):
    if not row.says and said:
        raise Fault(said)
    if row.says and not said:
        raise Fault(f"it works, and should say {row.says}")
    if not re.search(row.says, said):
        raise Fault(f"it says {said!r}, and not {row.says}")
    return said


async def start(simulation, url, look=None):
    """Starts a simulation: what browsers were told, the error in it ("": a picture has come), and what `look` found meanwhile."""
    async with Browser(simulation) as browser:
        await browser.start(url)
        while not browser.told or not (browser.told[-1].startswith("webots:") or "Error" in browser.told[-1]):
            browser.told.append(await asyncio.wait_for(browser.socket.recv(), PATIENCE))
        last = browser.told[-1]
        if "Error" in last:
            return browser.told, last, None
        async with websockets.connect(last.removeprefix("webots:").rstrip("/") + "/", max_size=None) as simulator:
            await simulator.send("mjpeg: 320x240")
            while not isinstance(await asyncio.wait_for(simulator.recv(), PATIENCE), (str, bytes)):
                pass
        return browser.told, "", await look(browser) if look else None


def try_link(stage, row):
    owner, name = row.repository.split("/")
    is_usual = row.repository == Link.repository
    address, _ = stage.repository({**ROBOTS, **row.files}, name, "" if is_usual else owner, row.branch)
    git = stage.the(git_server)
    link = row.link.replace("{}", git.url).replace("{host}", git.url.partition("//")[2])
    link = link.replace(f"/{row.repository}", urllib.parse.urlsplit(address).path) if is_usual else link
    simulation = stage.the(machine)
    said = compare(row, asyncio.run(start(simulation, link))[1])
    simulation.wait_until_clean()
    return said


def quit_simulation(stage, driver):
    """As people do who do not come back: else the simulation waits for them, and the page's next visit looks for it."""
    body = driver.find_element("tag name", "body")
    driver.find_element("id", "quit").click()
    wait_until(lambda: body.get_attribute("data-state") in ("ended", "idle"), lambda: driver.find_element("id", "status").text)
    driver.get("about:blank")
    stage.the(machine).wait_until_clean()


def try_typed(stage, row):
    driver, session = stage.the(viewer)
    address, _ = stage.repository(ROBOTS)
    world = f"{address}/blob/main/worlds/arena.wbt"
    text = row.text.replace("{quoted}", urllib.parse.quote(world, safe="")).replace("{}", world)
    driver.get(f"{session.url}/viewer/")
    body = driver.find_element("tag name", "body")
    wait_until(lambda: body.get_attribute("data-availability") == "available", session.log)
    driver.execute_script("document.getElementById('connect-to').value = arguments[0]", text)
    driver.find_element("id", "start").click()
    wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), lambda: driver.find_element("id", "status").text)
    if body.get_attribute("data-state") == "failed":
        return compare(row, driver.find_element("id", "status").text)
    quit_simulation(stage, driver)
    return compare(row, "")


def try_pasted(stage, row):
    driver, session = stage.the(viewer)
    address, _ = stage.repository({**ROBOTS, "README.md": "Robots\n"})
    driver.get(f"{session.url}/viewer/")
    body = driver.find_element("tag name", "body")
    wait_until(lambda: body.get_attribute("data-availability") == "available", session.log)
    driver.execute_script("document.getElementById('connect-to').value = arguments[0]", row.text.replace("{}", address))
    driver.find_element("id", "start").click()
    wait_until(lambda: "/worlds/?of=" in driver.current_url, lambda: driver.find_element("id", "status").text)
    body = driver.find_element("tag name", "body")
    wait_until(lambda: body.get_attribute("data-worlds") is not None, session.log)
    titles = [each.text for each in driver.find_elements("css selector", ".world .name")]
    said = driver.find_element("id", "trouble").text
    if sorted(titles) != sorted(row.titles):
        raise Fault(f"the worlds are {titles}: {said}")
    if titles:
        driver.find_element("css selector", ".world").click()
        wait_until(lambda: "/viewer/?url=" in driver.current_url, session.log)
        wait_until(lambda: driver.find_element("tag name", "body").get_attribute("data-state") in ("running", "failed"), session.log)
        if driver.find_element("tag name", "body").get_attribute("data-state") == "failed":
            raise Fault(driver.find_element("id", "status").text)
        quit_simulation(stage, driver)
    return compare(row, said)


def try_tree(stage, row):
    address, path = stage.repository({"worlds/a.wbt": ""})
    git = stage.the(git_server)

    def written(entries):
        hashed = [(mode, name, written(content) if isinstance(content, list) else git.write_object(path, "blob", content.encode()))
                  for mode, name, content in entries]
        return sorted(hashed, key=lambda entry: entry[1] + (b"/" if entry[0] == "40000" else b""))

    world = [("100644", b"arena.wbt", ROBOTS["worlds/arena.wbt"].decode())]
    git.commit_tree(path, written([*row.entries, ("40000", b"worlds", world)]))
    simulation = stage.the(machine)

    async def look(browser):
        if row.says and not any(text.startswith("stderr:") for text in browser.told):
            await browser.hear("stderr:")
        root = os.fsencode(f"/proc/{simulation.process.pid}/root{simulation.instances_folder()}")
        files = [os.path.join(folder, name) for folder, _, names in os.walk(root) for name in names]
        return {file.partition(b"/robots/")[2] for file in files} - {b"worlds/arena.wbt", b""}

    told, error, found = asyncio.run(start(simulation, f"{address}/blob/main/worlds/arena.wbt", look))
    if error:
        raise Fault(error)
    if found != set(row.kept):
        raise Fault(f"the simulation has {sorted(found)}, and should have {sorted(row.kept)}")
    simulation.wait_until_clean()
    return compare(row, " / ".join(text.removeprefix("stderr:") for text in told if text.startswith("stderr:")))


def try_container(stage, row):
    simulation = stage.the(engine)
    address, _ = stage.repository({**ROBOTS, "webots.yml": row.yml, **row.files})
    told, error, _ = asyncio.run(start(simulation, f"{address}/blob/main/worlds/arena.wbt"))
    if missing := [text for text in row.told if text not in told]:
        raise Fault(f"browsers are not told {missing}: {told}")
    simulation.wait_until_clean()
    return compare(row, error)


def ask(port, path, trust, headers=()):
    with contextlib.closing(http.client.HTTPSConnection("localhost", port, timeout=PATIENCE, context=trust)) as connection:
        connection.request("GET", path, headers=dict(headers))
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


async def visit(place, trust):
    """The address of a simulation that a browser starts at `place`, and whose pictures it gets."""
    async with websockets.connect(f"{place}/client", ssl=trust) as browser:
        await browser.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
        while not (said := await asyncio.wait_for(browser.recv(), PATIENCE)).startswith("webots:"):
            if "Error" in said:
                raise Fault(said)
        address = said.removeprefix("webots:")
        if address.startswith("wss:"):
            async with websockets.connect(f"{address}/", ssl=trust, max_size=None) as simulator:
                await simulator.send("mjpeg: 320x240")
                await asyncio.wait_for(simulator.recv(), PATIENCE)
        return address


def try_proxy(stage, row):
    session, own = stage.the(site)
    trusted = stage.the(certificate)
    trust = ssl.create_default_context(cafile=trusted.authority)
    port = free_port()
    rules = row.rules.format(session.port, session.port)
    place = f"{row.scheme}://localhost:{port}{row.path}"
    with nginx.in_front(rules, port, trusted) if row.server == "nginx" else apache.Apache(rules, port, trusted):
        status, told = ask(port, f"{row.path}/session", trust)
        if row.says and row.asks == "/session":
            return compare(row, f"{status} {told}")
        if (status, told) != (200, place):
            raise Fault(f"/session answers {status} {told!r}, and not {place}")
        status, page = ask(port, f"{row.path}/viewer/", trust)
        if status != 200 or "<html" not in page:
            raise Fault(f"/viewer/ answers {status}")
        if row.says:
            status, said = ask(port, f"{row.path}/client", trust, HANDSHAKE)
            return compare(row, f"{status} {said}".strip())
        address = asyncio.run(visit(place, trust))
        if not re.fullmatch(re.escape(f"{place}/{own.port}/simulation/") + r"[a-zA-Z]+/\d+", address):
            raise Fault(f"a simulation is at {address}, and not below {place}/{own.port}/")
    own.wait_until_clean()
    return ""


def try_check(stage, row):
    down = []
    for server in stage.the(site):
        if server.PROGRAM.split("-")[1] not in row.of:
            continue
        with haproxy.health(free_port(), server.port, row.check) as look:
            wait_until(lambda: look()[1] not in ("", "L4OK"), lambda: f"no check: {look()}")
            if look() != ("UP", "L7OK"):
                down.append(f"{server.PROGRAM} is {' '.join(look())}")
    return compare(row, ", ".join(down))


def try_configuration(_, row):
    with tempfile.TemporaryDirectory(prefix="webots_cloud_real_") as folder:
        path = os.path.join(folder, "site.json")
        with open(path, "w") as file:
            json.dump({**row.keys, "port": free_port(following=110)}, file, indent=2)  # ports of this machine may be in use
        environment = {**os.environ, "HOME": folder, "WEBOTS_HOME": ""}
        done = subprocess.run([program(f"webots-{row.kind}-server"), "--check-config", path], capture_output=True, text=True, cwd=folder, env=environment,
                              timeout=PATIENCE)
    said = " / ".join(line.replace(path, "site.json") for line in (done.stdout + done.stderr).splitlines() if line.strip())
    if (done.returncode != 0) != row.refused:
        raise Fault(f"exit status {done.returncode}: {said}")
    if not re.search(row.says, said):
        raise Fault(f"it says {said!r}, and not {row.says}")
    return said


def try_elsewhere(_, row):
    with open(os.path.join(TESTS, row.file)) as file:
        if row.words not in file.read():
            raise Fault(f"tests/{row.file} has no {row.words}")
    return f"tested by tests/{row.file}"


TRIES = {Link: try_link, Typed: try_typed, Pasted: try_pasted, Tree: try_tree, Container: try_container, Proxy: try_proxy, Check: try_check,
         Configuration: try_configuration, Elsewhere: try_elsewhere}


def result(stage, row):
    try:
        sentence = TRIES[type(row)](stage, row)
        return ("GAP", f"{sentence} ({row.gap})") if row.gap else ("good", sentence)
    except unittest.SkipTest as why:
        return "skipped", str(why)
    except Fault as fault:
        return ("GAP", f"{fault} ({row.gap})") if row.gap and re.search(row.says, str(fault)) else ("FAILED", str(fault))
    except (AssertionError, OSError, asyncio.TimeoutError, websockets.WebSocketException) as fault:
        return "FAILED", f"{type(fault).__name__}: {fault}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART OF A NAME")
    parts = parser.parse_args().parts
    rows = [row for row in ROWS if not parts or any(part in f"{type(row).__name__}: {row.name}" for part in parts)]
    stage = Stage()
    counts = {}
    with stage.stack:
        for row in rows:
            outcome, sentence = result(stage, row)
            counts[outcome] = counts.get(outcome, 0) + 1
            print(f"{outcome:8}{type(row).__name__}: {row.name} [{row.source}]: {' '.join(sentence.split())[:300]}", flush=True)
    print(", ".join(f"{number} {outcome}" for outcome, number in counts.items()) or "no row has such a name")
    return 1 if "FAILED" in counts or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
