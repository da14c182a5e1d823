"""An Apache of the test's own in front of the servers: its root, its port on the loopback, in the foreground.

    with Apache(virtual_host, port, certificate) as apache:
        apache.url
"""

import os
import shutil
import subprocess
import tempfile
import unittest

from .documents import documented_rules
from .processes import Startable, listens, required_program
from .servers import end, wait_until

MODULES = "/usr/lib/apache2/modules"
WANTED = ("mpm_event", "authz_core", "headers", "ssl", "socache_shmcb", "rewrite", "proxy", "proxy_http", "proxy_wstunnel")
SAMPLE = os.path.join(os.path.dirname(__file__), "..", "..", "config", "apache", "webots_cloud.conf")


def program():
    """The path of Apache; SkipTest where it is not installed."""
    if not os.path.isdir(MODULES):
        raise unittest.SkipTest("apache2 is missing (package apache2-bin)")
    return required_program("apache2", "apache2-bin")


def sample(session_port, simulation_ports):
    """The rules of config/apache, with the ports of the test instead of 1999 and 2000 to 2999."""
    with open(SAMPLE) as file:
        text = file.read()
    inside = text[text.index("    ProxyPreserveHost"):text.index("</VirtualHost>")]
    for theirs, ours in ((r"2\d{3}", "|".join(map(str, simulation_ports))), ("1999", str(session_port))):
        assert theirs in inside, f"{SAMPLE} does not mention {theirs} any more"
        inside = inside.replace(theirs, ours)
    return inside


def site(session_port, simulation_ports, port, certificate):
    """config/apache on `port`. The site's own page at / is 410 Gone."""
    return Apache(sample(session_port, simulation_ports) + "    RewriteRule ^/$ - [G]\n", port, certificate)


def one_rule(session_port, _, port, certificate):
    """Everything goes to the gateway of the session server."""
    return Apache(f"""
    ProxyPreserveHost On
    RewriteEngine on
    RewriteCond %{{HTTP:Upgrade}} websocket [NC]
    RewriteCond %{{HTTP:Connection}} upgrade [NC]
    RewriteRule ^/(.*)$ ws://127.0.0.1:{session_port}/$1 [P,L]
    RewriteRule ^/(.*)$ http://127.0.0.1:{session_port}/$1 [P,L]
""", port, certificate)


# Of a proxy that says nothing of itself.
BELOW_A_PATH = """
    RewriteCond %{{HTTP:Upgrade}} websocket [NC]
    RewriteCond %{{HTTP:Connection}} upgrade [NC]
    RewriteRule ^{path}/(.*)$ ws://127.0.0.1:{target}/$1 [P,L]
    RewriteRule ^{path}/(.*)$ http://127.0.0.1:{target}/$1 [P,L]
"""


def below_paths(paths, port, certificate):
    """Each of `paths` leads to a port of the loopback, which isn't told so. The site's own pages are 410 Gone."""
    rules = "".join(BELOW_A_PATH.format(path=path, target=target) for path, target in paths.items())
    return Apache(f"    RewriteEngine on\n{rules}    RewriteRule ^/ - [G]\n", port, certificate)


def documented_path(path, target, port, certificate):
    """The same of one path, with what docs/proxies.md says, which tells it."""
    return Apache(documented_rules("apache", path, target) + "    RewriteRule ^/ - [G]\n", port, certificate)


class Apache(Startable):
    """`rules`: what its virtual host with TLS is configured with; `certificate`: the files of the certificate and its key."""

    def __init__(self, rules, port, certificate):
        self.port = port
        self.url = f"https://localhost:{port}"
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_apache_")
        self.process = None
        loads = "\n".join(f"LoadModule {name}_module {MODULES}/mod_{name}.so" for name in WANTED)
        with open(self.path("apache.conf"), "w") as file:
            # Started as root it switches to a user, by default one that may not exist; nobody exists everywhere.
            user = "User nobody\nGroup nogroup\n" if os.geteuid() == 0 else ""
            file.write(f"{loads}\n{user}ServerRoot {self.folder}\nServerName localhost\nPidFile {self.path('apache.pid')}\n"
                       f"DefaultRuntimeDir {self.folder}\nErrorLog {self.path('error.log')}\nMutex posixsem\n"
                       f"Listen 127.0.0.1:{port}\n<VirtualHost 127.0.0.1:{port}>\nSSLEngine on\n"
                       f"SSLCertificateFile {certificate.certificate}\nSSLCertificateKeyFile {certificate.key}\n"
                       f"{rules}</VirtualHost>\n")

    def path(self, name):
        return os.path.join(self.folder, name)

    def start(self):
        self.process = subprocess.Popen([program(), "-f", self.path("apache.conf"), "-DFOREGROUND"], stdin=subprocess.DEVNULL)
        wait_until(lambda: self.process.poll() is not None or listens(self.port), f"Apache does not answer\n{self.log()}")
        assert self.process.poll() is None, f"Apache ended at once:\n{self.log()}"

    def close(self):
        if self.process:
            end(self.process)
        shutil.rmtree(self.folder, ignore_errors=True)

    def log(self):
        try:
            with open(self.path("error.log"), errors="replace") as file:
                return file.read()
        except OSError:
            return ""
