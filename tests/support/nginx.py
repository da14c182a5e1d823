"""nginx in front of another server."""

import contextlib
import os
import subprocess
import tempfile
import unittest

from .ports import free_port
from .processes import find_program, listens
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
    server {{
        listen 127.0.0.1:{port};
        gzip on;
        gzip_types *;
        location / {{
            proxy_pass http://localhost:{target};
            proxy_set_header Host $host;
        }}
    }}
}}
"""


@contextlib.contextmanager
def reverse_proxy(target):
    """The origin of an nginx that passes everything on to this port of the loopback. Without nginx: SkipTest."""
    program = find_program("nginx")
    if not program:
        raise unittest.SkipTest("nginx is missing (package nginx)")
    with tempfile.TemporaryDirectory(prefix="webots_cloud_nginx_") as folder:
        port = free_port()
        configuration = os.path.join(folder, "nginx.conf")
        with open(configuration, "w") as file:
            file.write(CONFIGURATION.format(folder=folder, port=port, target=target, user="user root;" if os.geteuid() == 0 else ""))
        process = subprocess.Popen([program, "-p", folder, "-c", configuration], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_until(lambda: process.poll() is not None or listens(port), "nginx does not listen")
            yield f"http://localhost:{port}"
        finally:
            end(process)
