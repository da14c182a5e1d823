"""nginx in front of other servers, in the foreground, on the loopback."""

import contextlib
import os
import subprocess
import tempfile

from .documents import documented_rules
from .ports import free_port
from .processes import listens, required_program
from .servers import end, wait_until

CONFIGURATION = """
{user}
daemon off;
master_process off;
pid {folder}/nginx.pid;
error_log {folder}/error.log;
events {{ worker_connections 64; }}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    {servers}
}}
"""

PASS_EVERYTHING_ON = """
    server {{
        listen 127.0.0.1:{port};
        gzip on;
        gzip_types *;
        location / {{
            proxy_pass http://localhost:{target};
            proxy_set_header Host $host;
        }}
    }}
"""

ONE_RULE = """
    map $http_upgrade $connection_of_upgrade {{
        default upgrade;
        "" "";
    }}
    server {{
        listen 127.0.0.1:{port} ssl;
        ssl_certificate {certificate};
        ssl_certificate_key {key};
        location / {{
            proxy_pass http://127.0.0.1:{target};
            proxy_http_version 1.1;
            proxy_buffering off;
            proxy_set_header Host $host:{port};
            proxy_set_header Upgrade $http_upgrade;
            proxy_set_header Connection $connection_of_upgrade;
            proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for;
        }}
    }}
"""

BELOW_PATHS = """
    map $http_upgrade $webots_cloud_connection {{
        default upgrade;
        "" "";
    }}
    server {{
        listen 127.0.0.1:{port} ssl;
        ssl_certificate {certificate};
        ssl_certificate_key {key};
        {locations}
        location / {{ return 410; }}
    }}
"""

# Variables of rules that people have.
IN_FRONT = """
    map $http_upgrade $connection_or_close {{
        default upgrade;
        "" close;
    }}
    map $http_upgrade $scheme_of_request {{
        default wss;
        "" https;
    }}
    server {{
        listen 127.0.0.1:{port} ssl;
        ssl_certificate {certificate};
        ssl_certificate_key {key};
        {rules}
    }}
"""

# Of a proxy that says nothing of itself.
BELOW_A_PATH = """
        location {path}/ {{
            proxy_pass http://127.0.0.1:{target}/;
            proxy_http_version 1.1;
            proxy_buffering off;
            proxy_set_header Upgrade $http_upgrade;
            proxy_set_header Connection $webots_cloud_connection;
        }}
"""

SAMPLE = os.path.join(os.path.dirname(__file__), "..", "..", "config", "nginx", "webots_cloud.conf")


def program():
    """The path of nginx; SkipTest where it is not installed."""
    return required_program("nginx", "nginx")


@contextlib.contextmanager
def reverse_proxy(target):
    """The origin of an nginx that passes everything on to this port of the loopback. Without nginx: SkipTest."""
    port = free_port()
    with _nginx(PASS_EVERYTHING_ON.format(port=port, target=target), port):
        yield f"http://localhost:{port}"


def site(session_port, simulation_ports, port, certificate, address="127.0.0.1"):
    """config/nginx on `port`, with the ports of the test instead of 1999 and 2000 to 2999. The site's own page at / is 410 Gone."""
    with open(SAMPLE) as file:
        text = file.read()
    for theirs, ours in (("1999", str(session_port)),
                         (r"2\d\d\d", "|".join(map(str, simulation_ports))),
                         ("listen 443", f"listen {address}:{port}"),
                         ("/etc/letsencrypt/live/sim.example.org/fullchain.pem", certificate.certificate),
                         ("/etc/letsencrypt/live/sim.example.org/privkey.pem", certificate.key),
                         ("sim.example.org;", "localhost;\n    location = / { return 410; }")):
        assert theirs in text, f"{SAMPLE} does not mention {theirs} any more"
        text = text.replace(theirs, ours)
    return _nginx(text, port)


def one_rule(session_port, _, port, certificate):
    """Everything goes to the gateway of the session server."""
    return _nginx(ONE_RULE.format(port=port, target=session_port, certificate=certificate.certificate, key=certificate.key), port)


def in_front(rules, port, certificate):
    """These rules of a server."""
    return _nginx(IN_FRONT.format(port=port, rules=rules, certificate=certificate.certificate, key=certificate.key), port)


def below_paths(paths, port, certificate):
    """Each of `paths` leads to a port of the loopback, which isn't told so. The site's own pages are 410 Gone."""
    return _below("".join(BELOW_A_PATH.format(path=path, target=target) for path, target in paths.items()), port, certificate)


def documented_path(path, target, port, certificate):
    """The same of one path, with what docs/proxies.md says, which tells it."""
    return _below(documented_rules("nginx", path, target), port, certificate)


def _below(locations, port, certificate):
    return _nginx(BELOW_PATHS.format(port=port, locations=locations, certificate=certificate.certificate, key=certificate.key), port)


@contextlib.contextmanager
def _nginx(servers, port):
    executable = program()
    with tempfile.TemporaryDirectory(prefix="webots_cloud_nginx_") as folder:
        configuration = os.path.join(folder, "nginx.conf")
        with open(configuration, "w") as file:
            user = "user root;" if os.geteuid() == 0 else ""
            file.write(CONFIGURATION.format(folder=folder, servers=servers, user=user))
        log = os.path.join(folder, "error.log")
        process = subprocess.Popen([executable, "-p", folder, "-c", configuration, "-e", log],
                                   stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_until(lambda: process.poll() is not None or listens(port), "nginx does not listen")
            if process.poll() is not None:
                with open(log) as file:
                    raise AssertionError(f"nginx ended at once:\n{file.read()}")
            yield
        finally:
            end(process)
