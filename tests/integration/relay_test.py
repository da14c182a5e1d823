#!/usr/bin/python3
"""A session server that takes /client itself and relays it to its machines: real servers and the demo simulator, and machines that
misbehave. Protocol sections 2, 4.1 and 13.16."""

import asyncio
import os
import re
import secrets
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from session_gateway_test import Site  # noqa: E402
from support.browser_client import LOCAL, WORLD, server, websockets  # noqa: E402
from support.certificates import Authority  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402
from support.visitor import StrangeMachine, Visitor, hang, says  # noqa: E402

ENDED = "loading: Error: This simulation has ended."
SELDOM = 600  # seconds between two polls: the session server knows what it was told at the start


def comparable(told):
    """What a start is told, without what differs from one to the next, says that somebody is alive, or only shows that one has to wait."""
    return [re.sub(r"(?<=reconnectToken: ).*|(?<=:)\d+$", "<any>", text) for text in told
            if text != "." and not re.match(r"queue:|loading: (?!Error: |Cloning)", text)]


class Relay(unittest.IsolatedAsyncioTestCase):
    def machine(self, **settings):
        return self.enterContext(server(**settings))

    async def strange(self, behave, **settings):
        return await self.enterAsyncContext(StrangeMachine(behave, **settings))

    async def session(self, *entries, **settings):
        session = SessionServer(list(entries), **{"relay": True, **settings})
        self.addCleanup(session.close)
        await asyncio.to_thread(session.start)
        await asyncio.to_thread(wait_until, lambda: f'webots_servers{{state="up"}} {len(entries)}\n' in session.get("/metrics"),
                                lambda: f"all machines have answered:\n{session.log()}")
        return session

    async def visitor(self, session, **more):
        return await self.enterAsyncContext(Visitor(session, **more))

    async def is_running(self, address, mode="mjpeg: 320x240"):
        """Makes sure that there is a simulation at this `webots:` address."""
        async with websockets.connect(address.removeprefix("webots:") + "/") as viewer:
            await viewer.send(mode)
            self.assertTrue(await asyncio.wait_for(viewer.recv(), 100))


class Happy(Relay):
    @classmethod
    def setUpClass(cls):
        """A site that tests share where they change nothing: in its first moments a session server has newcomers wait for those who return."""
        cls.site_machine = cls.enterClassContext(server(extendable=600, projectsDir=os.path.abspath(EXAMPLES)))
        cls.site = cls.enterClassContext(SessionServer([cls.site_machine.address], relay=True))

    async def test_a_browser_of_today_is_told_what_the_machine_itself_tells(self):
        machine, session = self.site_machine, self.site
        direct = await self.visitor(machine)
        await direct.open(f"ws://{machine.address}")
        await direct.say(start={"url": WORLD, "mode": "mjpeg"})
        await direct.hear("webots:")
        await direct.leave()
        await asyncio.to_thread(machine.wait_until_clean)

        browser = await self.visitor(session)
        self.assertEqual(await browser.ask(), f"ws://{session.address}")
        await browser.start()
        address = await browser.hear("webots:")
        self.assertEqual(comparable(browser.told), comparable(direct.told))
        await self.is_running(address)
        await browser.leave()
        await asyncio.to_thread(machine.wait_until_clean)

    async def test_who_asks_for_more_is_told_more_in_the_documented_order(self):
        machine = self.site_machine
        wishes = {"reconnect": True, "heartbeat": True, "extend": True}
        direct = await self.visitor(machine)
        await direct.open(f"ws://{machine.address}")
        await direct.say(start={"url": WORLD, "mode": "mjpeg", **wishes})
        await direct.hear("reconnectToken:")
        await direct.leave()
        browser = await self.visitor(self.site)
        await browser.start(**wishes)
        await browser.hear("reconnectToken:")
        self.assertEqual(comparable(browser.told), comparable(direct.told))
        self.assertEqual(comparable(browser.told)[0], "heartbeat: 1")
        beats = browser.told.count(".")
        await browser.hear(".", since=len(browser.told))
        self.assertGreater(browser.told.count("."), beats)

    async def test_controllers_are_reset_and_simulations_extended_through_it(self):
        browser = await self.visitor(self.site)
        await browser.start(extend=True)
        await browser.hear("webots:")
        await browser.say(**{"reset controller": "avoid_walls/avoid_walls.py"})
        await browser.hear("reset controller: avoid_walls/avoid_walls.py")
        told = len(browser.told)
        await browser.say(extend=100)
        await browser.hear("shutdownTimeout: ", since=told)
        self.assertEqual(await browser.hear("extendable: ", since=told), "extendable: 500")
        await browser.say(extend=0)
        await browser.hear("loading: Error: Wrong message: ")
        self.assertIsNone(browser.close_code, "a mistake after the start ends nothing")

    async def test_who_leaves_leaves_a_free_seat(self):
        machine = self.machine(maxConnections=1)
        session = await self.session(machine.address)
        for _ in range(3):
            async with Visitor(session) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(browser.errors(), [])
        await asyncio.to_thread(machine.wait_until_clean)

    async def test_asking_where_to_go_reserves_nothing(self):
        machine = self.machine(maxConnections=1)
        session = await self.session(machine.address, loadRefresh=SELDOM)
        answers = await asyncio.to_thread(lambda: {session.get("/session") for _ in range(100)})
        self.assertEqual(answers, {f"ws://{session.address}"})
        self.assertEqual(session.get("/"), "1")
        async with websockets.connect(f"ws://{session.address}/session") as socket:
            self.assertEqual(await socket.recv(), f"ws://{session.address}")
        browser = await self.visitor(session)
        await browser.start()
        await browser.hear("webots:")

    async def test_init_is_relayed_too(self):
        page = await self.visitor(self.site)
        await page.open(await page.ask())
        await page.say(init=["https://example.org", "robots", "arena.wbt", *[""] * 6])
        await self.is_running(await page.hear("webots:"), "x3d")
        self.assertEqual(len(comparable(page.told)), 1, page.told)

    async def test_a_start_that_is_at_fault_is_refused_once_in_the_machines_words(self):
        machines = [self.machine(), self.machine()]
        session = await self.session(*(each.address for each in machines))
        browser = await self.visitor(session)
        await browser.start(url=WORLD.replace("arena", "nowhere"))
        await browser.hear_end()
        self.assertEqual(comparable(browser.told), ["loading: Error: nowhere.wbt does not exist."])
        asked = [line for machine in machines for line in machine.log().splitlines() if "New client" in line]
        self.assertEqual(len(asked), 1, asked)

    async def test_without_relay_browsers_go_to_the_machine_as_ever(self):
        machine = self.machine()
        session = await self.session(machine.address, relay=False)
        browser = await self.visitor(session)
        self.assertEqual(await browser.ask(), f"ws://{machine.address}")
        await browser.start()
        await browser.hear("webots:")
        with self.assertRaises(websockets.InvalidStatusCode) as refused:
            await websockets.connect(f"ws://{session.address}/client")
        self.assertEqual(refused.exception.status_code, 404)

    async def test_with_a_secret_the_session_server_has_the_tickets(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        file = os.path.join(folder, "secret")
        with open(os.open(file, os.O_WRONLY | os.O_CREAT, 0o600), "w") as secret:
            secret.write(secrets.token_hex(32))
        machine = self.machine(sessionSecret=file)
        session = await self.session(machine.address, sessionSecret=file)
        for _ in range(2):
            browser = await self.visitor(session)
            await browser.start()
            await browser.hear("webots:")
        stranger = await self.visitor(machine)
        await stranger.open(f"ws://{machine.address}")
        await stranger.say(start={"url": WORLD})
        self.assertIn("start through its session server", await stranger.hear("loading: Error: "))


class OverTls(Site):
    async def test_a_browser_comes_by_tls_and_so_does_the_session_server(self):
        authority = Authority(self.folder, "machines")
        certificate, key = authority.issue("machine", "DNS:localhost", "IP:127.0.0.1")
        machine = self.machine(sslCertificate=certificate, sslKey=key, hostNames=["localhost"])
        session = self.session({"address": f"{self.host}/{machine.port}", "internal": f"https://localhost:{machine.port}"}, relay=True,
                               caFile=authority.certificate)
        self.assertEqual(session.get("/session"), f"wss://{self.host}")
        await self.visit("mjpeg", f"wss://{self.host}")


class Machines(Relay):
    """What the browser does not notice of its machines."""

    async def is_served(self, session, **more):
        """A visitor that gets its simulation, and hears of no error on the way."""
        browser = await self.visitor(session, **more)
        await browser.start()
        address = await browser.hear("webots:")
        self.assertEqual(browser.errors(), [])
        self.assertIsNone(browser.find("refusal:"), "that is between servers")
        return browser, address

    @staticmethod
    def preferred(machine):
        """An entry of a machine that browsers are sent to whatever its load: that of this computer has no part in what is tested."""
        return {"address": machine.address, "weight": 1_000_000}

    async def served_after(self, session, machine, word):
        """A visitor that this machine refuses, whose log then has the word, and that is served elsewhere."""
        browser, _ = await self.is_served(session)
        self.assertIn(word, machine.log())
        await browser.hear("loading: Trying another machine.")

    async def test_one_that_drains_sends_browsers_on(self):
        draining, good = self.machine(), self.machine()
        session = await self.session(self.preferred(draining), good.address, loadRefresh=SELDOM)
        await self.is_served(session)  # after that nobody waits, and no machine is asked again
        self.assertEqual(draining.command("--drain")[0], 0)
        await self.served_after(session, draining, "is about to stop")

    async def test_one_that_is_full_sends_browsers_on(self):
        full, good = self.machine(maxConnections=2), self.machine()
        session = await self.session(self.preferred(full), good.address, loadRefresh=SELDOM)
        await self.is_served(session)  # after that nobody waits, and no machine is asked again
        other = await self.visitor(full)  # takes the second seat, of which the session server does not know
        await other.open(f"ws://{full.address}")
        await other.say(start={"url": WORLD})
        await other.hear("webots:")
        await self.served_after(session, full, "is full")

    async def test_one_that_lacks_a_label_sends_browsers_to_one_that_has_it(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        project = shutil.copytree(os.path.join(EXAMPLES, "robots"), os.path.join(folder, "owner", "robots"))
        with open(os.path.join(project, "webots.yml"), "a") as settings:
            settings.write("labels: gpu\n")
        local = {"forges": [{"url": "local:", "directory": folder}], "allowedRepositories": ["local:/owner"]}
        plain, able = self.machine(**local), self.machine(labels=["gpu"], **local)
        session = await self.session(plain.address, able.address)
        url = "local:/owner/robots/blob/main/worlds/arena.wbt"
        for number in range(4):
            browser = await self.visitor(session, client=f"192.0.2.{number + 1}")
            await browser.start(url=url)
            address = await browser.hear("webots:")
            self.assertEqual(browser.errors(), [])
            self.assertRegex(address, rf"localhost:({'|'.join(str(able.port + n) for n in range(1, 9))})$")
        direct = await self.visitor(plain)
        await direct.open(f"ws://{plain.address}")
        await direct.say(start={"url": url})
        self.assertIn("it lacks what webots.yml asks for: gpu.", await direct.hear("loading: "))

    async def test_one_that_is_gone_is_not_missed(self):
        good = self.machine()
        gone = StrangeMachine(hang)
        async with gone:
            session = await self.session(gone.address, good.address, loadRefresh=SELDOM)
        for _ in range(4):
            await self.is_served(session)

    async def test_one_that_accepts_and_hangs_holds_up_one_browser_at_a_time(self):
        good = self.machine()
        hanging = await self.strange(hang)
        session = await self.session(hanging.address, good.address)
        browsers = [await self.is_served(session) for _ in range(6)]
        self.assertTrue(hanging.requests, "it was tried")
        # A pause of 10 s and more follows each vain attempt, in which the others are served.
        self.assertLess(len(hanging.requests), len(browsers))

    async def test_one_that_closes_without_a_word_is_not_noticed(self):
        good = self.machine()
        silent = await self.strange(says())
        session = await self.session(silent.address, good.address)
        for _ in range(3):
            await self.is_served(session)
        self.assertTrue(silent.requests, "it was tried")

    async def test_one_that_refuses_everybody_is_soon_asked_last(self):
        good = self.machine()
        refusing = await self.strange(says("refusal: machine", "loading: Error: Not today."))
        session = await self.session(refusing.address, good.address)
        for number in range(8):
            await self.is_served(session, client=f"192.0.2.{number + 1}")
        self.assertTrue(refusing.requests, "it was tried")
        self.assertLess(len(refusing.requests), 8, "those who come later pay nothing for it")

    async def test_where_all_refuse_the_last_word_is_told(self):
        machines = [await self.strange(says("refusal: machine", "loading: Error: Not today.")) for _ in range(5)]
        session = await self.session(*(each.address for each in machines))
        browser = await self.visitor(session)
        await browser.start()
        await browser.hear_end()
        self.assertEqual(browser.errors(), ["loading: Error: Not today."])
        self.assertEqual(sum(len(each.requests) for each in machines), 3)

    async def test_a_python_server_serves_and_refuses_in_its_own_words(self):
        good = self.machine()
        told = ["loading: Cloning", "shutdownTimeout: 7200", "webots:ws://python.example.org:2001"]
        python = await self.strange(says(*told, stays=True), load=StrangeMachine.PYTHON)
        session = await self.session(python.address, good.address)
        while not python.requests:  # the other one may have been chosen
            browser, _ = await self.is_served(session)
        self.assertEqual(comparable(browser.told), comparable(told))
        (start,) = python.requests
        self.assertEqual((start["start"]["url"], start["start"]["mode"]), (WORLD, "mjpeg"))
        await browser.leave()
        python.behave = says("loading: Error: Cannot share idle time when current load is above threshold: 70.")
        while len(python.requests) < 2:
            await self.is_served(session)

    async def test_a_machine_is_told_for_whom_it_is_asked(self):
        machine = await self.strange(says("heartbeat: 1", "webots:ws://machine.example.org:2001", stays=True))
        session = await self.session(machine.address)
        browser, _ = await self.is_served(session, client="192.0.2.7")
        self.assertEqual(comparable(browser.told), ["webots:ws://machine.example.org:<any>"], "it did not ask for heartbeats")
        self.assertEqual(machine.requests[0]["start"], {"url": WORLD, "mode": "mjpeg", "relayed": True, "heartbeat": True})
        self.assertEqual(machine.headers[0]["X-Forwarded-For"], "192.0.2.7")
        self.assertEqual(machine.headers[0]["Host"], machine.address)
        self.assertNotIn("Origin", machine.headers[0])

    async def test_how_either_side_ends_reaches_the_other(self):
        ready = "webots:ws://machine.example.org:2001"

        async def takes_over(socket, _):
            await socket.send(ready)
            await socket.close(4001, "taken over")

        machine = await self.strange(says(ready, stays=True))
        session = await self.session(machine.address)
        for end, seen in ((Visitor.leave, 1000), (lambda browser: browser.leave(1001), 1001), (lambda browser: browser.leave(4242), 4242),
                          (Visitor.vanish, 1006)):
            machine.close_codes.clear()
            browser, _ = await self.is_served(session)
            await end(browser)
            await asyncio.to_thread(wait_until, lambda: machine.close_codes, f"the machine hears of the end with {seen}")
            self.assertEqual(machine.close_codes, [seen])
        machine.behave = takes_over
        browser, _ = await self.is_served(session)
        self.assertEqual(await browser.hear_end(), 4001)


class Returns(Relay):
    async def lost(self, session, **more):
        """A browser that runs a simulation and says that it returns: with its `webots:` and its token."""
        browser = await self.visitor(session)
        await browser.start(reconnect=True, **more)
        address = await browser.hear("webots:")
        token = (await browser.hear("reconnectToken: ")).removeprefix("reconnectToken: ")
        return browser, address, token

    async def test_who_loses_the_connection_finds_the_simulation_again(self):
        machines = [self.machine(), self.machine()]
        session = await self.session(*(each.address for each in machines))
        for _ in range(2):
            browser, address, token = await self.lost(session)
            self.assertIn(token.partition("@")[2], [each.address for each in machines])
            await browser.vanish()
            told = len(browser.told)
            await browser.come_back(reconnect=token)
            self.assertEqual(await browser.hear("webots:", since=told), address)
            self.assertEqual(await browser.hear("reconnectToken: ", since=told), f"reconnectToken: {token}")
            await self.is_running(address)

    async def test_the_goodbye_of_a_proxy_that_reloads_is_not_that_of_the_visitor(self):
        machine = self.machine()
        session = await self.session(machine.address)
        browser, address, token = await self.lost(session)
        simulators = set(machine.simulators())
        browser.socket.transport.write(b"\x88\x02\x03\xe9")  # as Caddy: 1001, not masked, and the end
        browser.socket.transport.close()
        await asyncio.to_thread(wait_until, lambda: "it may return for 30.0 s" in machine.log(), machine.log)
        self.assertEqual(await browser.find_again(token), address)
        self.assertEqual(set(machine.simulators()), simulators, "nothing was started anew")
        await browser.leave()
        await asyncio.to_thread(machine.wait_until_clean)

    async def test_it_is_found_over_a_restart_of_the_session_server(self):
        machine = self.machine()
        session = await self.session(machine.address)
        browser, address, token = await self.lost(session)
        simulators = set(machine.simulators())
        self.assertEqual(await asyncio.to_thread(session.stop), 0)
        self.assertEqual(await browser.hear_end(), 1012)
        await asyncio.to_thread(session.start)
        self.assertEqual(await browser.find_again(token), address)
        self.assertEqual(set(machine.simulators()), simulators, "nothing was started anew")
        await browser.leave()
        await asyncio.to_thread(machine.wait_until_clean)

    async def test_it_is_found_when_the_session_server_is_killed(self):
        machine = self.machine()
        session = await self.session(machine.address)
        browser, address, token = await self.lost(session)
        session.process.kill()
        session.process.wait()
        await browser.hear_end()
        await asyncio.to_thread(session.start)
        self.assertEqual(await browser.find_again(token), address)

    async def test_a_token_leads_to_machines_of_the_list_alone(self):
        machine = self.machine()
        stranger = await self.strange(says("webots:ws://evil.example.org:1"))
        session = await self.session(machine.address)
        _, _, token = await self.lost(session)
        secret = token.partition("@")[0]
        for wrong in (f"{secret}@{stranger.address}", f"{secret}@{stranger.address}/client", f"{secret}@localhost:{free_port()}", secret,
                      f"{'0' * len(secret)}@{machine.address}", f"@{machine.address}", "@", "", f"{token}@{stranger.address}",
                      f"{secret}@{machine.address}@{stranger.address}", f"{secret}@ws://{stranger.address}", f"{secret}@{machine.address}\r\nx"):
            with self.subTest(wrong):
                thief = await self.visitor(session)
                await thief.come_back(reconnect=wrong)
                await thief.hear_end()
                self.assertEqual(len(thief.errors()), 1, thief.told)
                self.assertTrue(thief.errors()[0].startswith(ENDED), thief.told)
        self.assertEqual(stranger.connections, 0)


if __name__ == "__main__":
    main()
