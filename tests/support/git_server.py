"""A real git server on the loopback for tests: git http-backend behind nginx and fcgiwrap.

    with GitServer() as server:
        server.add_repository("cyberbotics", "webots", {"worlds/demo.wbt": "#VRML_SIM R2023b utf8\n"})
        fetch(f"{server.url}/cyberbotics/webots/blob/main/worlds/demo.wbt")

Its address is also the base of world addresses, as that of a forge. Leaving the context ends its processes and removes
its folder.
"""

import os
import shutil
import socket
import subprocess
import tempfile
import unittest

from .ports import free_port
from .processes import Startable, end_with_parent, find_program, listens, required_program
from .waiting import wait_until

GIT_BACKEND = "/usr/lib/git-core/git-http-backend"
WORKERS = 8
PROGRAMS = {"git": "git", "nginx": "nginx-light", "fcgiwrap": "fcgiwrap"}

NGINX_CONFIGURATION = """
{user}
daemon off;
master_process off;
worker_processes 1;
pid {folder}/nginx.pid;
error_log {folder}/error.log;
events {{ worker_connections 512; }}
http {{
    log_format requests '$request_method $request_uri $status $bytes_sent $request_length';
    access_log {folder}/access.log requests;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    client_max_body_size 16m;
    server {{
        listen 127.0.0.1:{port};
        {locations}
    }}
}}
"""

LFS = """
        location ~ ^/[^/]+/[^/]+/info/lfs/ {{ proxy_pass http://127.0.0.1:{lfs}; proxy_buffering off; }}
"""

SMART = """
        location ~ ^(?<repository>/[^/]+(/[^/]+)+\\.git)/ {{
            # Not from git: fcgiwrap answers 502 when the program that it starts ends before it has read the request.
            if (!-d {repositories}$repository) {{ return 404; }}
            include /etc/nginx/fastcgi_params;
            fastcgi_param SCRIPT_FILENAME {backend};
            fastcgi_param GIT_PROJECT_ROOT {repositories};
            fastcgi_param GIT_HTTP_EXPORT_ALL "";
            fastcgi_param PATH_INFO $uri;
            fastcgi_param GIT_PROTOCOL {protocol};
            fastcgi_param REMOTE_USER "";
            fastcgi_param HOME {folder};
            {pace}
            # A worker of fcgiwrap dies when its client closes the connection, and the next request fails with it.
            fastcgi_ignore_client_abort on;
            fastcgi_pass unix:{folder}/fcgi.socket;
        }}
"""

DUMB = "        location / {{ root {repositories}; }}"


def require_git_server():
    """Raises SkipTest when a program that a server needs is missing."""
    for program, package in PROGRAMS.items():
        required_program(program, package)
    if not os.access(GIT_BACKEND, os.X_OK):
        raise unittest.SkipTest(f"{GIT_BACKEND} is missing (package git)")


def _quoted(name):
    """A path of any bytes (as os.fsdecode spells them) for fast-import."""
    escaped = os.fsencode(name).replace(b"\\", b"\\\\").replace(b'"', b'\\"').replace(b"\n", b"\\n")
    return b'"' + escaped + b'"'


class GitServer(Startable):
    """Serves the repositories of `add_repository` and `link_repository`."""

    def __init__(self, smart=True, port=0, bytes_per_second=0, version2=True, lfs=0):
        """smart=False: plain files, the "dumb" protocol. bytes_per_second: how fast it answers (0: as it can).
        lfs: port of a Git LFS server that answers for all repositories (0: there is none).
        version2=False: it ignores that the client requests version 2 of the protocol, and answers in version 0."""
        require_git_server()
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_git_")
        self.repositories = os.path.join(self.folder, "repositories")
        os.mkdir(self.repositories)
        os.chmod(self.folder, 0o755)
        self.port = port or free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._smart = smart
        self._rate = bytes_per_second
        self._version2 = version2
        self._lfs = lfs
        self._processes = []

    def start(self):
        """Starts serving; also after `stop`, at the same address."""
        # git refuses repositories of other users, which test repositories under a container's root may be.
        with open(os.path.join(self.folder, ".gitconfig"), "w") as config:
            config.write("[safe]\n\tdirectory = *\n")
        values = {"folder": self.folder, "repositories": self.repositories, "backend": GIT_BACKEND, "port": self.port,
                  "protocol": "$http_git_protocol" if self._version2 else '""',
                  # nginx limits the rate of buffered data only.
                  "pace": f"limit_rate {self._rate};" if self._rate else "fastcgi_buffering off;",
                  "user": "user root;" if os.geteuid() == 0 else ""}
        lfs = LFS.format(lfs=self._lfs) if self._lfs else ""
        locations = lfs + (SMART if self._smart else DUMB).format(**values)
        configuration = os.path.join(self.folder, "nginx.conf")
        with open(configuration, "w") as file:
            file.write(NGINX_CONFIGURATION.format(locations=locations, **values))
        if self._smart:
            self._start_fcgiwrap()
        self._spawn([find_program("nginx"), "-p", self.folder, "-c", configuration])
        self._wait_for_port()

    def stop(self):
        """Ends the processes; the repositories stay."""
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._processes.clear()

    def close(self):
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def add_repository(self, owner, name, files=None, branches=None, tags=None, partial=True):
        """Makes `<owner>/<name>.git`. Returns its path.

        files: contents (str or bytes) by path, of the branch main; a value may also be a tuple (mode, content), with the
        modes of git: "100755" for a program, "120000" for a symbolic link, "160000" for a submodule (content: a commit).
        branches: files by branch, in addition to main (or instead, if files is None); tags: files by tag.
        partial: the server allows filters and asking for any object, as the large forges do.
        """
        path = os.path.join(self.repositories, owner, name + ".git")
        os.makedirs(os.path.dirname(path), exist_ok=True)
        self._git("init", "-q", "--bare", "-b", "main", path)
        self.set_partial(path, partial)
        if files is not None:
            self.commit(path, files)
        for branch, contents in (branches or {}).items():
            self.commit(path, contents, f"refs/heads/{branch}")
        for tag, contents in (tags or {}).items():
            self.commit(path, contents, f"refs/tags/{tag}")
        self._git("-C", path, "update-server-info")
        return path

    def link_repository(self, owner, name, path):
        """Serves an existing bare repository."""
        link = os.path.join(self.repositories, owner, name + ".git")
        os.makedirs(os.path.dirname(link), exist_ok=True)
        os.symlink(os.path.abspath(path), link)

    def set_partial(self, path, allowed):
        for key in ("uploadpack.allowFilter", "uploadpack.allowAnySHA1InWant"):
            self._git("-C", path, "config", key, "true" if allowed else "false")

    def commit(self, path, files, ref="refs/heads/main", message="commit"):
        """Adds a commit with exactly these files. Returns its hash."""
        stream = [f"commit {ref}\nmark :1\ncommitter Test <test@localhost> 1700000000 +0000\n"
                  f"data {len(message)}\n{message}\n".encode()]
        known = subprocess.run(["git", "-C", path, "rev-parse", "--verify", "-q", ref], stdout=subprocess.PIPE)
        if known.returncode == 0:
            stream.append(b"from " + known.stdout.strip() + b"\n")
        stream.append(b"deleteall\n")
        for name, value in files.items():
            mode, content = value if isinstance(value, tuple) else ("100644", value)
            if mode == "160000":
                stream.append(b"M 160000 %s %s\n" % (content.encode(), _quoted(name)))
                continue
            content = os.fsencode(content) if isinstance(content, str) else content
            stream.append(b"M %s inline %s\ndata %d\n%s\n" % (mode.encode(), _quoted(name), len(content), content))
        stream.append(b"\n")
        self._git("-C", path, "fast-import", "--quiet", "--force", input=b"".join(stream))
        return self._git("-C", path, "rev-parse", ref + "^{commit}").decode().strip()

    def refuse_to_pack(self, pattern):
        """From now on git fails where its pack command with the requested objects matches a shell pattern."""
        self._hook(f'''#!/bin/sh
wanted=$(cat)
case "$* $wanted" in {pattern}) exit 1 ;; esac
printf '%s\\n' "$wanted" | "$@"
''')

    def pack_backwards(self):
        """From now on files are sent in the reverse order of the request."""
        self._hook('''#!/bin/sh
wanted=$(cat)
case "$wanted" in
    *--shallow*) printf '%s\\n' "$wanted" | "$@" ;;
    *) { printf '%s\\n' "$wanted" | grep '^[0-9a-f]' | tac; printf '%s\\n' --not ""; } | "$@" ;;
esac
''')

    def _hook(self, text):
        """Has git run this shell script in place of its pack command, which becomes the script's arguments."""
        hook = os.path.join(self.folder, "pack-objects-hook")
        with open(hook, "w") as script:
            script.write(text)
        os.chmod(hook, 0o755)
        with open(os.path.join(self.folder, ".gitconfig"), "a") as config:
            config.write(f"[uploadpack]\n\tpackObjectsHook = {hook}\n")

    def write_object(self, path, kind, content):
        """Stores an object that git itself would not make. Returns its hash."""
        return self._git("-C", path, "hash-object", "-t", kind, "-w", "--stdin", "--literally", input=content).decode().strip()

    def commit_tree(self, path, entries, ref="refs/heads/main"):
        """Adds a commit of a tree that git itself would refuse: entries are (mode, name, hash), or (mode, name, entries)."""
        return self._commit_of(path, self._write_tree(path, entries), ref)

    def _write_tree(self, path, entries):
        tree = b""
        for mode, name, target in entries:
            if isinstance(target, list):
                target = self._write_tree(path, target)
            name = os.fsencode(name) if isinstance(name, str) else name
            tree += mode.encode() + b" " + name + b"\0" + bytes.fromhex(target)
        return self.write_object(path, "tree", tree)

    def _commit_of(self, path, tree, ref):
        text = f"tree {tree}\nauthor Test <test@localhost> 1700000000 +0000\ncommitter Test <test@localhost> 1700000000 +0000\n\nx\n"
        commit = self.write_object(path, "commit", text.encode())
        self._git("-C", path, "update-ref", ref, commit)
        return commit

    def requests(self):
        """The requests so far: (method, address, status, bytes sent, bytes received)."""
        log = os.path.join(self.folder, "access.log")
        if not os.path.exists(log):
            return []
        with open(log) as file:
            words = [line.split() for line in file]
        return [(method, address, int(status), int(sent), int(received)) for method, address, status, sent, received in words]

    def _git(self, *arguments, input=None):
        environment = dict(os.environ, HOME=self.folder, GIT_CONFIG_NOSYSTEM="1", GIT_CONFIG_COUNT="1",
                           GIT_CONFIG_KEY_0="safe.directory", GIT_CONFIG_VALUE_0="*")
        finished = subprocess.run(["git", *arguments], input=input, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                  env=environment)
        if finished.returncode != 0:
            raise RuntimeError(f"git {' '.join(arguments)}: {finished.stderr.decode(errors='replace')}")
        return finished.stdout

    def _start_fcgiwrap(self):
        address = os.path.join(self.folder, "fcgi.socket")
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
            if os.path.exists(address):
                os.unlink(address)
            listener.bind(address)
            listener.listen(128)
            # FastCGI passes the listening socket as standard input. Single processes, because fcgiwrap leaves its
            # workers behind when it is told to end.
            for _ in range(WORKERS):
                self._spawn([find_program("fcgiwrap")], stdin=listener)

    def _spawn(self, command, stdin=subprocess.DEVNULL):
        output = open(os.path.join(self.folder, "output.log"), "ab")
        with output:
            self._processes.append(subprocess.Popen(command, stdin=stdin, stdout=output, stderr=output,
                                                    preexec_fn=end_with_parent))

    def _wait_for_port(self):
        wait_until(lambda: listens(self.port) or self._has_ended(), self._output)
        if not listens(self.port):
            raise RuntimeError("the git server did not start: " + self._output())

    def _has_ended(self):
        return any(process.poll() is not None for process in self._processes)

    def _output(self):
        with open(os.path.join(self.folder, "output.log"), errors="replace") as log:
            return log.read()
