#!/usr/bin/python3
"""Simulations in containers of a real Docker daemon: the browser's messages, and that nothing is left, whatever happens.
Protocol sections 4.1.3, 6.3, 6.4 and 6.5, quirks Q12 and Q26 to Q29.
"""

import asyncio
import contextlib
import http.server
import json
import os
import re
import shutil
import signal
import sys
import tempfile
import threading
import unittest
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, websockets  # noqa: E402
from support.docker import IMAGES, TEMPLATES, DockerDaemon, compose_command, docker_server, python_files  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.lessons import solved  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.projects import demo_project, files_of  # noqa: E402
from support.refusals import error_line, error_pattern  # noqa: E402
from support.servers import SimulationServer, descendants, main, port_is_free, program, wait_until  # noqa: E402

EDITOR = "benjamindeleze/theia-test:test3"
CREATING = ("loading: Creating", "loading: Network ", "loading: Container ")  # compose 1, compose 2 with networks and without
NOTHING = {"containers": [], "networks": [], "volumes": []}

# In an image: where Webots has its own, the one of the tests.
CONTROLLER_LIBRARY = {f"/usr/local/webots/lib/controller/python/controller/{name}": os.path.join(os.path.dirname(__file__), "../support/controller_library", name)
                      for name in ("__init__.py", "wb.py")}

# Containers and the like of somebody else, which must not be touched.
STRANGER = ["run", "--detach", "--network", "none", "--name", "stranger", "--label", "com.docker.compose.project=blog"]


def setUpModule():
    global docker, git
    stack = contextlib.ExitStack()
    unittest.addModuleCleanup(stack.close)
    simulator = program("webots-demo-simulator")
    compose_command()
    git = stack.enter_context(GitServer())
    docker = stack.enter_context(DockerDaemon())
    docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator}, ["/bin/sh", "/bin/sleep", "/bin/false"])
    python = python_files("glob", "select", "signal", "socket", "subprocess", "tempfile", "traceback", "types")
    docker.import_image(f"{IMAGES}:R2025a-python", {"/usr/local/webots/webots": simulator, **CONTROLLER_LIBRARY}, ["/bin/sh", "/bin/sleep", *python])
    runs_python = python_files("io", "linecache", "math", "os", "socket", "sys", "traceback", "types")
    docker.import_image(f"{IMAGES}:R2025b-ubuntu22.04", {"/usr/local/webots/webots": simulator}, ["/bin/sh", "/bin/sleep", "/bin/ln", *runs_python])
    docker.import_image(EDITOR, {}, ["/bin/sleep", "/bin/ls"])
    robots = demo_project()
    del robots["webots.yml"]
    git.add_repository("o", "robots", robots)
    git.add_repository("o", "own", {**robots, "docker-compose.yml": "services: {webots: {image: evil}}\n", "Dockerfile": "FROM evil\n",
                                    "webots.yml": "publish: true\ntype: demo\n"})
    git.add_repository("o", "fields", {**robots, "webots.yml": "dockerCompose:theia\n"})
    git.add_repository("o", "theia", {**robots, "webots.yml": "dockerCompose:theia:webots-project/controllers/\n"})
    git.add_repository("o", "competition", {**robots, **competition(f"FROM {IMAGES}:R2025a-ubuntu22.04\nCMD [\"/bin/sleep\", \"1000\"]\n")})
    git.add_repository("o", "deep", {**{os.path.join("projects/robots", name): content for name, content in robots.items()},
                                     "webots.yml": "dockerCompose:theia:webots-project/controllers/\n",
                                     "projects/robots/webots.yml": "type: demo\n"})
    lessons = {name: content.replace(b"R2025a", b"R2025b") for name, content in files_of("lessons").items() if name != "webots.yml"}
    git.add_repository("o", "lessons", lessons)
    git.add_repository("o", "lessons-theia", {**lessons, "webots.yml": "dockerCompose:theia:webots-project/controllers/\n"})
    git.add_repository("o", "make", {**robots, "Makefile": "all:\n\tfalse\n"})
    git.add_repository("o", "broken", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\nRUN false\n"})
    labels = "LABEL webots_cloud.server=x com.docker.compose.project=y com.docker.compose.service=webots\n"
    git.add_repository("o", "hidden", {**robots, **competition(f"\ufeffFROM {IMAGES}:R2025a-ubuntu22.04\n{labels}RUN false\n")})
    git.add_repository("o", "slow", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\nRUN sleep 1000\n"})
    line = 1000 * "x"
    git.add_repository("o", "greedy", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\nRUN while echo {line}; do :; done >/loot\n"})
    some = f"RUN i=0; while [ $i -lt 8000 ]; do echo {line}; i=$((i+1)); done >/loot"
    wait = "RUN sleep 1000\n"
    git.add_repository("o", "layered", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\n" +
                                        "".join(f"{some}{each}\n" for each in range(3)) + wait})
    git.add_repository("o", "copied", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04 AS first\n{some}\n"
                                       f"FROM {IMAGES}:R2025a-ubuntu22.04\n" +
                                       "".join(f"COPY --from=first /loot /loot{each}\n" for each in range(3)) + wait})
    git.add_repository("o", "large", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\n{some}\n"
                                      "COPY . /usr/local/webots-project\n"})
    git.add_repository("o", "exposed", {**robots, "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\nEXPOSE 22 1000-1010 3000/udp\n"
                                        "COPY . /usr/local/webots-project\n"})
    git.add_repository("o", "injection", {"worlds/a$(touch x).wbt": "#VRML_SIM R2025a utf8\n"})


def competition(dockerfile):
    return {"webots.yml": "type: competition\ndockerCompose: competition:webots-project/controllers/participant/\n",
            "controllers/Dockerfile": dockerfile}


# A participant as official competitions have them: the Dockerfile in their words, with its entry point or without one.
PARTICIPANT_IMAGE = f"""# Based on the organizers' image.
FROM {IMAGES}:R2025a-python
ENV WEBOTS_HOME=/usr/local/webots

ENV PYTHONPATH=${{WEBOTS_HOME}}/lib/controller/python
ENV PYTHONIOENCODING=UTF-8
ENV LD_LIBRARY_PATH=${{WEBOTS_HOME}}/lib/controller:${{LD_LIBRARY_PATH}}
ARG WEBOTS_CONTROLLER_URL
ENV WEBOTS_CONTROLLER_URL=${{WEBOTS_CONTROLLER_URL}}
ARG PROJECT_PATH

COPY . ${{PROJECT_PATH}}/controllers
WORKDIR ${{PROJECT_PATH}}/controllers/participant
"""
PARTICIPANT = """from controller import Robot

robot = Robot()
print("I walk the line")
while robot.step(100) != -1:
    %s
"""
DUEL = """#VRML_SIM R2025a utf8
WorldInfo { title "Duel" }
RectangleArena { floorSize 2 2 }
E-puck { translation -0.4 0 0 name "participant" controller "participant" }
E-puck { translation 0.4 0 0 name "opponent" controller "opponent" }
"""


def official_competition(dockerfile, then="pass"):
    """The tree of an official competition; `then`: what its participant does in each step."""
    return {"webots.yml": "publish: true\ntype: competition\nworld:\n  file: worlds/duel.wbt\n  max-duration: 30\n  metric: ranking\n"
                          "dockerCompose: competition:../../../usr/local/webots-project/controllers/\n",
            "Dockerfile": f"FROM {IMAGES}:R2025a-ubuntu22.04\nCOPY . /usr/local/webots-project\n", "worlds/duel.wbt": DUEL,
            "controllers/Dockerfile": dockerfile, "controllers/participant/participant.py": PARTICIPANT % then,
            "controllers/participant/participant.json": '{"name": "Nobody", "programming": "Python"}\n',
            "controllers/opponent/opponent.py": "", "controllers/referee/referee.py": "secret = 1\n"}


def world(repository, file="arena.wbt", folder=""):
    return f"{git.url}/o/{repository}/blob/main/{folder}worlds/{file}"


def server(**settings):
    return docker_server(docker, git, **settings)


def guards_of(folder):
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            with contextlib.suppress(OSError), open(f"/proc/{entry}/cmdline", "rb") as line:
                if os.path.join(folder, "state").encode() in line.read():
                    found.append(int(entry))
    return found


class Registry(http.server.BaseHTTPRequestHandler):
    """Has no images, and says so with this status and this code."""
    protocol_version = "HTTP/1.1"
    refusal = (404, "MANIFEST_UNKNOWN")

    def do_GET(self):
        known = self.path == "/v2/"
        status, code = (200, "") if known else self.refusal
        body = json.dumps({} if known else {"errors": [{"code": code, "message": code.lower(), "detail": {"Tag": "R2025a"}}]}).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Docker-Distribution-Api-Version", "registry/2.0")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(body)

    do_HEAD = do_GET

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def registry(*refusal):
    """The address of a registry that refuses like this."""
    handler = type("Refusing", (Registry,), {"refusal": refusal or Registry.refusal})
    running = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=running.serve_forever, daemon=True).start()
    try:
        yield f"127.0.0.1:{running.server_address[1]}"
    finally:
        running.shutdown()
        running.server_close()


class Docker(unittest.IsolatedAsyncioTestCase):
    def check_clean(self, simulation, things=NOTHING):
        """No container, network, volume, process, directory or port is left."""
        wait_until(lambda: docker.things() == things, f"left: {docker.things()}\n{simulation.log()[-6000:]}", 90)
        wait_until(lambda: not guards_of(simulation.folder), "processes are left", 90)
        wait_until(lambda: not simulation.instances(), f"directories are left: {simulation.instances()}")
        for port in range(simulation.port + 1, simulation.port + 9):
            wait_until(lambda: port_is_free(port), f"port {port} is held")

    @contextlib.asynccontextmanager
    async def visit(self, simulation):
        """A browser, and nothing is left when it has gone."""
        async with Browser(simulation) as browser:
            yield browser
        self.check_clean(simulation)

    def tearDown(self):
        self.assertEqual(docker.things(), NOTHING, "of a test before")

    async def start(self, browser, url):
        await browser.start(url)
        return await browser.hear("webots:")

    async def test_a_simulation_runs_in_a_container_and_nothing_is_left_when_its_browser_leaves(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                address = await self.start(browser, world("robots"))
                told = [text for text in browser.told if not text.startswith("loading: Receiving objects")]
                self.assertEqual(told[0], "shutdownTimeout: 7200")
                self.assertEqual(told[-1], f"webots:ws://localhost:{simulation.port + 1}")
                self.assertTrue(all(text.startswith("loading: ") for text in told[1:-1]), told)
                self.assertTrue(any(text.startswith("loading: Step 1/") for text in told), told)
                async with websockets.connect(address[len("webots:"):] + "/") as webots:
                    await webots.send("mjpeg: 320x240")
                    self.assertTrue(await asyncio.wait_for(webots.recv(), 60))
                await browser.hear(".")
                self.assertEqual(len(docker.things()["containers"]), 1)

    async def test_messages_of_webots_yml_come_first_and_files_of_the_project_are_not_docker_s(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("own"))
                told = [text for text in browser.told if not text.startswith("loading: Receiving objects")]
                self.assertEqual(told[:4], ["type:demo\n", "shutdownTimeout: 7200",
                                            "loading: The Dockerfile of the project is not used: this server builds with its own.",
                                            "loading: The docker-compose.yml of the project is not used: this server runs its own."])

    async def test_the_webots_yml_beside_the_worlds_counts_and_not_the_repositorys(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("deep", folder="projects/robots/"))
                told = [text for text in browser.told if not text.startswith("loading: Receiving objects")]
                self.assertEqual(told[:2], ["type:demo\n", "shutdownTimeout: 7200"])

    async def test_what_was_built_before_is_not_built_again(self):
        with server() as simulation:
            for turn in range(2):
                async with self.visit(simulation) as browser:
                    await self.start(browser, world("robots"))
            steps = [text for text in browser.told if text.startswith(("loading: Step ", "loading: ---> "))]
            began = [step for step, what in zip(steps, steps[1:]) if what.startswith("loading: ---> Running in ")]
            # An image that loses its name loses its last step with it, which does nothing.
            self.assertEqual(len(began), 1, browser.told)
            self.assertRegex(began[0], r"^loading: Step (\d+)/\1 : LABEL (webots_cloud\.server|com\.docker\.compose\.image\.builder)=")
            self.assertTrue([text for text in steps if text.endswith("Using cache")], browser.told)

    async def test_no_browser_hears_a_name_of_what_is_built_and_nothing_that_has_ended_has_one(self):
        with server() as simulation:
            def names():
                return docker.run("images", "--format", "{{.Repository}}", f"webots-{simulation.port}-*").split()
            async with self.visit(simulation) as browser:
                await self.start(browser, world("robots"))
                name, = names()
                self.assertRegex(name, rf"^webots-{simulation.port}-[0-9a-f]{{8}}-1-[0-9a-f]{{32}}[-_]webots$")
                secret = name[:-len("_webots")].rpartition("-")[2]
                self.assertTrue([text for text in browser.told if "simulation" in text], browser.told)
                self.assertFalse([text for text in browser.told if secret in text], browser.told)
            wait_until(lambda: names() == [], "an image has kept its name")
            async with Browser(simulation) as browser:
                await self.start(browser, world("robots"))
                await asyncio.to_thread(self.kill_server_and_guards, simulation)
            self.assertEqual(len(names()), 1)
            await asyncio.to_thread(simulation.start)
            self.check_clean(simulation)
            self.assertEqual(names(), [])

    async def test_containers_have_no_capabilities_and_see_no_display_where_there_is_to_be_none(self):
        with server(display="none") as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("competition"))
                for service in ("webots", "controller"):
                    host = self.inspect(service)["HostConfig"]
                    self.assertEqual(host["LogConfig"]["Config"], {"max-size": "1m", "max-file": "2"}, "what it prints fills no disk")
                    self.assertEqual(host["CapDrop"], ["ALL"], service)
                    self.assertIn("no-new-privileges:true", host["SecurityOpt"], service)
                mounts = {each["Destination"]: each["Type"] for each in self.inspect("webots")["Mounts"]}
                mounts.update(dict.fromkeys(self.inspect("webots")["HostConfig"].get("Tmpfs") or {}, "tmpfs"))
                self.assertEqual(mounts["/tmp/.X11-unix"], "tmpfs")
                self.assertNotIn("/tmp/.X11-unix", str(self.inspect("webots")["HostConfig"]["Binds"]))

    def inspect(self, service):
        container = docker.container_of(service)
        return json.loads(docker.run("inspect", container))[0]

    def containers_of(self, service):
        return docker.run("ps", "--quiet", "--filter", f"label=com.docker.compose.service={service}").split()

    async def test_an_editor_runs_beside_the_simulator(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("theia"))
                self.assertIn("ide: enable", browser.told)
                self.assertFalse([text for text in browser.told if "theia" in text])
                editor = docker.container_of("theia")
                self.assertIn(f":{simulation.port + 501}", docker.run("port", editor))
                self.assertEqual(len(docker.things()["volumes"]), 1)

    async def test_an_editor_is_passed_on_to_through_the_gateway_alone(self):
        with server(gateway=True) as simulation:
            async with self.visit(simulation) as browser:
                address = await self.start(browser, world("theia"))
                editor = docker.container_of("theia")
                self.assertEqual(docker.run("port", editor, "3000").split(), [f"127.0.0.1:{simulation.port + 501}"])
                path = address[len("webots:ws://localhost:") + len(str(simulation.port)):].rpartition("/")[0]
                # Nothing listens in this editor; of other ports nobody learns even that.
                self.assertEqual(simulation.ask(f"{path}/{simulation.port + 501}/")[0], 502)
                self.assertEqual(simulation.ask(f"{path}/{simulation.port + 502}/")[0], 404)
                # Behind a session server that does not trust this machine it would have no origin, which it can't do without.
                status, text = simulation.ask(f"{path}/{simulation.port + 501}/", headers={"Webots-Cloud-Untrusted": "1"})[:2]
                self.assertEqual(status, 403)
                self.assertIn('"trusted": true', str(text))
                status = simulation.ask(f"{path}/{simulation.port + 1}/robot_windows/x.html", headers={"Webots-Cloud-Untrusted": "1"})[0]
                self.assertNotEqual(status, 403)

    async def test_a_program_that_a_visitor_saves_runs_in_the_container_after_a_reset(self):
        for repository in ("lessons", "lessons-theia"):  # in its own file system, in a volume
            with self.subTest(repository), server(allowEdit=True) as simulation:
                async with self.visit(simulation) as browser:
                    await self.program_a_robot(browser, repository)

    async def program_a_robot(self, browser, repository):
        file, original = "move/move.py", files_of("lessons")["controllers/move/move.py"].decode()
        await browser.start(world(repository, "lesson_1_move.wbt"), mode="w3d", edit=True)
        address = (await browser.hear("webots:"))[len("webots:"):]
        self.assertEqual(json.loads((await browser.hear("files: "))[len("files: "):])[0], {"path": file, "changed": False})
        self.assertEqual(json.loads((await browser.hear("lesson: "))[len("lesson: "):])["title"]["de"], "Lektion 1: Fahren")
        self.assertEqual((await self.ask(browser, read=file))["text"], original)
        async with websockets.connect(address + "/", max_size=None) as webots:
            await webots.send("w3d;broadcast")
            await webots.send("fast:-1")

            async def run_until(printed):
                await webots.send("reset")
                while not str(await asyncio.wait_for(webots.recv(), 60)).startswith(printed):
                    pass
            await run_until("stdout:Hello, I am your robot. The wheels turn with 0.0")
            self.assertTrue((await self.ask(browser, write={"path": file, "text": "print('mine')\n"}))["saved"])
            await run_until("stdout:mine")
            self.assertTrue((await self.ask(browser, write={"path": file, "text": solved("lesson_1_move")}))["saved"])
            await run_until("stdout:You did it: ")
            await browser.socket.send(json.dumps({"reset controller": file}))
            await browser.hear(f"reset controller: {file}")
            await run_until("stdout:Hello, I am your robot. The wheels turn with 0.0")
            # What is put in its place within the container stays in there.
            container = docker.container_of("webots")
            place = f"/usr/local/webots-project/controllers/{file}"
            for command in (f"/bin/ln -sf /etc/planted {place}", f"/bin/ln -sfn /nowhere/at/all {place}"):
                await asyncio.to_thread(docker.run, "exec", container, "/bin/sh", "-c", command)
                await self.ask(browser, write={"path": file, "text": "print('again')\n"})
            self.assertFalse(os.path.exists("/etc/planted"))

    async def ask(self, browser, **message):
        await browser.socket.send(json.dumps(message))
        return json.loads((await browser.hear("file: "))[len("file: "):])

    async def test_what_a_container_writes_counts_towards_its_limit_of_disk(self):
        cases = [("robots", "/loot"), ("theia", "/usr/local/webots-project/controllers/loot")]  # in its own file system, in a volume
        with tempfile.NamedTemporaryFile() as loot, server(simulationDisk=20) as simulation:
            loot.write(os.urandom(30 << 20))
            loot.flush()
            for repository, place in cases:
                with self.subTest(repository=repository):
                    async with self.visit(simulation) as browser:
                        await self.start(browser, world(repository))
                        container = docker.container_of("webots")
                        await asyncio.to_thread(docker.run, "cp", loot.name, f"{container}:{place}")
                        await browser.hear_all()
                        self.assertIn("The simulation filled its folder with more than 20 MB, ", browser.told[-1])

    async def test_a_reset_in_a_competition_restarts_the_controller(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                address = await self.start(browser, world("competition"))
                controller = docker.container_of("controller")
                began = docker.run("inspect", "--format", "{{.State.StartedAt}}", controller)
                async with websockets.connect(address[len("webots:"):] + "/") as webots:
                    await webots.send("mjpeg: 320x240")
                    await webots.send("reset")
                    wait_until(lambda: docker.run("inspect", "--format", "{{.State.StartedAt}}", controller) != began,
                               f"the controller is not restarted\n{simulation.log()[-3000:]}")
                await browser.hear(".")
                wait_until(lambda: self.containers_of("controller") == [controller], "the controller is another one")

    async def test_a_participant_of_an_official_competition_prints_in_the_browser(self):
        cases = {"entry": ("ENTRYPOINT python3 participant.py\n", "pass", "stdout:I walk the line"),
                 "none": ("", "pass", "stdout:I walk the line"),
                 "crash": ("", "raise KeyError(robot.step(1))", "stdout:KeyError: 0")}
        for name, (more, then, printed) in cases.items():
            git.add_repository("o", f"duel-{name}", official_competition(PARTICIPANT_IMAGE + more, then))
            with self.subTest(name), server() as simulation:
                async with self.visit(simulation) as browser:
                    address = await self.start(browser, world(f"duel-{name}", "duel.wbt"))
                    told = [text for text in browser.told if not text.startswith("loading: Receiving ")]
                    self.assertEqual(told[:2], ["type:competition\n", "ide: enable"])
                    async with websockets.connect(address[len("webots:"):] + "/") as webots:
                        await webots.send("mjpeg: 320x240")
                        while (said := await asyncio.wait_for(webots.recv(), 60)) != printed:
                            self.assertFalse(str(said).startswith("stdout:no simulator"), said)
                    self.check_who_sees_the_participant()

    def check_who_sees_the_participant(self):
        def mounts(service):
            return {each["Destination"].rstrip("/"): each.get("Name") for each in self.inspect(service)["Mounts"] if each["Type"] == "volume"}
        controllers = "/usr/local/webots-project/controllers"
        wait_until(lambda: self.containers_of("theia"), "there is no editor")
        participants = mounts("controller")[controllers]
        self.assertEqual(mounts("theia"), {"/home/project/webots-project": participants})
        self.assertNotIn(participants, mounts("webots").values(), "the participant would write the referee's program")
        self.assertIn("participant", docker.run("exec", *self.containers_of("theia"), "/bin/ls", "/home/project/webots-project").split())
        self.assertEqual(self.inspect("controller")["HostConfig"]["NetworkMode"], "none")

    async def test_what_cannot_be_started_is_said_in_one_sentence(self):
        cases = [("fields", {}, error_pattern("wrong_compose_line", line="dockerCompose:theia")),
                 ("make", {}, error_pattern("ended_early_saying")),
                 ("own", {"projectDockerfiles": True}, error_pattern("dockerfile_line", line=1, file="Dockerfile")),
                 ("hidden", {}, error_pattern("ended_early_saying")),
                 ("broken", {"projectDockerfiles": True}, error_pattern("ended_early_saying"))]
        for repository, settings, sentence in cases:
            with self.subTest(repository=repository, **settings), server(**settings) as simulation:
                async with self.visit(simulation) as browser:
                    await browser.start(world(repository))
                    await browser.hear_all()
                    errors = [text for text in browser.told if text.startswith("loading: Error: ")]
                    self.assertEqual(len(errors), 1, browser.told)
                    self.assertRegex(errors[0], sentence)
                    self.assertEqual(browser.told[-1], errors[0])

    async def test_a_step_of_a_build_has_the_limits_of_a_simulation(self):
        with server(projectDockerfiles=True, simulationProcesses=50, simulationMemory=100) as simulation:
            async with self.visit(simulation) as browser:
                await browser.start(world("slow"))
                await browser.hear("loading: Step 3/")
                await browser.hear("loading: ---> Running in ")

                def limits():
                    return [(each["HostConfig"]["PidsLimit"], each["HostConfig"]["Memory"])
                            for step in docker.run("ps", "--quiet").split() for each in json.loads(docker.run("inspect", step))]
                wait_until(lambda: limits() == [(50, 100 << 20)], "the build has no limits")

    async def test_a_build_whose_steps_write_too_much_ends(self):
        for repository in ("greedy", "layered", "copied"):  # in one step, in several, by copies of a stage's files
            with self.subTest(repository), server(projectDockerfiles=True, simulationDisk=20) as simulation:
                async with self.visit(simulation) as browser:
                    await browser.start(world(repository))
                    await browser.hear_all()
                    self.assertTrue(browser.told[-1].startswith("loading: Error: The steps that build the project made images of more "
                                                                "than 20 MB together, "), browser.told[-1])

    async def test_what_is_kept_of_builds_has_a_limit(self):
        def kept():
            return docker.run("images", "--all", "--quiet", "--no-trunc", "--filter", "label=webots_cloud.server").split()
        before = kept()
        with server(projectDockerfiles=True, buildCache=0.001) as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("large"))
                self.assertGreater(len(set(kept()) - set(before)), 1)
            wait_until(lambda: set(kept()) <= set(before), lambda: f"{kept()} {simulation.log()[-2000:]}")
            self.assertIn('("buildCache")', simulation.log())

    async def test_a_dockerfile_of_a_project_reaches_nothing_while_it_is_built(self):
        for settings, network in (({}, "none"), ({"buildNetwork": True}, "bridge")):  # of which older releases of Docker say: default
            with self.subTest(**settings), server(projectDockerfiles=True, **settings) as simulation:
                async with self.visit(simulation) as browser:
                    await browser.start(world("slow"))
                    await browser.hear("loading: Step 3/")
                    await browser.hear("loading: ---> Running in ")

                    def networks():
                        return [each["HostConfig"]["NetworkMode"].replace("default", "bridge") for step in docker.run("ps", "--quiet").split()
                                for each in json.loads(docker.run("inspect", step))]
                    wait_until(networks, "no step runs")
                    self.assertEqual(networks(), [network])
                    notes = [text for text in browser.told if "is built without a network" in text]
                    self.assertEqual(len(notes), int(network == "none"), browser.told)

    async def test_what_an_image_exposes_is_not_published(self):
        with server(projectDockerfiles=True, gateway=True, network="host") as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("exposed"))
                container = docker.container_of("webots")
                self.assertEqual(docker.run("port", container).split("\n"), [f"{simulation.port + 1}/tcp -> 127.0.0.1:{simulation.port + 1}", ""])

    async def test_old_images_go_after_a_simulation_and_those_that_are_listed_or_used_stay(self):
        names = {name: f"{IMAGES}:{name}" for name in ("old", "listed", "used")} | {"stranger": "stranger/webots:old"}
        for name in names.values():
            docker.import_old_image(f"{IMAGES}:R2025a-ubuntu22.04", name)
        docker.run("tag", f"{IMAGES}:R2025a-ubuntu22.04", f"{IMAGES}:young")
        docker.run("run", "--detach", "--network", "none", "--name", "user", names["used"], "/bin/sleep", "1000")

        def there():
            return set(docker.run("images", "--format", "{{.Repository}}:{{.Tag}}").split()) & {*names.values(), f"{IMAGES}:young"}
        try:
            with server(persistantDockerImages=[names["listed"]]) as simulation:
                async with Browser(simulation) as browser:
                    await self.start(browser, world("robots"))
                    self.assertEqual(len(there()), 5, "not while nothing has ended")
                stay = {names["listed"], names["used"], names["stranger"], f"{IMAGES}:young"}
                wait_until(lambda: there() == stay, lambda: f"{there()} {simulation.log()[-2000:]}")
                wait_until(lambda: docker.things()["containers"] == ["user running"], "left-overs")
        finally:
            docker.run("rm", "--force", "user")
            for name in there():
                docker.run("rmi", name)

    async def test_no_dockerfile_of_a_project_takes_files_of_another_simulation(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("robots"))
                image, number = docker.run("images", "--no-trunc", "--format", "{{.Repository}} {{.ID}}", f"webots-{simulation.port}-*").split()
                number = number.removeprefix("sha256:")
                thefts = [f"FROM {image}\n", f"FROM {image}:latest AS x\n", f"FROM {number}\n", f"FROM {number[:4]}\n",
                          f"FROM sha256:{number}\n", f"ARG X={image}\nFROM $X\n",
                          *[f"FROM scratch AS {stage}\nCOPY --from={stage} / /loot\n" for stage in (image, f"a{number}")],
                          f"FROM scratch\nCOPY --from={number[:4]} / /loot\n", f"\ufeffFROM\f{image}\n",
                          f"FROM scratch AS y\nONBUILD COPY --from={image} / /loot\nFROM y\n",
                          f"FROM scratch\nRUN --mount=type=bind,from={image},target=/loot true\n"]
                for turn, theft in enumerate(thefts):
                    git.add_repository("o", f"thief{turn}", {**demo_project(), **competition(theft)})
                    async with Browser(simulation) as thief:
                        await thief.start(world(f"thief{turn}"))
                        await thief.hear_all()
                        self.assertRegex(thief.told[-1], r"^loading: Error: Line \d of controllers/Dockerfile can't be used on this server: ")
                        self.assertFalse([text for text in thief.told if text.startswith("loading: Step ")], thief.told)

    async def test_a_name_that_would_add_to_the_command_is_refused(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await browser.start(world("injection", "a$(touch%20x).wbt"))
                await browser.hear_all()
                self.assertTrue(browser.told[-1].startswith("loading: Error: The name of the world file has characters"), browser.told)

    async def test_a_world_may_have_any_name_that_can_be_quoted(self):
        names = ("R&D [50%] #1!.wbt", "it's 'mine' #1 & [50%]!.wbt", "!'#.wbt")
        for turn, name in enumerate(names):
            git.add_repository("o", f"named{turn}", {f"worlds/{name}": "#VRML_SIM R2025a utf8\n"})
            with self.subTest(name), server() as simulation:
                async with self.visit(simulation) as browser:
                    await self.start(browser, world(f"named{turn}", urllib.parse.quote(name)))
                    self.assertEqual(self.inspect("webots")["Args"][-1], f"/usr/local/webots-project/worlds/{name}")

    async def test_an_image_that_no_registry_has_is_named(self):
        with registry() as address, server(dockerImages=f"{address}/webots") as simulation:
            async with self.visit(simulation) as browser:
                await browser.start(world("robots"))
                await browser.hear_all()
                self.assertEqual(browser.told[-1], "loading: Error: Image version R2025a not available on Cyberbotics' dockerHub. "
                                                   "Please, add the appropriate Dockerfile to your project.", browser.told)
                self.assertEqual(len([text for text in browser.told if text.startswith("loading: Error: ")]), 1)

    async def test_an_image_that_a_registry_does_not_give_is_refused_with_its_reason(self):
        cases = {(429, "TOOMANYREQUESTS"): "toomanyrequests", (401, "UNAUTHORIZED"): "unauthorized",
                 (500, "UNKNOWN"): "received unexpected HTTP status: 500 Internal Server Error", None: "connection refused"}
        for refusal, reason in cases.items():
            with self.subTest(reason), contextlib.ExitStack() as stack:
                address = stack.enter_context(registry(*refusal)) if refusal else f"127.0.0.1:{free_port()}"
                simulation = stack.enter_context(server(dockerImages=f"{address}/webots"))
                async with self.visit(simulation) as browser:
                    await browser.start(world("robots"))
                    await browser.hear_all()
                    self.assertRegex(browser.told[-1], error_pattern("ended_early_saying"))
                    words = re.match(error_pattern("ended_early_saying"), browser.told[-1])["words"]
                    self.assertTrue(words.startswith("The image can't be fetched: "), browser.told)
                    self.assertTrue(words.endswith(reason), browser.told)

    async def test_the_browser_hears_when_the_container_ends(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("robots"))
                docker.run("kill", *docker.run("ps", "--quiet").split())
                await browser.hear_all()
                self.assertTrue(browser.told[-1].startswith(error_line("quit").rstrip(".")), browser.told)

    async def test_nothing_is_left_when_the_browser_leaves_at_any_moment(self):
        with server() as simulation:
            for moment in ("shutdownTimeout:", "loading: Step 1/", "loading: Successfully", CREATING, "webots:"):
                with self.subTest(moment=moment):
                    async with self.visit(simulation) as browser:
                        await browser.start(world("robots"))
                        with contextlib.suppress(websockets.ConnectionClosed):
                            await browser.hear(moment)

    async def test_nothing_is_left_when_the_server_is_killed_even_while_the_next_one_starts(self):
        with server() as simulation:
            for moment in ("shutdownTimeout:", "loading: Step 1/", "loading: Successfully", "webots:"):
                with self.subTest(moment=moment):
                    async with self.visit(simulation) as browser:
                        await browser.start(world("robots"))
                        await browser.hear(moment)
                        await asyncio.to_thread(simulation.stop, signal.SIGKILL)
                        if moment == "webots:":  # this time nobody starts again: the guard alone
                            self.check_clean_of_containers()
                        await asyncio.to_thread(simulation.start)

    def check_clean_of_containers(self):
        wait_until(lambda: docker.things() == NOTHING, f"left: {docker.things()}", 90)

    async def test_what_even_the_guard_could_not_remove_goes_at_the_next_start_and_nothing_of_others(self):
        docker.run(*STRANGER, f"{IMAGES}:R2025a-ubuntu22.04", "/bin/sleep", "1000")
        docker.run("network", "create", "--label", "com.docker.compose.project=blog", "stranger")
        docker.run("volume", "create", "stranger")
        others = docker.things()
        try:
            with server() as simulation:
                async with Browser(simulation) as browser:
                    await self.start(browser, world("robots"))
                    await asyncio.to_thread(self.kill_server_and_guards, simulation)
                self.assertEqual(len(docker.things()["containers"]), 2)
                await asyncio.to_thread(simulation.start)
                self.check_clean(simulation, others)
        finally:
            docker.run("rm", "--force", "stranger")
            docker.run("network", "rm", "stranger")
            docker.run("volume", "rm", "stranger")

    async def test_a_label_with_a_line_end_names_nothing_of_others(self):
        image = f"{IMAGES}:R2025a-ubuntu22.04"
        docker.run(*STRANGER, image, "/bin/sleep", "1000")
        try:
            with server() as simulation:
                async with Browser(simulation) as browser:
                    await self.start(browser, world("robots"))
                    ours = docker.run("ps", "--filter", "name=webots", "--format", '{{.Label "com.docker.compose.project"}}').split()[0]
                    forged = f"com.docker.compose.project=x\nstranger\t{ours}\t\tUp"
                    docker.run("create", "--network", "none", "--name", "forger", "--label", forged, image)
                others = {**NOTHING, "containers": ["forger created", "stranger running"]}
                self.check_clean(simulation, others)
                await asyncio.to_thread(simulation.stop)
                await asyncio.to_thread(simulation.start)  # which looks for left-overs of all its simulations before it answers
                self.assertEqual(docker.things(), others)
        finally:
            docker.run("rm", "--force", "stranger", "forger")

    async def test_what_is_left_when_the_engine_is_killed_goes_once_it_answers_again(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("robots"))
                await asyncio.to_thread(docker.crash)
                try:
                    await browser.hear_all()
                    self.assertRegex(browser.told[-1], error_pattern("crashed"))
                    async with Browser(simulation) as next_one:
                        await next_one.start(world("robots"))
                        await next_one.hear_all()
                        self.assertRegex(next_one.told[-1], error_pattern("ended_early_saying"))
                        self.assertIn("Docker", next_one.told[-1])
                finally:
                    docker.start()  # in this thread, since it ends with the one that has started it

    def kill_server_and_guards(self, simulation):
        """Kills the server last: its guards must not notice that it is gone."""
        os.kill(simulation.process.pid, signal.SIGSTOP)
        for pid in descendants(simulation.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        simulation.stop(signal.SIGKILL)

    async def test_nothing_is_left_when_the_server_is_stopped(self):
        with server() as simulation:
            async with self.visit(simulation) as browser:
                await self.start(browser, world("robots"))
                self.assertEqual(await asyncio.to_thread(simulation.stop), 0)

    async def test_simulations_at_once_do_not_meet(self):
        with server() as simulation:
            async with contextlib.AsyncExitStack() as stack:
                browsers = [await stack.enter_async_context(Browser(simulation)) for _ in range(4)]
                addresses = await asyncio.gather(*(self.start(browser, world("robots")) for browser in browsers))
                self.assertEqual(len(set(addresses)), 4)
                self.assertEqual(len(docker.things()["containers"]), 4)
            self.check_clean(simulation)

    async def test_templates_that_are_removed_while_the_server_runs_are_said_to_be_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            templates = shutil.copytree(TEMPLATES, os.path.join(folder, "docker"))
            with server(dockerDir=templates) as simulation:
                os.unlink(os.path.join(templates, "docker-compose-default.yml"))
                async with self.visit(simulation) as browser:
                    await browser.start(world("robots"))
                    await browser.hear_all()
                    self.assertEqual(browser.told[-1], f"loading: Error: Missing docker-compose-default.yml in {templates}")


class WithoutDocker(unittest.TestCase):
    def said_at_once(self, templates=TEMPLATES, **environment):
        broken = SimulationServer(environment={**docker.environment, **environment}, docker=True, dockerDir=templates)
        with self.assertRaises(AssertionError) as ended, broken:
            pass
        return str(ended.exception)

    def test_a_daemon_that_is_not_there_ends_the_server_with_a_sentence(self):
        self.assertIn("docker: the daemon does not answer: ", self.said_at_once(DOCKER_HOST="unix:///nowhere/docker.sock"))

    def test_templates_that_are_not_there_end_the_server_with_a_sentence(self):
        self.assertIn("no simulation can start, since there is no docker-compose-default.yml in /nowhere", self.said_at_once("/nowhere"))

    def test_programs_that_are_not_there_end_the_server_with_a_sentence(self):
        self.assertIn('docker: there is no program "docker". Install Docker, or set "docker" to false.', self.said_at_once(PATH="/nowhere"))


if __name__ == "__main__":
    main()
