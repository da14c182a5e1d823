"""A Slurm cluster for tests: slurmctld and two slurmd on this machine, with a munge key of their own, all below one folder.

    with Cluster() as cluster, server(launcher={"slurm": {}}, environment=cluster.environment) as simulation:
        ...

Both nodes are this machine, at two addresses of the loopback. Nothing needs systemd or control groups. Without root or without Slurm:
SkipTest. With `hidden` they are as machines that share no folder: each sees an empty one in its place, and has a small disk of its own at
`own_folder`.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from .ports import free_port
from .processes import Startable, end_with_parent, required_program
from .servers import end
from .waiting import wait_until

NODES = ("node1", "node2")

CONFIGURATION = """
ClusterName=webots_cloud_test
SlurmctldHost=localhost
SlurmctldPort={control_port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=2,sched_interval=2
PreemptType=preempt/partition_prio
PreemptMode=CANCEL
ReturnToService=2
SlurmdTimeout={node_timeout}
MessageTimeout=10
KillWait=5
CompleteWait=0
MinJobAge=300
GresTypes=gpu
{nodes}
PartitionName=robots Nodes=ALL Default=YES PriorityTier=1 GraceTime=0 State=UP
PartitionName=urgent Nodes=ALL PriorityTier=10 PreemptMode=OFF State=UP
"""

NODE = "NodeName={name} NodeHostname=localhost NodeAddr={address} Port={port} CPUs={processors} RealMemory={memory} Gres=gpu:1 State=UNKNOWN"
# What is no graphics processor, but looks like the device of one to Slurm.
GRES = "NodeName={names} Name=gpu File=/dev/null\n"
WITHOUT_SHARED_FOLDER = ("unshare", "--mount", "--propagation", "private", "sh", "-c",
                         'mount -t tmpfs none "$1" && mount -t tmpfs -o "size=$2" none "$3" && shift 3 && exec "$@"', "sh")


class Cluster(Startable):
    """`processors`: of each of the two nodes, however many this machine has. `hidden`: a folder that only the server sees."""

    def __init__(self, processors=2, node_timeout=30, hidden=None, disk="32m"):
        self.folder = None
        self.hidden = hidden
        self.disk = disk
        self.processors = processors
        self.node_timeout = node_timeout
        self.daemons = {}

    @property
    def environment(self):
        return {"SLURM_CONF": os.path.join(self.folder, "slurm.conf")}

    @property
    def own_folder(self):
        return os.path.join(self.folder, "of_each_node")

    def start(self):
        for name, package in (("slurmctld", "slurmctld"), ("slurmd", "slurmd"), ("srun", "slurm-client"), ("munged", "munge")):
            required_program(name, package)
        if os.geteuid() != 0:
            raise unittest.SkipTest("slurmd needs root")
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_slurm_", dir="/tmp")
        os.chmod(self.folder, 0o755)
        for name in ("state", *(f"spool-{node}" for node in NODES)):
            os.mkdir(os.path.join(self.folder, name))
        os.mkdir(self.own_folder)
        with open(os.path.join(self.folder, "gres.conf"), "w") as file:
            file.write(GRES.format(names=",".join(NODES)))
        ports = free_port(len(NODES))
        nodes = [NODE.format(name=name, address=f"127.0.0.{number + 2}", port=ports + 1 + number, processors=self.processors, memory=1000)
                 for number, name in enumerate(NODES)]
        with open(self.environment["SLURM_CONF"], "w") as file:
            file.write(CONFIGURATION.format(folder=self.folder, control_port=ports, nodes="\n".join(nodes), node_timeout=self.node_timeout))
        self._start_munge()
        self.start_controller()
        for node in NODES:
            self.start_node(node)
        wait_until(lambda: self.run("sinfo", "-h", "-t", "idle", "-N", "-p", "robots", "-o", "%N").split() == list(NODES), self.log)

    def _start_munge(self):
        key = os.path.join(self.folder, "munge.key")
        with open(key, "wb") as file:
            file.write(os.urandom(128))
        os.chmod(key, 0o400)
        socket = os.path.join(self.folder, "munge.socket")
        self._start("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={socket}",
                    f"--pid-file={self.folder}/munge.pid", f"--log-file={self.folder}/munged.log", f"--seed-file={self.folder}/munge.seed")
        wait_until(lambda: os.path.exists(socket), self.log)

    def _start(self, program, *arguments, name=None, wrapper=()):
        with open(os.path.join(self.folder, "daemons.log"), "ab") as log:
            self.daemons[name or program] = subprocess.Popen(
                [*wrapper, required_program(program, program), *arguments], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                env={**os.environ, **self.environment}, cwd=self.folder, preexec_fn=end_with_parent)

    def start_controller(self):
        self._start("slurmctld", "-D")

    def stop_controller(self):
        end(self.daemons["slurmctld"])

    def start_node(self, node):
        """Its configured processors, not those of this machine (-N is one of several on it)."""
        wrapper = (*WITHOUT_SHARED_FOLDER, self.hidden, self.disk, self.own_folder) if self.hidden else ()
        self._start("slurmd", "-D", "-N", node, name=node, wrapper=wrapper)

    def seen_by(self, node, path):
        """Where we find what a node has at this path."""
        return f"/proc/{self.daemons[node].pid}/root{path}"

    def stop_node(self, node):
        """As in a machine that loses its power: its daemon and all steps of jobs there."""
        self.daemons[node].kill()
        self.daemons[node].wait()
        for step in self.steps(node):
            os.kill(step, signal.SIGKILL)

    def steps(self, node=""):
        """The processes of ours that watch over jobs on a node; they write into its log."""
        found = []
        for entry in os.listdir("/proc"):
            with contextlib.suppress(OSError):
                with open(f"/proc/{entry}/comm") as name:
                    if name.read().strip() != "slurmstepd":
                        continue
                files = [os.readlink(f"/proc/{entry}/fd/{number}") for number in os.listdir(f"/proc/{entry}/fd")]
                if any(file.startswith(f"{self.folder}/slurmd-{node}") for file in files):
                    found.append(int(entry))
        return found

    def run(self, program, *arguments):
        """What one of Slurm's programs prints."""
        done = subprocess.run([program, *arguments], env={**os.environ, **self.environment}, capture_output=True, text=True, timeout=60)
        return done.stdout

    def jobs(self):
        """The names of all jobs that wait, run or end."""
        return self.run("squeue", "-h", "-o", "%j").split()

    def wait_until_empty(self):
        wait_until(lambda: not self.jobs(), lambda: f"jobs are left: {self.run('squeue')}\n{self.log()}")

    def log(self):
        text = ""
        for name in sorted(os.listdir(self.folder)):
            if name.endswith(".log"):
                with open(os.path.join(self.folder, name), errors="replace") as file:
                    text += f"==> {name}\n" + "".join(file.readlines()[-40:])
        return re.sub(r"\n{2,}", "\n", text)

    def close(self):
        if not self.folder:
            return
        for name in (*NODES, "slurmctld", "munged"):
            if name in self.daemons:
                end(self.daemons[name])
        for step in self.steps():
            os.kill(step, signal.SIGKILL)
        shutil.rmtree(self.folder, ignore_errors=True)
