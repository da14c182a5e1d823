#!/usr/bin/python3
"""Simulations that the pages of websites start with `init`: from end to end, with a website in PHP, and that hostile
archives can do no harm. Protocol sections 5, 6.2 and 6.4."""

import asyncio
import io
import json
import os
import re
import shutil
import ssl
import stat
import struct
import subprocess
import sys
import tempfile
import unittest
import warnings
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.archives import zip64_of, zip_of  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.nginx import reverse_proxy  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SimulationServer, free_port, main, program, wait_until  # noqa: E402
from support.website import Website, require_php  # noqa: E402

from support import web_sockets as websockets  # noqa: E402, support.browser_client has made sure that it is there

require_php()

WORLD = "#VRML_SIM R2021b utf8\nWorldInfo {\n}\n"
USER = ["42", "Ada", "secret", "", "", "custom"]
VISITOR = [""] * 6


def certify(test, folder):
    """Files in `folder`: a self-signed certificate for localhost, and its key."""
    certificate, key = os.path.join(folder, "c.pem"), os.path.join(folder, "k.pem")
    made = subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-days", "2",
                           "-keyout", key, "-out", certificate], capture_output=True)
    if made.returncode != 0:
        test.skipTest("openssl makes no certificate (package openssl)")
    return certificate, key


class Page(Browser):
    """A page that sends `init`."""

    async def init(self, origin, user=VISITOR, project="robots", world="arena.wbt"):
        elements = ", ".join(json.dumps(each) for each in [origin, project, world, *user])
        await self.socket.send('{ "init" : [ %s ] }' % elements)

    async def last_words(self):
        """The last message before the server closes."""
        await self.hear_all()
        return self.told[-1] if self.told else ""


class WebsiteTest(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.website = cls.enterClassContext(Website())
        cls.keys = cls.enterClassContext(tempfile.TemporaryDirectory())
        with open(os.path.join(cls.keys, "localhost"), "w") as file:
            file.write(cls.website.key + "\n")
        cls.simulation = cls.enterClassContext(cls.server())

    @classmethod
    def server(cls, **config):
        return SimulationServer(**{"projectsDir": os.path.abspath(EXAMPLES), "keyDir": cls.keys, **config})

    def tearDown(self):
        self.simulation.wait_until_clean()
        self.website.set_behaviour("")

    def instance(self):
        """The files of the only running simulation, by path."""
        folder = self.simulation.instances_folder()
        (name,) = os.listdir(folder)
        return os.path.join(folder, name)

    def read(self, path):
        with open(os.path.join(self.instance(), path), "rb") as file:
            return file.read()

    def mode(self, path):
        return stat.S_IMODE(os.stat(os.path.join(self.instance(), path)).st_mode)

    async def fails(self, archive=None, user=USER, **init):
        """Starts with this archive, and returns the sentence that the browser got, alone."""
        if archive is not None:
            self.website.set_archive(archive)
        async with Page(self.simulation) as browser:
            await browser.init(init.pop("origin", self.website.origin), user, **init)
            sentence = await browser.last_words()
        self.assertEqual([message for message in browser.told if not message.startswith("loading: Receiving")], [sentence])
        self.assertTrue(sentence.startswith("loading: Error: "), sentence)
        self.simulation.wait_until_clean()
        self.assertFalse([os.path.join(folder, name) for folder, folders, files in os.walk(self.simulation.folder)
                          for name in folders + files if "evil" in name], "something was written outside of the project")
        self.assertFalse(os.path.lexists("/evil"))
        return sentence[len("loading: Error: "):]


class Starts(WebsiteTest):
    async def test_a_visitor_gets_the_template_and_the_website_is_not_asked(self):
        before = len(self.website.requests())
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin)
            await browser.hear("webots:")
            self.assertEqual(browser.told, [f"webots:ws://localhost:{self.simulation.port + 1}"])
            self.assertEqual(self.read("host.txt").decode(), self.website.origin)
            with open(os.path.join(EXAMPLES, "robots", "worlds", "arena.wbt"), "rb") as world:
                self.assertEqual(self.read("worlds/arena.wbt"), world.read())
            command = next(line for line in self.simulation.log().splitlines() if "started: " in line)
            self.assertRegex(command, r'started: ".*webots-demo-simulator --batch --mode=pause --minimize --no-rendering '
                                      r'--stream="port=%d;monitorActivity;controllerEdit" .*/worlds/arena.wbt"'
                             % (self.simulation.port + 1))
            async with websockets.connect(f"ws://localhost:{self.simulation.port + 1}/") as webots:
                await webots.send("x3d")
                self.assertTrue(await asyncio.wait_for(webots.recv(), 60))
        self.assertEqual(len(self.website.requests()), before)

    async def test_three_elements_are_enough(self):
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, user=[])
            await browser.hear("webots:")

    async def test_heartbeats_follow_once_the_simulation_runs_and_the_monitor_knows_who_is_idle(self):
        def state():
            shown = json.loads(self.simulation.get("/monitor", {"Accept": "application/json"}))["simulations"]
            return [row["state"] for row in shown if "arena.wbt" in row["world"]]

        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin)
            address = (await browser.hear("webots:"))[len("webots:"):]
            self.assertEqual(state(), ["idle"])
            async with websockets.connect(address + "/") as webots:
                await webots.send("x3d")
                await webots.send("real-time:-1")
                await asyncio.to_thread(wait_until, lambda: state() == ["running"], "it does not run")
                self.assertEqual(await browser.hear("."), ".")
                await webots.send("pause")
                await asyncio.to_thread(wait_until, lambda: state() == ["idle"], "it does not pause")

    async def test_what_a_user_has_changed_is_laid_over_the_template(self):
        self.website.set_archive({"worlds/arena.wbt": WORLD, "controllers/new/": "", "controllers/new/new.py": "print(1)\n",
                                  "controllers/binary/binary": "\x7fELF", "controllers/binary/readme.txt": "text",
                                  "protos/caf\u00e9 \u65e5.proto": "PROTO", "host.txt": "https://evil.example"})
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
            fields = self.website.requests()[-1]
            self.assertEqual(fields, {"project": "robots", "key": self.website.key, "user1Id": "42", "user1Name": "Ada",
                                      "user1Authentication": "secret", "user2Id": "", "user2Name": "", "customData": "custom"})
            self.assertEqual(self.read("worlds/arena.wbt").decode(), WORLD)
            self.assertEqual(self.read("protos/caf\u00e9 \u65e5.proto"), b"PROTO")
            self.assertEqual(self.read("controllers/avoid_walls/avoid_walls.py")[:2], b'"""'[:2])  # of the template
            self.assertEqual(self.read("host.txt").decode(), self.website.origin)
            for path in ("controllers/new/new.py", "controllers/binary/binary", "controllers/binary", "controllers",
                         "controllers/avoid_walls/avoid_walls.py"):
                self.assertEqual(self.mode(path), 0o775, path)
            for path in ("controllers/binary/readme.txt", "worlds/arena.wbt"):
                self.assertEqual(self.mode(path) & 0o111, 0, path)
            self.assertNotIn(".download", os.listdir(self.instance()))

    async def test_a_user_gets_a_controller_of_the_template_back(self):
        """A reset undoes what the user had changed."""
        controller = "controllers/avoid_walls/avoid_walls.py"
        self.website.set_archive({controller: "print('mine')\n"})
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
            self.assertEqual(self.read(controller), b"print('mine')\n")
            await browser.socket.send(json.dumps({"reset controller": "avoid_walls/avoid_walls.py"}))
            self.assertEqual(await browser.hear("reset controller:"), "reset controller: avoid_walls/avoid_walls.py")
            with open(os.path.join(EXAMPLES, "robots", controller), "rb") as original:
                self.assertEqual(self.read(controller), original.read())
            self.assertEqual(self.mode(controller) & 0o777, 0o775, "whatever the template's are")

    async def test_archives_in_large_numbers_are_taken_too(self):
        self.website.set_archive(zip64_of({"worlds/arena.wbt": WORLD, "notes.txt": "large"}))
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
            self.assertEqual(self.read("notes.txt"), b"large")

    async def test_a_user_without_changes_gets_the_template(self):
        for user in ("0", "7"):  # "0" is logged in too
            before = len(self.website.requests())
            async with Page(self.simulation) as browser:
                await browser.init(self.website.origin, [user, "", "secret", "", "", ""])
                await browser.hear("webots:")
                self.assertIn(b"WorldInfo", self.read("worlds/arena.wbt"))
            self.assertEqual([each["user1Id"] for each in self.website.requests()[before:]], [user])
            self.simulation.wait_until_clean()

    async def test_progress_of_a_slow_website_is_shown(self):
        self.website.write("big.zip", zip_of({"worlds/arena.wbt": WORLD, "noise.bin": os.urandom(3_000_000)}))
        self.website.set_behaviour('$bytes = file_get_contents("$root/big.zip"); while (ob_get_level()) ob_end_flush();'
                                   'foreach (str_split($bytes, 700000) as $piece) { echo $piece; flush(); usleep(400000); } exit;')
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
        self.assertTrue([text for text in browser.told if text.startswith("loading: Receiving objects (")], browser.told)

    async def test_a_browser_that_leaves_during_the_download_leaves_nothing(self):
        self.website.set_behaviour('echo str_repeat("x", 100000); flush(); sleep(60);')
        before = len(self.website.requests())
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await asyncio.to_thread(wait_until, lambda: len(self.website.requests()) > before, "the website is not asked")
        self.simulation.wait_until_clean()


class CommandLines(unittest.IsolatedAsyncioTestCase):
    """Configuration keys that change the command line, and the default folder of projects. Sections 6.2 and 8.2."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = folder.name
        os.symlink(program("webots-demo-simulator"), os.path.join(self.home, "webots"))
        os.makedirs(os.path.join(self.home, "projects", "samples"))
        os.symlink(os.path.abspath(EXAMPLES), os.path.join(self.home, "projects", "samples", "robotbenchmark"))

    async def stream(self, **settings):
        """The stream option of a simulation, without its port."""
        with SimulationServer(webotsHome=self.home, **settings) as simulation:
            async with Page(simulation) as browser:
                await browser.init("http://localhost")
                await browser.hear("webots:")
            simulation.wait_until_clean()
            self.assertIn(f'started: "{self.home}/webots --batch ', simulation.log())
            return re.search(r' --stream="port=\d+;(\S*)" ', simulation.log())[1]

    async def test_the_multimedia_server_is_passed_on(self):
        self.assertEqual(await self.stream(multimediaServer="media.org", multimediaStream="view"),
                         "monitorActivity;controllerEdit;multimediaServer=media.org;multimediaStream=view")

    async def test_webots_speaks_tls_where_the_server_does_and_no_proxy_speaks_it_for_both(self):
        certificate, key = certify(self, self.home)
        tls = {"sslCertificate": certificate, "sslKey": key, "ssl": True}
        self.assertEqual(await self.stream(**tls), "monitorActivity;controllerEdit;ssl")
        self.assertEqual(await self.stream(**tls, portRewrite=True), "monitorActivity;controllerEdit")


class StartsBehindAProxy(WebsiteTest):
    """As with most websites: nginx in front of PHP, and only the address of nginx is known."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.origin = cls.enterClassContext(reverse_proxy(cls.website.port))

    async def start(self, user):
        async with Page(self.simulation) as browser:
            await browser.init(self.origin, user)
            await browser.hear("webots:")
            self.assertEqual(self.read("host.txt").decode(), self.origin)
            return self.read("worlds/arena.wbt")

    async def test_what_a_user_has_changed_arrives(self):
        self.website.set_archive({"worlds/arena.wbt": WORLD, "noise.bin": os.urandom(300_000).hex()})
        self.assertEqual((await self.start(USER)).decode(), WORLD)
        self.assertEqual(self.website.requests()[-1]["user1Authentication"], "secret")

    async def test_who_has_changed_nothing_gets_the_template(self):
        self.assertNotEqual((await self.start(["7", *USER[1:]])).decode(), WORLD)

    async def test_a_website_that_is_down_behind_its_proxy_is_told(self):
        self.website.set_behaviour("http_response_code(503); exit;")
        self.assertEqual(await self.fails(origin=self.origin),
                         "Failed to download project: localhost answered with status 503.")


class Refusals(WebsiteTest):
    async def test_a_website_without_a_key_is_sent_nothing(self):
        asked = []

        async def note(reader, writer):
            asked.append(await reader.read(100))
            writer.close()

        stranger = await asyncio.start_server(note, "127.0.0.1", 0)
        port = stranger.sockets[0].getsockname()[1]
        sentence = await self.fails(origin=f"http://127.0.0.1:{port}")
        self.assertEqual(sentence, "This simulation server has no key for 127.0.0.1: its operator must file one before users of "
                                   "that website can start simulations.")
        async with Page(self.simulation) as browser:  # visitors need none
            await browser.init(f"http://127.0.0.1:{port}")
            await browser.hear("webots:")
            self.assertIn("No key for: 127.0.0.1", self.simulation.log())
        stranger.close()
        self.assertEqual(asked, [])

    async def test_a_folder_of_keys_that_was_replaced_is_told(self):
        with tempfile.TemporaryDirectory() as folder:
            keys = os.path.join(folder, "keys")
            shutil.copytree(self.keys, keys)
            with self.server(keyDir=keys) as simulation:
                if "Landlock" not in simulation.log():
                    self.skipTest("this kernel has no Landlock: the server would read the new folder")
                os.rename(keys, keys + ".old")
                shutil.copytree(self.keys, keys)
                async with Page(simulation) as browser:
                    await browser.init(self.website.origin, USER)
                    self.assertRegex(await browser.last_words(), "can't read the key .* restart it")

    async def test_a_certificate_that_nobody_vouches_for_is_refused_and_the_key_stays_here(self):
        with tempfile.TemporaryDirectory() as folder:
            certificate, key = certify(self, folder)
            tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            tls.load_cert_chain(certificate, key)
        asked = []

        async def note(reader, writer):
            asked.append(await reader.read(100))
            writer.close()

        impostor = await asyncio.start_server(note, "localhost", 0, ssl=tls)
        sentence = await self.fails(origin=f"https://localhost:{impostor.sockets[0].getsockname()[1]}")
        impostor.close()
        self.assertIn("Failed to download project from localhost: ", sentence)
        self.assertIn("certificate", sentence)
        self.assertEqual(asked, [])

    async def test_a_wrong_key_is_told_in_the_websites_words(self):
        self.website.write("key", "another")
        self.addCleanup(self.website.write, "key", self.website.key)
        self.assertEqual(await self.fails(), "Failed to download project: Wrong key.")

    async def test_messages_that_lead_elsewhere_are_refused(self):
        for change in ({"project": "../robots"}, {"project": "/etc"}, {"project": ""}, {"world": "../arena.wbt"},
                       {"origin": "http://localhost/../x"}, {"origin": "file:///etc"}, {"origin": "http://../.."}):
            with self.subTest(change):
                self.assertTrue((await self.fails(**change)).startswith("Wrong message: "))

    async def test_projects_and_worlds_that_are_not_there(self):
        self.assertEqual(await self.fails(user=VISITOR, project="nothing"), 'There is no project "nothing" on this server.')
        self.assertEqual(await self.fails(user=VISITOR, world="nothing.wbt"), "nothing.wbt does not exist.")

    async def test_a_full_disk_is_told_and_the_next_start_has_room_again(self):
        instances = self.simulation.instances_folder()
        self.simulation.stop()
        self.addCleanup(self.simulation.start)
        mount_small_disk(self, instances, "16k")
        self.addCleanup(self.simulation.stop)
        self.simulation.start()  # which is confined to the folders that it has found
        self.assertEqual(await self.fails(user=VISITOR), "This server can't copy the project: No space left on device.")
        subprocess.run(["mount", "-o", "remount,size=16m", instances], check=True)
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin)
            await browser.hear("webots:")

    async def test_websites_that_misbehave(self):
        host = "Failed to download project from localhost: "
        dead = free_port()
        self.assertTrue((await self.fails(origin=f"http://localhost:{dead}")).startswith(host))
        for code, sentence in (
                ("http_response_code(500); die('x');", "Failed to download project: localhost answered with status 500."),
                ("header('Location: http://127.0.0.1:9/', true, 307); exit;", host + "the website redirects to another host."),
                ("header('Location: ' . $_SERVER['REQUEST_URI'], true, 307); exit;", host + "the website redirects in circles."),
                ("exit;", "Bad ZIP file: it has no end, or is something else."),
                ("die('<html>Hello</html>');", "Bad ZIP file: it has no end, or is something else."),
                ("die('Error: <b>\\x1b[2Jno</b>');", "Failed to download project: <b>\\x1b[2Jno</b>")):
            with self.subTest(code):
                self.website.set_behaviour(code.replace("\\x1b", "\x1b"))
                self.assertEqual(await self.fails(), sentence)


def entry(name, content=b"evil", mode=stat.S_IFREG | 0o644):
    info = zipfile.ZipInfo(name)
    info.create_system = 3
    info.external_attr = mode << 16
    return info, content


def raw_zip(*entries):
    content = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about names that occur twice
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
            for info, data in entries:
                archive.writestr(info, data, zipfile.ZIP_DEFLATED)
    return content.getvalue()


class HostileArchives(WebsiteTest):
    async def test_names_that_could_do_harm_are_left_out_and_the_author_is_told(self):
        names = {"../evil": "..", "worlds/../../evil": "worlds/..", "/evil": "", ".": ".", "a/./evil": "a/.", "b//evil": "b/",
                 ".git/evil": ".git", ".git/objects/evil": ".git", "protos/.GIT./evil": "protos/.GIT.", "git~1": "git~1",
                 "a" * 300: "a" * 200 + "..."}
        self.website.set_archive(raw_zip(entry(".git/link", b"/etc/passwd", stat.S_IFLNK | 0o777), *map(entry, names),
                                         entry("..\\evil"), entry("worlds/arena.wbt", WORLD.encode())))
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
            told = [text.split('"')[1] for text in browser.told if text.startswith("stderr:") and "is left out: its name" in text]
            self.assertEqual(sorted(told), sorted({*names.values(), ".."}))
            self.assertEqual(self.read("worlds/arena.wbt").decode(), WORLD)
            found = [os.path.join(folder, name) for folder, folders, files in os.walk(self.simulation.folder) for name in folders + files]
            self.assertEqual([path for path in found if "evil" in path or "git" in os.path.basename(path).lower()], [])
        self.assertFalse(os.path.lexists("/evil"))

    async def test_long_and_deep_paths_are_refused(self):
        self.assertIn("nested too deeply", await self.fails(raw_zip(entry("a/" * 100 + "evil"))))
        self.assertIn("path is too long", await self.fails(raw_zip(entry(("a" * 250 + "/") * 5 + "evil"))))

    async def test_links_and_devices_are_refused(self):
        for kind, what in ((stat.S_IFLNK, "a link"), (stat.S_IFCHR, "a device or pipe"), (stat.S_IFBLK, "a device or pipe"),
                           (stat.S_IFSOCK, "a device or pipe")):
            with self.subTest(oct(kind)):
                sentence = await self.fails(raw_zip(entry("evil", b"/etc/passwd", kind | 0o777), entry("evil/x")))
                self.assertEqual(sentence, f'The project has {what}, which is not allowed: "evil".')

    async def test_one_name_twice_is_refused(self):
        self.assertIn("two files with one name", await self.fails(raw_zip(entry("a"), entry("a"))))
        self.assertIn("a file and a folder with one name", await self.fails(raw_zip(entry("a"), entry("a/b"))))
        self.assertIn("a file and a folder with one name", await self.fails(raw_zip(entry("worlds"))))

    async def test_names_that_differ_in_case_are_different_files(self):
        self.website.set_archive({"worlds/arena.wbt": WORLD, "A": "A", "a": "a"})
        async with Page(self.simulation) as browser:
            await browser.init(self.website.origin, USER)
            await browser.hear("webots:")
            self.assertEqual((self.read("A"), self.read("a")), (b"A", b"a"))

    async def test_names_that_differ_in_unicode_composition_are_one_name(self):
        self.assertIn("two files with one name", await self.fails(raw_zip(entry("caf\u00e9"), entry("cafe\u0301"))))

    async def test_bombs_end_at_the_limit(self):
        bomb = io.BytesIO()
        with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            with archive.open("evil.bin", "w") as file:
                for _ in range(100):
                    file.write(bytes(1_000_000))
        self.assertEqual(await self.fails(bomb.getvalue()),
                         f"The project's archive grows to more than {max(64 << 20, 200 * len(bomb.getvalue())) >> 20} MB, which is "
                         "suspicious.")

    async def test_sizes_that_lie_do_not_matter(self):
        content = bytearray(raw_zip(entry("evil.bin", bytes(80_000_000))))
        central = content.rindex(b"PK\1\2")
        struct.pack_into("<I", content, central + 24, 10)  # the size unpacked
        struct.pack_into("<I", content, 22, 10)
        self.assertRegex(await self.fails(bytes(content)), "^(Bad ZIP file|The project's archive grows)")

    async def test_too_many_entries(self):
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
            for i in range(50_001):
                archive.writestr(f"{i:x}", b"")
        self.assertEqual(await self.fails(content.getvalue()), "The project has more than 50000 files.")

    async def test_folders_count_that_the_archive_does_not_name(self):
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
            for i in range(5000):  # files, in 11 folders each
                archive.writestr(f"{i:x}/" + "d/" * 10 + "f", b"")
        self.assertEqual(await self.fails(content.getvalue()), "The project has more than 50000 files.")

    async def test_archives_that_are_damaged(self):
        good = raw_zip(entry("worlds/arena.wbt", WORLD.encode()), entry("noise", os.urandom(10_000)))
        for what, content in (("nothing", b""), ("text", b"hello"), ("truncated", good[:-30]), ("half", good[:len(good) // 2]),
                              ("a hole", good[:200] + bytes(1000) + good[1200:]), ("tar", b"x" * 257 + b"ustar" + bytes(2000)),
                              ("something in front", b"#!/bin/sh\n" + good), ("something behind", good + bytes(100_000))):
            with self.subTest(what):
                self.assertTrue((await self.fails(content)).startswith("Bad ZIP file: "), what)

    async def test_archives_that_are_encrypted(self):
        content = bytearray(raw_zip(entry("evil")))
        content[6] |= 1
        content[content.rindex(b"PK\1\2") + 8] |= 1
        self.assertIn("an encrypted file", await self.fails(bytes(content)))

    async def test_unusual_compressions_are_refused(self):
        for method in (zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2):
            content = io.BytesIO()
            with zipfile.ZipFile(content, "w", method) as archive:
                archive.writestr("evil", b"evil" * 1000)
            self.assertIn("unusual compression", await self.fails(content.getvalue()))


if __name__ == "__main__":
    main()
