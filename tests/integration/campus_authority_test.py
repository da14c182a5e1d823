#!/usr/bin/python3
"""The simulation server's "caFile": forges and registries of a campus, whose authority no system knows. docs/configuration.md, "caFile"."""

import glob
import json
import os
import shutil
import sys
import tempfile
import types
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import nginx  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.certificates import Authority, self_signed  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.lfs_server import LfsServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.registry import Registry  # noqa: E402
from support.servers import SimulationServer, main, wait_until  # noqa: E402
from support.website import Website, require_php  # noqa: E402

WORLD = {"worlds/arena.wbt": "#VRML_SIM R2023b utf8\nWorldInfo {}\n"}
USER = ["42", "Ada", "secret", "", "", "custom"]  # of a website, whose version of the project is fetched from there
SYSTEM = "/etc/ssl/certs/ca-certificates.crt"  # where libcurl looks for the system's authorities


class Campus(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        nginx.program()
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_campus_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.authority = Authority(self.folder, "campus authority")
        self.git = self.enterContext(GitServer())
        self.git.add_repository("campus", "robots", WORLD)

    def by_tls(self, target, certificate):
        """The base address of a proxy with that certificate in front of this port."""
        port = free_port()
        self.enterContext(nginx.one_rule(target, None, port, types.SimpleNamespace(certificate=certificate[0], key=certificate[1])))
        return f"https://localhost:{port}"

    def server(self, *forges, wrapper=(), **config):
        server = SimulationServer(forges=list(forges), allowedRepositories=[f"{forge}/campus" for forge in forges], **config)
        server.wrapper = wrapper
        return self.enterContext(server)

    async def start(self, server, forge):
        """The last message about a start of a world on this forge."""
        async with Browser(server) as browser:
            await browser.start(url=f"{forge}/campus/robots/blob/main/worlds/arena.wbt")
            while True:
                message = await browser.hear("")
                if message.startswith(("webots:", "loading: Error:")):
                    return message

    async def test_a_forge_of_the_campus_is_trusted_by_caFile_and_only_by_it(self):
        forge = self.by_tls(self.git.port, self.authority.issue("forge", "DNS:localhost"))
        self.assertIn("certificate", await self.start(self.server(forge), forge))
        self.assertRegex(await self.start(self.server(forge, caFile=self.authority.certificate), forge), "^webots:")

    async def test_a_forge_that_has_signed_itself_is_trusted_by_its_own_certificate(self):
        certificate = self_signed(self.folder, "DNS:localhost")
        forge = self.by_tls(self.git.port, certificate)
        self.assertRegex(await self.start(self.server(forge, caFile=certificate[0]), forge), "^webots:")

    async def test_a_certificate_for_another_name_is_refused_whoever_has_signed_it(self):
        forge = self.by_tls(self.git.port, self.authority.issue("other", "DNS:elsewhere.example"))
        self.assertIn("loading: Error:", await self.start(self.server(forge, caFile=self.authority.certificate), forge))

    @unittest.skipIf(os.geteuid() != 0, "only root can give a server other authorities of the system")
    async def test_the_authorities_of_the_system_are_trusted_as_well(self):
        system = Authority(self.folder, "authority of the system")
        campus = self.by_tls(self.git.port, self.authority.issue("forge", "DNS:localhost"))
        world = self.by_tls(self.git.port, system.issue("world", "DNS:localhost"))
        wrapper = ("unshare", "--mount", "sh", "-c", f"mount --bind {system.certificate} {SYSTEM} && exec \"$@\"", "server")
        server = self.server(campus, world, wrapper=wrapper, caFile=self.authority.certificate)
        for forge in (campus, world):
            self.assertRegex(await self.start(server, forge), "^webots:")

    async def test_a_registry_of_the_campus_is_told(self):
        with Registry() as registry:
            port = registry.server.server_address[1]
            address = self.by_tls(port, self.authority.issue("registry", "DNS:localhost"))
            self.server(notify=[f"{address}/ajax/server/setup.php"], caFile=self.authority.certificate)
            wait_until(lambda: registry.forms, "the registry is told")

    async def test_large_files_of_a_campus_come_from_there_as_well(self):
        mesh = os.urandom(10_000)
        with LfsServer() as lfs, GitServer(lfs=lfs.port) as git:
            git.add_repository("campus", "robots", {**WORLD, "meshes/a.stl": lfs.pointer(mesh)})
            forge = self.by_tls(git.port, self.authority.issue("forge", "DNS:localhost"))
            lfs.url = self.by_tls(lfs.port, self.authority.issue("store", "DNS:localhost"))  # where it says that the objects are
            server = self.server(forge, caFile=self.authority.certificate)
            async with Browser(server) as browser:
                await browser.start(url=f"{forge}/campus/robots/blob/main/worlds/arena.wbt")
                await browser.hear("webots:")
                found = glob.glob(os.path.join(server.instances_folder(), "*", "**", "meshes", "a.stl"), recursive=True)
                with open(found[0], "rb") as file:
                    self.assertEqual(file.read(), mesh)
            self.assertEqual([method for method, _, _ in lfs.requests], ["POST", "GET"])

    async def test_a_website_of_the_campus_may_start_simulations(self):
        require_php()
        with Website() as website:
            origin = self.by_tls(website.port, self.authority.issue("website", "DNS:localhost"))
            keys = os.path.join(self.folder, "keys")
            os.mkdir(keys)
            with open(os.path.join(keys, "localhost"), "w") as file:
                file.write(website.key)
            for trusted in (False, True):
                server = SimulationServer(projectsDir=os.path.abspath(EXAMPLES), keyDir=keys, **({"caFile": self.authority.certificate} if trusted else {}))
                async with Browser(self.enterContext(server)) as page:
                    await page.socket.send(json.dumps({"init": [origin, "robots", "arena.wbt", *USER]}))
                    while not (told := await page.hear("")).startswith(("webots:", "loading: Error:")):
                        pass
                    self.assertRegex(told, "^webots:" if trusted else "certificate")

    def test_a_file_without_certificates_is_refused_at_the_start(self):
        server = SimulationServer(caFile=self.authority.key)
        server.configure()
        self.addCleanup(server.close)
        status, output = server.command("--check-config")
        self.assertNotEqual(status, 0)
        self.assertIn('the certificates of "caFile"', output)


if __name__ == "__main__":
    main()
