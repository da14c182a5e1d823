#!/usr/bin/python3
"""The example of a website that starts simulations: what its scripts answer (protocol sections 5.3 and 5.4), and that hostile
requests can do no harm."""

import concurrent.futures
import io
import json
import os
import re
import socket
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SimulationServer, main, program  # noqa: E402
from support.website_host import ADA, BOB, DOWNLOAD, SOURCE, UPLOAD, WebsiteHost, multipart  # noqa: E402

CONTROLLERS = "robots/controllers/avoid_walls"


def at_once(ask, questions):
    """The answers to all questions: whoever guesses waits for a second."""
    with concurrent.futures.ThreadPoolExecutor(len(questions)) as threads:
        return list(threads.map(ask, questions))


class WebsiteHostTest(unittest.TestCase):
    """One website for all; what users have saved is removed between tests."""

    @classmethod
    def setUpClass(cls):
        cls.website = cls.enterClassContext(WebsiteHost())
        cls.ada, cls.ada_token = cls.website.sign_in(ADA)
        cls.bob, cls.bob_token = cls.website.sign_in(BOB)

    def setUp(self):
        folder = os.path.join(self.website.folder, "user")  # the website may open this folder alone, not another one of that name
        for user in os.listdir(folder):
            shutil.rmtree(os.path.join(folder, user))

    def fields(self, **more):
        return {"project": "robots", "key": self.website.key, "user1Id": "42", "user1Authentication": self.ada_token, **more}

    def said(self, path, fields, **headers):
        status, answer, body = self.website.post(path, fields, **headers)
        self.assertEqual(answer["X-Robots-Tag"], "noindex")
        return body.decode() if status == 200 else f"{status} {body.decode()}"


class Download(WebsiteHostTest):
    def test_each_missing_field_is_named_in_the_documented_order(self):
        fields = {}
        for name in ("user1Id", "user1Authentication", "key", "project"):
            self.assertEqual(self.said(DOWNLOAD, fields), f"Error: Missing {name}.")
            fields[name] = self.fields()[name]
        for method in ("GET", "POST"):
            self.assertEqual(self.website.ask(method, DOWNLOAD)[2], b"Error: Missing user1Id.")

    def test_what_the_user_has_saved_comes_as_a_zip_file_with_the_documented_headers(self):
        self.assertEqual(self.said(DOWNLOAD, self.fields()), "Error: no such directory: 'user/42/projects/robots'.")
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", "CRUISE = 1\n"), "OK")
        status, headers, body = self.website.post(DOWNLOAD, self.fields(user1Name="Ada", user2Id="", user2Name="", customData="x"))
        self.assertEqual(status, 200)
        self.assertEqual({name: headers[name] for name in ("Content-Type", "Content-disposition", "Content-Length", "X-Robots-Tag")},
                         {"Content-Type": "application/zip", "Content-disposition": "attachment; filename=robots.zip",
                          "Content-Length": str(len(body)), "X-Robots-Tag": "noindex"})
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            self.assertEqual(archive.namelist(), ["controllers/avoid_walls/avoid_walls.py"])
            self.assertEqual(archive.read("controllers/avoid_walls/avoid_walls.py"), b"CRUISE = 1\n")
        for other in (self.fields(project="patrol"), self.fields(user1Id="7", user1Authentication=self.bob_token)):
            self.assertTrue(self.said(DOWNLOAD, other).startswith("Error: no such directory: "))

    def test_a_wrong_key_is_refused_also_if_it_is_nearly_right(self):
        keys = ["guess", "", self.website.key[:-1], self.website.key + "x"]
        self.assertEqual(at_once(lambda key: self.said(DOWNLOAD, self.fields(key=key)), keys), ["Error: Wrong key."] * 4)

    def test_projects_that_are_paths_are_refused(self):
        self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", "x")
        for project in ("robots/controllers", "..", "../../7/projects/robots", "/", "", ".", ".ssh", "a\0b", "a\\b", "a\r\nb", "é", "x" * 101):
            self.assertEqual(self.said(DOWNLOAD, self.fields(project=project)), "Error: Wrong project.", project)

    def test_nobody_gets_the_project_of_another_user(self):
        self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", "x")
        attempts = [("42", self.bob_token), ("42", ""), ("7", self.ada_token), ("1", "x"), ("42/../7", self.bob_token), ("", ""),
                    ("042", self.ada_token)]
        answers = at_once(lambda user: self.said(DOWNLOAD, self.fields(user1Id=user[0], user1Authentication=user[1])), attempts)
        self.assertEqual(set(answers), {"Error: Wrong user1Authentication: please sign in again."})


class Upload(WebsiteHostTest):
    def test_missing_cookies_and_fields_are_named_in_the_documented_order(self):
        fields = {}
        self.assertEqual(self.said(UPLOAD, fields), "Error: Missing email cookie.")
        self.assertEqual(self.said(UPLOAD, fields, Cookie="email=ada%40example.org"), "Error: Missing password cookie.")
        for name, value in (("dirname", CONTROLLERS), ("filename", "a.py"), ("content", "x")):
            self.assertEqual(self.said(UPLOAD, fields, Cookie=self.ada), f"Error: missing {name}.")
            fields[name] = value
        self.assertEqual(self.said(UPLOAD, fields, Cookie=self.ada), "OK")
        self.assertEqual(self.website.ask("POST", UPLOAD)[2], b"Error: Missing email cookie.")

    def test_a_file_is_stored_byte_for_byte_in_the_documented_place(self):
        content = b'print("caf\xc3\xa9")\r\n--\r\n------WebKitFormBoundary\r\n\0\xff' * 1000
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", content), "OK")
        with open(self.website.path(ADA, CONTROLLERS + "/avoid_walls.py"), "rb") as file:
            self.assertEqual(file.read(), content)
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", b""), "OK")
        self.assertEqual(os.path.getsize(self.website.path(ADA, CONTROLLERS + "/avoid_walls.py")), 0)
        self.assertEqual(os.listdir(self.website.path(ADA, CONTROLLERS)), ["avoid_walls.py"])

    def test_names_that_lead_elsewhere_are_refused_and_nothing_is_written(self):
        for name in ("a/b.py", "/etc/passwd", "..", ".", "", ".htaccess", "a\0.py", "a\\b", "a\nb"):
            self.assertEqual(self.website.save(self.ada, CONTROLLERS, name, "x"), "Error: wrong filename.", name)
        for name in ("..", "robots/../../7/projects/robots", "../x", "/robots", "robots//x", "robots/", "", "unknown", "robots/.git",
                     "robots/a\\..\\b", "robots/" + "x/" * 20 + "x"):
            self.assertEqual(self.website.save(self.ada, name, "a.py", "x"), "Error: wrong dirname.", name)
        self.assertEqual(os.listdir(os.path.join(self.website.folder, "user")), [])

    def test_links_lead_nobody_out_of_the_folder(self):
        outside = self.enterContext(tempfile.TemporaryDirectory())
        self.website.save(self.ada, CONTROLLERS, "avoid_walls.py", "x")
        os.symlink(outside, self.website.path(ADA, "robots/controllers/link"))
        os.symlink("/etc/passwd", self.website.path(ADA, CONTROLLERS + "/passwd.py"))
        self.assertTrue(self.website.save(self.ada, "robots/controllers/link", "a.py", "x").startswith("Error: "))
        self.assertEqual(os.listdir(outside), [])
        with zipfile.ZipFile(io.BytesIO(self.website.post(DOWNLOAD, self.fields())[2])) as archive:
            self.assertEqual(archive.namelist(), ["controllers/avoid_walls/avoid_walls.py"])

    def test_who_has_no_password_saves_nothing(self):
        attempts = ["email=ada%40example.org; password=x", self.ada.replace("ada", "bob"), f"email=; password={self.ada_token}",
                    "email=ada%40example.org; password="]
        answers = at_once(lambda cookies: self.website.save(cookies, CONTROLLERS, "a.py", "x"), attempts)
        self.assertEqual(set(answers), {"Error: Please sign in again."})
        status, _, _ = self.website.post("/ajax/sign-in", {"email": ADA["email"], "password": BOB["password"]})
        self.assertEqual(status, 403)
        self.assertEqual(os.listdir(os.path.join(self.website.folder, "user")), [])

    def test_pages_of_other_websites_save_nothing_though_the_browser_sends_the_cookies(self):
        fields = {"dirname": CONTROLLERS, "filename": "a.py", "content": "x"}
        for origin in ("https://evil.example.org", "http://localhost:1", "null"):
            self.assertEqual(self.said(UPLOAD, fields, Cookie=self.ada, Origin=origin), "403 Error: This page belongs to another website.")
        self.assertEqual(self.said(UPLOAD, fields, Cookie=self.ada, Origin=self.website.origin), "OK")
        cookies = self.website.post("/ajax/sign-in", {"email": ADA["email"], "password": ADA["password"]})[1].get_all("Set-Cookie")
        for cookie in cookies:
            self.assertRegex(cookie, "; HttpOnly; SameSite=Strict$")

    def test_a_user_who_has_used_the_quota_is_told_so(self):
        for i in range(5):
            self.assertEqual(self.website.save(self.ada, CONTROLLERS, f"{i}.py", b"x" * 2_000_000), "OK")
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "5.py", "x"),
                         "Error: Disk quota exceeded:<br>You would use 10.1 MB in 6 files; 10 MB in 1000 files are allowed.")
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "4.py", "x"), "OK")
        self.assertEqual(self.website.save(self.bob, CONTROLLERS, "5.py", "x"), "OK")


class Hostile(WebsiteHostTest):
    def say(self, text):
        with socket.create_connection(("localhost", self.website.port), timeout=60) as peer:
            peer.sendall(text)
            return b"".join(iter(lambda: peer.recv(4096), b""))

    def test_bodies_that_are_too_long_are_refused_before_they_come(self):
        for path, cookies, length in ((UPLOAD, self.ada, (2 << 20) + 1), (UPLOAD, "", (64 << 10) + 1), (DOWNLOAD, "", (64 << 10) + 1),
                                      ("/ajax/sign-in", "", 1 << 62), ("/", "", 1), ("/site.json", self.ada, 1)):
            answer = self.say(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nCookie: {cookies}\r\nContent-Length: {length}\r\n\r\n".encode())
            self.assertTrue(answer.startswith(b"HTTP/1.1 413 "), (path, answer[:100]))

    def test_many_connections_of_an_address_guess_no_more_than_one(self):
        def guess(path, fields, client, password):
            return self.website.post(path, {**fields, "email": ADA["email"], "password": password}, **{"X-Forwarded-For": client})

        answers = at_once(lambda i: guess("/ajax/sign-in", {}, "203.0.113.7", f"guess {i}")[0], range(30))
        self.assertEqual((answers.count(403), answers.count(429)), (20, 10))
        status, _, said = guess("/ajax/sign-in", {}, "203.0.113.7", ADA["password"])
        self.assertEqual((status, said[:16]), (429, b"Error: Too many "))
        self.assertTrue(guess(DOWNLOAD, self.fields(), "203.0.113.7", "")[2].startswith(b"Error: Too many "))
        self.assertEqual(guess("/ajax/sign-in", {}, "203.0.113.8", ADA["password"])[0], 200)

    def test_a_home_of_ipv6_is_not_as_many_addresses_as_it_has_networks(self):
        def guess(network, password):
            return self.website.post("/ajax/sign-in", {"email": ADA["email"], "password": password}, **{"X-Forwarded-For": f"2001:db8:{network}::1"})[0]

        answers = at_once(lambda i: guess(f"7:{i:x}00", "guess"), range(100))  # each in a /56 of its own
        self.assertEqual((answers.count(403), answers.count(429)), (80, 20))
        self.assertEqual(guess("7:ff", ADA["password"]), 429)
        self.assertEqual(guess("8:0", ADA["password"]), 200)

    def test_forms_that_make_no_sense_are_refused(self):
        for content_type, body in (("multipart/form-data", b"x"), ("multipart/form-data; boundary=b", b"--b\r\n"), ("text/plain", b"a=b"),
                                   ("multipart/form-data; boundary=b", b"--b\r\nContent-Disposition: form-data\r\n\r\nx\r\n--b--"),
                                   ("", b"&".join(b"f%d=1" % i for i in range(33)))):
            status, _, answer = self.website.ask("POST", UPLOAD, body, Content_Type=content_type, Cookie=self.ada)
            self.assertEqual((status, answer), (400, b"Error: The form can't be understood."), content_type)

    def test_a_name_that_is_not_ours_is_refused_whatever_address_it_leads_to(self):
        for path in ("/", "/site.json", DOWNLOAD):
            self.assertEqual(self.website.ask("GET", path, Host=f"evil.example.org:{self.website.port}")[0], 421)
        content_type, body = multipart({"dirname": CONTROLLERS, "filename": "a.py", "content": "x"})
        self.assertEqual(self.website.ask("POST", UPLOAD, body, Content_Type=content_type, Cookie=self.ada, Host="evil.example.org")[0], 413)
        self.assertEqual(self.website.ask("GET", "/", Host="LOCALHOST")[0], 200)

    def test_only_the_files_of_the_page_are_served(self):
        for path in ("/../website.json", "/key/localhost", "/user/42/projects/robots", "/%2e%2e/website.json", "/index.html",
                     "/page.js/..", "/../key/localhost", "//etc/passwd"):
            self.assertEqual(self.website.ask("GET", path)[0], 404, path)
        self.assertEqual(self.website.ask("DELETE", "/")[0], 405)

    def test_the_page_allows_no_scripts_but_its_own(self):
        status, headers, page = self.website.ask("GET", "/")
        self.assertEqual(status, 200)
        policy = headers["Content-Security-Policy"]
        self.assertIn("script-src 'self' 'wasm-unsafe-eval' http://localhost:1;", policy)
        self.assertIn("frame-ancestors 'none'", policy)
        self.assertEqual(re.findall("<script[^>]*>[^<]*", page.decode()), ['<script type="module" src="/page.js">'])
        site = json.loads(self.website.ask("GET", "/site.json")[2])
        self.assertNotIn("user", site)
        self.assertEqual([project["name"] for project in site["projects"]], ["robots", "patrol"])
        self.assertNotIn("own", json.dumps(site), "a password")

    def test_who_signs_out_leaves_no_cookie_and_others_can_not_do_it_for_them(self):
        status, headers, _ = self.website.post("/ajax/sign-out", {"leave": "yes"}, Cookie=self.ada)
        self.assertEqual(status, 200)
        self.assertEqual(headers.get_all("Set-Cookie"), [f"{name}=; Max-Age=0; Path=/; HttpOnly; SameSite=Strict" for name in ("email", "password")])
        status, headers, _ = self.website.post("/ajax/sign-out", {"leave": "yes"}, Cookie=self.ada, Origin="http://elsewhere.org")
        self.assertEqual((status, headers.get_all("Set-Cookie")), (403, None))

    def test_the_key_is_made_once_and_for_its_owner_alone(self):
        key = self.website.key
        self.assertRegex(key, "^[0-9a-f]{32}$")
        self.assertEqual(os.stat(os.path.join(self.website.keys, "localhost")).st_mode & 0o777, 0o600)
        self.assertEqual(self.website.stop(), 0)
        self.website.start()
        self.assertEqual(self.website.key, key)
        self.assertEqual(self.website.save(self.ada, CONTROLLERS, "a.py", "x"), "Error: Please sign in again.")
        type(self).ada, type(self).ada_token = self.website.sign_in(ADA)
        type(self).bob, type(self).bob_token = self.website.sign_in(BOB)


class Configuration(unittest.TestCase):
    def run_with(self, *arguments):
        finished = subprocess.run([program("webots-website-host"), *arguments], cwd=SOURCE, capture_output=True, text=True, timeout=60)
        return finished.returncode, finished.stdout + finished.stderr

    def complaint(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            file.write(text if isinstance(text, str) else json.dumps(text))
            file.flush()
            status, said = self.run_with("--check-config", file.name)
            self.assertEqual(status, 2, said)
            return said.partition(f"{file.name}: ")[2].strip()

    def test_the_configuration_that_server_sh_starts_is_good(self):
        self.assertEqual(self.run_with("--check-config", "config/website_host/local.json"), (0, "config/website_host/local.json: good\n"))
        with open(os.path.join(SOURCE, "config", "website_host", "local.json")) as file:
            config = json.load(file)
        self.assertEqual(config["address"], "127.0.0.1")
        with open(os.path.join(SOURCE, "config", "simulation", "local.json")) as file:
            simulation = json.load(file)
        self.assertEqual(os.path.join(simulation["keyDir"], "localhost"), config["keyFile"])
        for project in config["projects"]:
            folder = os.path.join(SOURCE, simulation["projectsDir"], project["name"])
            self.assertTrue(os.path.isfile(os.path.join(folder, "worlds", project["world"])))
            self.assertTrue(os.path.isfile(os.path.join(folder, "controllers", project["controller"], project["controller"] + ".py")))

    def test_help_and_wrong_arguments(self):
        self.assertEqual(self.run_with("--help")[0], 0)
        self.assertIn("/ajax/upload-file.php", self.run_with("--help")[1])
        self.assertEqual(self.run_with("--wrong"), (2, 'webots-website-host: "--wrong" was not expected: --help shows what is.\n'))

    def test_what_is_wrong_with_a_configuration_is_said(self):
        good = {"keyFile": "k", "usersDir": "u", "projects": [{"name": "p", "world": "w.wbt", "controller": "c"}]}
        for change, said in (({"port": "x"}, '"port" of the configuration is no whole number from 0 to 65535.'),
                             ({"prot": 1}, 'nobody knows the key "prot" of the configuration.'),
                             ({"keyFile": ""}, '"keyFile" of the configuration is missing.'),
                             ({"projects": []}, '"projects" is missing.'),
                             ({"projects": [{"name": "../p", "world": "w.wbt", "controller": "c"}]},
                              '"../p" of project 1 is no name: letters, digits, \'_\', \'-\', \'.\' and blanks were expected.'),
                             ({"sessionServer": "http://x"}, '"sessionServer" does not begin with ws:// or wss://.'),
                             ({"sessionServer": "ws://x; script-src *"}, '"sessionServer" is no address.'),
                             ({"users": [{"id": 0, "name": "a", "email": "a", "password": "a"}]},
                              '"id" of user 1 is no number greater than 0.'),
                             ({"users": [ADA, ADA]}, 'two users have the same "id" or "email".')):
            self.assertEqual(self.complaint({**good, **change}), said)
        self.assertRegex(self.complaint("{"), r"^this is no JSON \(.*\)\.$")


class WithTheSimulationServer(unittest.IsolatedAsyncioTestCase):
    async def test_a_user_gets_the_template_with_what_was_saved_laid_over_it_and_a_visitor_the_template(self):
        website = self.enterContext(WebsiteHost())
        simulation = self.enterContext(SimulationServer(projectsDir=os.path.abspath(EXAMPLES), keyDir=website.keys))
        cookies, token = website.sign_in(ADA)
        website.save(cookies, CONTROLLERS, "avoid_walls.py", "CRUISE = 1\n")
        for user, text in ((["42", "Ada", token, "", "", ""], "CRUISE = 1\n"), ([""] * 6, "Drives a TwoWheeledRobot about")):
            async with Browser(simulation) as browser:
                await browser.socket.send(json.dumps({"init": [website.origin, "robots", "arena.wbt", *user]}))
                await browser.hear("webots:")
                (instance,) = simulation.instances()
                with open(os.path.join(simulation.instances_folder(), instance, "controllers/avoid_walls/avoid_walls.py")) as file:
                    self.assertIn(text, file.read())
            simulation.wait_until_clean()
        async with Browser(simulation) as browser:
            await browser.socket.send(json.dumps({"init": [website.origin, "robots", "arena.wbt", "42", "Ada", "stolen", "", "", ""]}))
            await browser.hear_all()
        self.assertEqual(browser.told[-1], "loading: Error: Failed to download project: Wrong user1Authentication: please sign in again.")
        simulation.wait_until_clean()


if __name__ == "__main__":
    main()
