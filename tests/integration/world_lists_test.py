#!/usr/bin/python3
"""The worlds of a repository, or of a folder in one, by its address: from a real git server, by a machine and by its session server. Protocol
sections 2.5 and 4.5."""

import json
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.git_server import GitServer  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402


def world(title, size=0):
    return f'#VRML_SIM R2025a utf8\nWorldInfo {{\n  title "{title}"\n  info [ "About {title}." ]\n}}\n#' + "x" * size


ROBOTS = {"worlds/arena.wbt": world("Arena"), "worlds/notes.txt": "x", "big/video.bin": os.urandom(3_000_000).hex(), "map.wbt": world("Map"),
          "projects/arm/worlds/my arm+hand.wbt": world("Arm"), "projects/arm/controllers/a/a.py": "print()", "projects/old/worlds/plain.wbt": "#VRML_SIM\n"}


class WorldLists(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.git = cls.enterClassContext(GitServer())
        cls.git.add_repository("ada", "robots", branches={"main": ROBOTS, "dev/next": {"worlds/b.wbt": world("B")}}, partial=True)
        cls.machine = cls.enterClassContext(SimulationServer(forges=[cls.git.url], allowedRepositories=[f"{cls.git.url}/ada", f"{cls.git.url}/group"]))
        cls.session = cls.enterClassContext(SessionServer([cls.machine.address]))
        wait_until(lambda: cls.session.get("/") == "1", cls.session.log)

    def list(self, address, server=None, path="/viewer/worlds/list"):
        status, body = (server or self.session).ask(path, "POST", body=address.replace("{}", self.git.url).encode())
        self.assertIn(status, (200, 503), body)
        return json.loads(body)

    def titles(self, address):
        answer = self.list(address)
        self.assertIn("worlds", answer, answer)
        return [each.get("title", "") for each in answer["worlds"]]

    def test_a_repository_has_a_list_with_titles_and_each_world_of_it_can_be_started(self):
        before = len(self.git.requests())
        answer = self.list("{}/ada/robots")
        base = f"{self.git.url}/ada/robots/blob/main"
        self.assertEqual(answer, {"worlds": [
            {"url": f"{base}/projects/arm/worlds/my%20arm%2Bhand.wbt", "title": "Arm", "text": "About Arm."},
            {"url": f"{base}/projects/old/worlds/plain.wbt"},
            {"url": f"{base}/worlds/arena.wbt", "title": "Arena", "text": "About Arena."}]})
        sent = sum(request[3] for request in self.git.requests()[before:])
        self.assertLess(sent, 20_000, "the other files came, too")
        self.assertEqual(self.list("{}/ada/robots", self.machine, "/worlds/list"), answer)

    def test_links_to_folders_of_all_forges_are_understood(self):
        self.git.add_repository("group/of/groups", "robots", ROBOTS, partial=True, tags={"v1": {"worlds/c.wbt": world("C")}})
        for link, titles in (("{}/ada/robots.git", ["Arm", "", "Arena"]), ("{}/ada/robots/", ["Arm", "", "Arena"]),
                             ("{}/ada/robots/tree/main/worlds", ["Arena"]), ("{}/ada/robots/tree/dev/next", ["B"]),
                             ("{}/ada/robots/src/branch/main/projects/arm", ["Arm"]), ("{}/ada/robots/src/dev/next/worlds/", ["B"]),
                             ("{}/ada/robots/blob/main/projects/old/README.md", [""]),
                             ("{}/group/of/groups/robots", ["Arm", "", "Arena"]), ("{}/group/of/groups/robots/-/tree/main/worlds?ref_type=heads", ["Arena"]),
                             ("{}/group/of/groups/robots/src/tag/v1", ["C"]), ("{}/ada/robots/tree/main/big", [])):
            with self.subTest(link):
                self.assertEqual(self.titles(link), titles)

    def test_what_can_not_be_listed_is_told(self):
        for link, code, words in (("{}/ada/nothing", "no-repository", "does not exist or is private"), ("{}/ada/robots/tree/main/none", "not-there", "none"),
                                  ("{}/ada/robots/tree/other", "not-there", "no branch or tag"), ("{}/ada", "no-list", "leads to no repository"),
                                  ("{}/eve/robots", "not-allowed", "allowedRepositories"), ("https://other.example/ada/robots", "other-site", "must start with")):
            with self.subTest(link):
                answer = self.list(link)
                self.assertEqual(answer.get("code"), code, answer)
                self.assertIn(words, answer["error"])

    def test_git_servers_that_can_less_are_understood_too(self):
        for options, partial in (({}, False), ({"version2": False}, False)):
            with self.subTest(**options), GitServer(**options) as git, SimulationServer(forges=[git.url], allowedRepositories=[git.url]) as machine:
                git.add_repository("ada", "robots", ROBOTS, partial=partial)
                status, body = machine.ask("/worlds/list", "POST", body=f"{git.url}/ada/robots".encode())
                self.assertEqual([each.get("title") for each in json.loads(body)["worlds"]], ["Arm", None, "Arena"], body)

    def test_many_and_large_worlds_are_listed_some_of_them_without_their_titles(self):
        many = {f"worlds/w{number:03}.wbt": world(f"W {number}") for number in range(300)}
        self.git.add_repository("ada", "many", many, partial=True)
        titles = self.titles("{}/ada/many")
        self.assertEqual(len(titles), 200)
        self.assertEqual((titles[0], titles[99], titles[100]), ("W 0", "W 99", ""))
        self.git.add_repository("ada", "large", {f"worlds/w{number}.wbt": world(f"W {number}", 30_000_000) for number in range(3)}, partial=True)
        self.assertEqual(len(self.titles("{}/ada/large")), 3)

    def test_no_page_of_another_site_makes_it_look(self):
        before = len(self.git.requests())
        status, _ = self.session.ask("/viewer/worlds/list", "POST", {"Origin": "https://evil.example"}, f"{self.git.url}/ada/unseen".encode())
        self.assertEqual(status, 403)
        self.assertEqual(len(self.git.requests()), before)


if __name__ == "__main__":
    main()
