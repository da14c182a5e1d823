"""Runs pods of config/kubernetes as containers of a Docker daemon: a kubelet as far as our manifests need one.

    cluster = Cluster(docker, documents("base"), {"session-secret": {"word": ...}, "tls": {...}})
    pod = cluster.start("simulation")
    ...
    pod.end()   # preStop, then SIGTERM
"""

import http.client
import json
import os
import ssl
import tempfile
import threading

from .kubernetes_documents import configuration_files, pods
from .waiting import wait_until

SUBNET = "10.88.0"  # of the pods; .1 is this machine
# Of /etc/resolv.conf in pods of the namespace "webots".
SEARCH = ("webots.svc.cluster.local", "svc.cluster.local", "cluster.local")
DOTS = 5


def write_projected(folder, files, group, mode):
    """Files as the kubelet hands them out: links to a folder that it replaces by another one when something changes."""
    content = tempfile.mkdtemp(prefix="..", dir=folder)
    os.chmod(content, 0o755)
    for name, text in files.items():
        path = os.path.join(content, name)
        with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
            file.write(text)
        os.chown(path, 0, group)
        os.chmod(path, mode)
        if not os.path.lexists(os.path.join(folder, name)):
            os.symlink(os.path.join("..data", name), os.path.join(folder, name))
    link = os.path.join(folder, "..new")
    os.symlink(os.path.basename(content), link)
    os.rename(link, os.path.join(folder, "..data"))


class Cluster:
    """`tag`: of our images. `changed(text)` may give a pod another configuration. `dns`: the address of a name server."""

    def __init__(self, docker, documents, secrets, tag, changed, dns):
        self.docker, self.documents, self.secrets, self.tag, self.changed, self.dns = docker, documents, secrets, tag, changed, dns
        self.started = 0
        docker.run("network", "create", "--subnet", f"{SUBNET}.0/24", "--gateway", f"{SUBNET}.1", "site")

    def close(self):
        names = self.docker.run("ps", "--all", "--quiet").split()
        if names:
            self.docker.run("rm", "--force", *names)
        # Its bridge would outlive the daemon, and take what is for the same addresses of the next one.
        self.docker.run("network", "rm", "site")

    def start(self, deployment):
        """One more pod of that name, which is not ready yet. No other has had its name or its address."""
        self.started += 1
        return Pod(self, deployment, f"{deployment}-{os.urandom(3).hex()}", f"{SUBNET}.{self.started + 9}")


class Pod:
    """One of a deployment: its container runs until it is ended, as Kubernetes would start, ask and end it."""

    def __init__(self, cluster, deployment, name, address):
        self.docker, self.name, self.address = cluster.docker, name, address
        self.was_stopped = False
        self.spec = pods(cluster.documents)[deployment]["spec"]
        self.container, = self.spec["containers"]
        self.group = self.spec["securityContext"]["fsGroup"]
        self.folder = tempfile.mkdtemp(prefix=f"{name}_", dir=cluster.docker.folder)
        (file, text), = configuration_files({"spec": self.spec}, cluster.documents).items()
        self.files = {file: cluster.changed(text)}
        self.environment = {each["name"]: each["value"] for each in self.container.get("env", [])}
        self.port = json.loads(text)["port"]
        image = self.container["image"].partition(":")[0]
        command = [*self.container.get("command", []), *self.container.get("args", [])]
        entry = ["--entrypoint", command[0]] if command else []
        self.docker.run("run", "--detach", "--name", name, "--hostname", name, "--network", "site", "--ip", address, "--dns", cluster.dns,
                        *[f"--dns-search={each}" for each in SEARCH], f"--dns-option=ndots:{DOTS}", "--no-healthcheck", *self._confined(), *entry,
                        *[f"--env={key}={value}" for key, value in self.environment.items()], *self._mounts(cluster.secrets),
                        f"{image}:{cluster.tag}", *command[1:])

    def _confined(self):
        pod, context = self.spec["securityContext"], self.container["securityContext"]
        assert context["allowPrivilegeEscalation"] is False and context["readOnlyRootFilesystem"] is True
        unconfined = context.get("seccompProfile", {}).get("type") == "Unconfined"
        unmasked = context.get("procMount") == "Unmasked"
        return ["--read-only", "--security-opt", "no-new-privileges", "--user", f"{pod['runAsUser']}:{pod['runAsGroup']}",
                "--group-add", str(pod["fsGroup"]), *[f"--cap-drop={each}" for each in context["capabilities"]["drop"]],
                *[f"--sysctl={each['name']}={each['value']}" for each in pod.get("sysctls", [])],
                *(["--security-opt", "seccomp=unconfined"] if unconfined else []),
                *(["--security-opt", "systempaths=unconfined"] if unmasked else [])]

    def _mounts(self, secrets):
        volumes = {volume["name"]: volume for volume in self.spec["volumes"]}
        options = []
        for mount in self.container["volumeMounts"]:
            volume, path = volumes[mount["name"]], mount["mountPath"]
            folder = os.path.join(self.folder, mount["name"])
            os.mkdir(folder)
            os.chmod(folder, 0o755)
            if "emptyDir" in volume:
                os.chown(folder, 0, self.group)
                os.chmod(folder, 0o2777)
                options.append(f"--volume={folder}:{path}")
                continue
            if "secret" in volume:
                secret = secrets[volume["secret"]["secretName"]]
                names = [each["key"] for each in volume["secret"].get("items", [])] or secret
                write_projected(folder, {name: secret[name] for name in names}, self.group, volume["secret"]["defaultMode"])
            else:
                write_projected(folder, self.files, self.group, 0o644)
            options.append(f"--volume={folder}:{path}:ro")
        return options

    def ask(self, path, **headers):
        """Status and body of an answer, over TLS; None where there is none."""
        connection = http.client.HTTPSConnection(self.address, self.port, timeout=10, context=ssl._create_unverified_context())
        try:
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        except OSError:
            return None
        finally:
            connection.close()

    def metric(self, name):
        """The sum of a metric over its labels."""
        return sum(float(line.rpartition(" ")[2]) for line in self.ask("/metrics")[1].splitlines() if line.startswith((f"{name} ", f"{name}{{")))

    def state(self):
        """As in running or exited, and the exit status."""
        state, status = self.docker.run("inspect", "--format", "{{.State.Status}} {{.State.ExitCode}}", self.name).split()
        return state, int(status)

    def log(self):
        done = self.docker.attempt("logs", self.name)
        return done.stdout + done.stderr

    def wait_until_ready(self):
        probe = self.container["readinessProbe"]["httpGet"]

        def is_ready():
            if self.state()[0] != "running":
                raise AssertionError(f"{self.name} has ended:\n{self.log()}")
            answer = self.ask(probe["path"])
            return answer and answer[0] == 200

        wait_until(is_ready, lambda: f"{self.name} is not ready:\n{self.log()}")

    def end(self):
        """Begins to end it, and returns a thread that ends with it: preStop first, then SIGTERM, as the kubelet does."""
        def work():
            self.docker.attempt("exec", self.name, *self.container["lifecycle"]["preStop"]["exec"]["command"])
            if self.state()[0] == "running":
                self.was_stopped = True
                self.docker.attempt("stop", "--time", "30", self.name)

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        return thread
