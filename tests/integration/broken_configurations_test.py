#!/usr/bin/python3
"""What operators get wrong, a row each: what `--check-config` and `--doctor` say of it, and whether the server starts. They say it of what is
broken and of nothing else.

The twin: the Python servers have nothing like it.
"""

import os
import re
import socket
import sys
import typing
import unittest
from contextlib import closing

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.certificates import Authority, openssl, self_signed  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.examination import Examination  # noqa: E402
from support.mailbox import CompletionQueue  # noqa: E402
from support.name_server import HangingNames  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SimulationServer, main  # noqa: E402

NOBODY = "r" * 64 + ".example.org"  # too long for any name server, so that none is asked
EVIL = "\x1b]0;title\x07\x1b[2J\u009b31m"  # which would steer a terminal


class Broken(typing.NamedTuple):
    """A row. Texts may name attributes of the trial, as in `{port}`; in what is told `{at}` is where a key stands, and "…" other words."""

    breaks: typing.Callable  # what is done for it; returns the keys that differ from those of a good configuration
    server: str
    told: str  # by --check-config, in a line, and nothing else; empty: nothing
    is_error: bool  # whether that ends with status 2, and not with a warning
    finding: tuple  # of the doctor: subject, verdict, and words if they are not those above; empty: everything is good
    starts: bool


BROKEN = []


def broken(*servers, told="", error=False, finding=(), starts=None):
    """`starts`: the servers that start, where these are not all without an error, and none with one."""
    def add(breaks):
        for server in servers:
            BROKEN.append(Broken(breaks, server, told, error, finding, not error if starts is None else server in starts))
        return breaks
    return add


ERROR = ("configuration", "fault")  # what keeps a server from starting is this finding of the doctor
REMARK = ("configuration", "warning")


# Ports and addresses.

@broken("session", "simulation", told="port {port}: another program, or a server of another user, listens there. End it",
        finding=("port {port}", "fault", "listens there"), starts=())
def a_port_that_another_program_has(trial):
    trial.enterContext(closing(socket.create_server(("127.0.0.1", trial.port))))
    return {}


@broken("simulation", told="ports from {next_port}: 2 of the 3 ports for simulators are free. ",
        finding=("ports from {next_port}", "warning", "2 of the 3 ports"))
def a_port_of_simulators_that_another_program_has(trial):
    trial.enterContext(closing(socket.create_server(("0.0.0.0", trial.port + 2))))
    return {}


@broken("session", "simulation", told="port {port}: 203.0.113.7 is none of this machine", finding=("port {port}", "fault", "none of this machine"),
        starts=())
def an_address_of_another_machine(_):
    return {"listenAddress": "203.0.113.7"}


# Other hosts.

@broken("session", finding=("machine {nobody}", "fault", "refused"))
def a_machine_that_does_not_answer(trial):
    return {"simulationServers": [trial.nobody, trial.machine]}


@broken("simulation", finding=("forge", "fault", "{nobody} is not reached"))
def a_forge_that_nobody_runs(trial):
    return {"forges": [f"http://{trial.nobody}"]}


@broken("simulation", finding=("forge", "fault", "is not reached"))
def a_proxy_that_is_not_there(trial):
    trial.environment = {"http_proxy": f"http://{trial.nobody}", "no_proxy": ""}
    return {}


@broken("simulation", finding=("registry", "warning", "is not reached"))
def a_registry_that_is_not_there(trial):
    return {"notify": [f"http://{trial.nobody}/setup"]}


@broken("session", finding=("mail", "fault", "localhost"))
def a_mail_server_that_is_not_there(trial):
    return {"administrator": "a@example.org", "mailSender": "s@example.org", "mailServer": "localhost", "mailServerPort": int(trial.nobody.split(":")[1])}


@broken("session", finding=("mail", "fault", ""))
def a_mail_server_without_tls_for_a_password(trial):
    port = trial.enterContext(CompletionQueue()).port
    return {"administrator": "a@example.org", "mailSender": "s@example.org", "mailServer": "localhost", "mailServerPort": port, "mailSenderPassword": "secret"}


@broken("session", told=f"the name {NOBODY} can't be resolved", finding=("name server", "fault", f"the name {NOBODY} can't be resolved"))
def a_name_of_its_own_that_nobody_knows(_):
    return {"server": NOBODY}


@broken("session", told=f'key "simulationServers": the name {NOBODY} can\'t be resolved: ', finding=(f"machine {NOBODY}:2000", "fault", NOBODY))
def a_machine_whose_name_nobody_knows(_):
    return {"simulationServers": [f"{NOBODY}:2000"]}


@broken("simulation", told=f'key "forges": the name {NOBODY} can\'t be resolved: ', finding=("forge", "fault", "is not reached"))
def a_forge_whose_name_nobody_knows(_):
    return {"forges": [f"https://{NOBODY}"]}


@broken("simulation", told=f'key "notify": the name {NOBODY} can\'t be resolved: ', finding=("registry", "warning", "is not reached"))
def a_registry_whose_name_nobody_knows(_):
    return {"notify": [f"https://{NOBODY}/setup"]}


# Folders and files.

@broken("session", "simulation", told="key \"logDir\": nothing can be written to {file}/{server}: {file} is no folder. Let the user", error=True,
        finding=("logs", "fault", "is no folder"), starts={"simulation"})  # which moves aside what a simulation may have put there
def a_folder_for_logs_that_is_a_file(_):
    return {"logDir": "a_file"}


@broken("simulation", told='key "logDir": nothing can be written to', finding=("logs", "warning", "is no folder"))
def a_folder_for_logs_that_is_a_file_where_the_log_is_not_written(_):
    return {"logDir": "a_file", "debug": True}


@broken("simulation", told='key "stateDir": nothing can be written to', error=True, finding=("state", "fault", "is no folder"))
def a_folder_for_what_is_kept_that_can_not_be_made(_):
    return {"stateDir": "a_file/state"}


@broken("session", told='key "logDir": {folder}/disk/session (made at the start): the disk is full', finding=("logs", "fault", "the disk is full"))
def a_full_disk(trial):
    mount_small_disk(trial, trial.new_folder("disk"), "1m")
    return {"logDir": "disk"}


@broken("session", told="more files (inodes), whatever their size", finding=("logs", "fault", "more files (inodes)"))
def a_disk_without_inodes(trial):
    mount_small_disk(trial, trial.new_folder("disk"), "200m,nr_inodes=20")
    return {"logDir": "disk"}


@broken("simulation", told="XDG_CACHE_HOME: nothing can be written to", finding=("cache", "warning", "is no folder"))
def a_folder_for_the_cache_that_is_a_file(trial):
    trial.environment = {"XDG_CACHE_HOME": trial.file}
    return {}


@broken("simulation", told='key "projectsDir": there is no folder {folder}/nowhere: websites have no projects to start from', finding=REMARK)
def a_folder_of_projects_that_is_not_there(_):
    return {"projectsDir": "nowhere"}


@broken("simulation", told="key \"keyDir\": the folder {folder}/nowhere can't be read: No such file or directory. ",
        finding=('key "keyDir"', "warning", "can't be read"))
def a_folder_of_keys_that_is_not_there(_):
    return {"keyDir": "nowhere"}


@broken("session", "simulation", told='{at} key "operatorTokenFile": there is no file {folder}/nowhere: nobody is the operator', finding=REMARK)
def a_token_that_is_not_there_yet(_):
    return {"operatorTokenFile": "nowhere"}


@broken("session", told='{at} key "caFile": …{file}', error=True, finding=ERROR)
def a_file_of_authorities_with_none(trial):
    return {"caFile": trial.file}


@broken("session", "simulation", told='{at} key "sessionSecret": …{file}', error=True, finding=ERROR)
def a_file_of_a_secret_with_none(trial):
    return {"sessionSecret": trial.file}


@broken("session", "simulation", told='{at} key "sessionSecret": …/nowhere', error=True, finding=ERROR)
def a_secret_that_is_not_there(_):
    return {"sessionSecret": "/nowhere"}


@broken("session", told='{at} key "teacherPasswordFile": …{file}', error=True, finding=ERROR)
def a_file_of_a_password_with_none(trial):
    return {"teacherPasswordFile": trial.file}


@broken("session", told="{at} key \"teacherPasswordFile\": the teachers' password in password: others may read it too", error=True, finding=(*ERROR, "others may read it too"))
def a_password_that_others_may_read(trial):
    with open(os.path.join(trial.folder, "password"), "w") as words:
        words.write("abcd-efgh-ijkl\n")
    os.chmod(words.name, 0o644)
    return {"teacherPasswordFile": "password"}


# Certificates. A server starts with one that browsers refuse: it may be renewed while it runs.

def issued(trial, *names, trusted=True, **options):
    authority = Authority(trial.folder, "an authority")
    if trusted:
        trial.environment = {"SSL_CERT_FILE": authority.certificate}
    return authority.issue("own", *(names or ("DNS:localhost",)), **options)


def with_tls(trial, certificate, key):
    return {"ssl": True, "simulationServers": trial.inside, "sslCertificate": certificate, "sslKey": key}


@broken("session", told='{at} key "sslCertificate": it has expired on', finding=("certificate", "fault", "it has expired on"))
def a_certificate_that_has_expired(trial):
    return with_tls(trial, *issued(trial, days=-1))


@broken("session", told='{at} key "sslCertificate": for localhost, valid for 4 days. Renew it now', finding=("certificate", "warning", "valid for 4 days"))
def a_certificate_that_will_expire(trial):
    return with_tls(trial, *issued(trial, days=5))


@broken("session", told='{at} key "sslCertificate": it is for example.org, and not for localhost',
        finding=("certificate", "fault", "it is for example.org, and not for localhost"))
def a_certificate_for_another_host(trial):
    return with_tls(trial, *issued(trial, "DNS:example.org", days=60))


@broken("session", told='{at} key "sslCertificate": browsers will not believe it: unable to get local issuer certificate',
        finding=("certificate", "warning", "browsers will not believe it"))
def a_certificate_of_an_unknown_authority(trial):
    return with_tls(trial, *issued(trial, days=60, trusted=False))


@broken("session", told='{at} key "sslCertificate": its key has only 1024 bits, and browsers refuse it. Get one with', error=True,
        finding=("certificate", "fault", "its key has only 1024 bits"))
def a_key_of_1024_bits(trial):
    certificate, key = (os.path.join(trial.folder, name) for name in ("short.pem", "short_key.pem"))
    openssl("req", "-x509", "-newkey", "rsa:1024", "-nodes", "-days", "60", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
            "-keyout", key, "-out", certificate)
    return with_tls(trial, certificate, key)


@broken("session", told='{at} key "sslKey": the key {another_key} can\'t be used: it is not the key of the certificate', error=True,
        finding=("certificate", "fault", "it is not the key of the certificate"))
def a_key_of_another_certificate(trial):
    trial.another_key = self_signed(trial.folder, "DNS:localhost")[1]
    return with_tls(trial, issued(trial, days=60)[0], trial.another_key)


@broken("session", told='{at} key "sslKey": …expected a PEM file', error=True, finding=("certificate", "fault", "expected a PEM file"))
def a_key_that_is_none(trial):
    return with_tls(trial, issued(trial, days=60)[0], trial.file)


@broken("session", told='{at} key "sslCertificate": …expected a PEM file', error=True, finding=("certificate", "fault", "expected a PEM file"))
def a_certificate_that_is_none(trial):
    return with_tls(trial, trial.file, issued(trial, days=60)[1])


@broken("session", told='{at} key "sslCertificate": …nowhere.pem can\'t be used: No such file or directory', error=True, finding=("certificate", "fault", "No such file"))
def a_certificate_that_is_not_there(trial):
    return with_tls(trial, "nowhere.pem", issued(trial, days=60)[1])


@broken("session", told='{at} key "challengeFolder": there is no folder {folder}/nowhere', finding=REMARK)
def a_folder_for_the_answers_of_the_authority_that_is_not_there(trial):
    return {**with_tls(trial, *issued(trial, days=60)), "redirectPort": trial.port + 1, "challengeFolder": "nowhere"}


# What simulations run in.

@broken("simulation", told='{at} key "sandbox": bubblewrap is not installed, and the server does not start without it: apt install', error=True, finding=ERROR)
def a_sandbox_that_is_not_installed(trial):
    trial.environment = {"PATH": "/nowhere"}
    return {"sandbox": "bubblewrap"}


@broken("simulation", told='{at} key "sandbox": firejail is not installed, and the server does not start without it: apt install', error=True, finding=ERROR)
def another_sandbox_that_is_not_installed(trial):
    trial.environment = {"PATH": "/nowhere"}
    return {"sandbox": "firejail"}


@broken("simulation", told='{at} key "simulationUser": this machine has no user "nobody-here", and the server does not start without', error=True, finding=ERROR)
def a_user_of_simulations_that_is_not_there(_):
    return {"simulationUser": "nobody-here"}


@broken("simulation", told='{at} key "webotsHome": {folder}/webots is missing or not executable', error=True, finding=(*ERROR, "webotsHome"))
def webots_that_is_not_where_it_should_be(trial):
    return {"webotsHome": trial.folder}


# The text.

@broken("session", "simulation", told='unknown key "prot" is ignored; did you mean "port"?', finding=(*REMARK, '"prot"'))
def a_key_that_nobody_knows(_):
    return {"prot": 1}


@broken("simulation", told='unknown key "simulationServers" is ignored: it belongs into the configuration of webots-session-server', finding=REMARK)
def a_key_of_the_other_server(_):
    return {"simulationServers": ["localhost:2000"]}


@broken("session", "simulation", told='key "pingTimeout": expected 0, or a number', error=True, finding=ERROR)
def a_value_of_another_type(_):
    return {"pingTimeout": "x"}


@broken("session", "simulation", told="not JSON", error=True, finding=(*ERROR, "not JSON"))
def what_is_no_json(_):
    return {"text": EVIL}


# What would steer a terminal.

@broken("session", "simulation", told='key "server": expected', error=True, finding=ERROR)
def a_name_of_control_characters(_):
    return {"server": EVIL}


@broken("session", "simulation", told="unknown key", finding=REMARK)
def a_key_of_control_characters(_):
    return {EVIL: 1}


@broken("simulation", told="without control characters", error=True, finding=ERROR)
def a_folder_of_control_characters(_):
    return {"forges": [{"url": "local:", "directory": EVIL}]}


@broken("simulation", told="without control characters", error=True, finding=ERROR)
def a_forge_of_control_characters(_):
    return {"forges": [{"url": EVIL, "directory": "nowhere"}]}


@broken("simulation", told='key "dockerDir": expected a path without control characters', error=True, finding=ERROR)
def templates_in_a_folder_of_control_characters(_):
    return {"dockerDir": EVIL}


@broken("simulation", told='key "sslCertificate": expected a path without control characters…', error=True, finding=ERROR)
def a_certificate_of_control_characters(_):
    return {"sslCertificate": EVIL, "sslKey": "k"}


@broken("session", told='key "mailSenderUser": expected', error=True, finding=ERROR)
def a_user_with_a_command(_):
    return {"mailSenderUser": "a\r\nQUIT"}


@broken("simulation", told='key "blockedRepositories": expected', error=True, finding=ERROR)
def a_list_with_control_characters(_):
    return {"blockedRepositories": [EVIL]}


@broken("session", told="entry 1: expected", error=True, finding=ERROR)
def a_machine_of_control_characters(_):
    return {"simulationServers": [EVIL]}


@broken("session", told='key "mailSenderPassword": expected a string without control characters, found something else', error=True, finding=ERROR)
def a_password_with_a_command(_):
    return {"mailSenderPassword": "secret\r\nQUIT"}


@broken("session", told="\\x1b]0;title\\x07\\x1b[2J\\xc2\\x9b31m/c can't be used", error=True, finding=("certificate", "fault", "\\x1b]0;title"))
def control_characters_from_the_environment(trial):
    trial.environment = {"EVIL_FOLDER": EVIL}
    return {"ssl": True, "simulationServers": trial.inside, "sslCertificate": "$EVIL_FOLDER/c", "sslKey": "k"}


@broken("simulation", told="there is no folder", finding=(*REMARK, "\\x1b]0;title"))
def a_folder_from_the_environment(trial):
    trial.environment = {"EVIL_FOLDER": EVIL}
    return {"forges": [trial.forge, {"url": "local:", "directory": "$EVIL_FOLDER"}]}


class Rows(Examination):
    """A test for each row, which are made below."""

    def setUp(self):
        super().setUp()
        self.file = os.path.join(self.folder, "a_file")
        open(self.file, "w").close()
        self.nobody = f"localhost:{free_port()}"

    def new_folder(self, name):
        os.mkdir(os.path.join(self.folder, name))
        return os.path.join(self.folder, name)

    def with_attributes(self, text):
        return text.format(**vars(self), next_port=self.port + 1, server=self.SERVER, at="\0")

    def pattern_of(self, told):
        return re.escape(self.with_attributes(told)).replace("\0", r"c\.json:1:[0-9]+:").replace("…", ".*")

    def try_row(self, row):
        self.SERVER = row.server
        keys = row.breaks(self)
        status, said = self.check(**keys)
        self.assertEqual((status, said.count("\n")), (2 if row.is_error else 0, 1 if row.told else 0), said)
        self.assertRegex(said, self.pattern_of(row.told) or "^$")
        self.assertEqual(": warning: " in said, bool(row.told) and not row.is_error, said)

        found = {name: each for name, each in self.findings(**keys).items() if each["verdict"] != "ok" and name != "simulator"}  # it may be the demo
        subject, verdict, *words = map(self.with_attributes, row.finding or ("", ""))
        self.assertEqual({name: each["verdict"] for name, each in found.items()}, {subject: verdict} if subject else {}, found)
        for each in words:
            self.assertIn(each, found[subject]["found"])
        if subject and (subject, verdict) != REMARK:  # which says all in one sentence
            self.assertNotEqual(found[subject]["remedy"], "")

        is_ready, log = self.starts(**keys)
        self.assertEqual(is_ready, row.starts, log)


for each in BROKEN:
    setattr(Rows, f"test_{each.server}_{each.breaks.__name__}", lambda self, row=each: self.try_row(row))


class Others(Examination):
    """What is no row: nothing is wrong, too much is, or a server runs."""

    def test_nothing_is_said_of_a_good_one_and_nothing_is_made(self):
        for self.SERVER in ("session", "simulation"):
            self.assertEqual(self.check(), (0, ""))
        self.assertEqual(os.listdir(self.folder), ["c.json"])

    def test_nothing_is_said_of_other_good_ones(self):
        self.assertEqual(self.check(**with_tls(self, *issued(self, days=60))), (0, ""))
        self.SERVER = "simulation"
        for key in ("projectsDir", "keyDir"):
            self.assertEqual(self.check(**{key: self.folder}), (0, ""))
        for user in ("auto", "subordinate", "nobody"):
            self.assertEqual(self.check(simulationUser=user), (0, ""))
        self.environment = {"PATH": "/nowhere"}
        self.assertEqual(self.check(sandbox="auto"), (0, ""))
        self.environment = {"TMPDIR": "/nowhere", "HOME": ""}
        self.assertEqual(self.check(), (0, ""))

    @unittest.skipUnless(os.geteuid() == 0, "only root can be another user")
    def test_a_folder_of_somebody_else(self):
        os.chmod(self.folder, 0o755)
        self.wrapper = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")
        status, said = self.check()
        self.assertEqual(status, 2, said)
        self.assertIn('key "logDir": nothing can be written to', said)
        self.assertIn("Permission denied", said)

    def test_a_server_that_runs_has_its_ports(self):
        with SimulationServer(forges=["http://localhost:1"]) as running:
            status, output = running.command("--check-config")
            self.assertEqual(status, 0, output)
            self.assertNotIn("port", output.replace(".json: good", ""))

    def test_a_session_server_of_this_machine_says_how_pages_from_disk_get_in(self):
        line = """Webots' own page is refused when it is opened from disk. To let such pages in, add this line: "allowedOrigins": ["null", "https://webots.cloud"]\n"""
        for keys, note in (({}, line), ({"allowedOrigins": ["null", "https://webots.cloud"]}, ""), ({"server": "sim.example.org"}, "")):
            status, output, _ = self.ask("--check-config", **keys)
            self.assertEqual((status, output), (0, f"c.json: good\n{note}"))

    def test_thousands_of_names_are_told_in_a_dozen_lines(self):
        status, said = self.check(simulationServers=[f"{i:04}{NOBODY}:2000" for i in range(3000)])
        self.assertEqual((status, said.count("\n")), (0, 11), said)
        self.assertIn("names: 2990 more are not found", said)

    @unittest.skipUnless(os.geteuid() == 0, "only root can have a name server of its own")
    def test_a_name_server_that_says_nothing(self):
        with HangingNames() as names:
            self.wrapper = names.wrapper
            status, said = self.check(simulationServers=[f"sim{i}.example.org:2000" for i in range(100)])
            self.assertEqual((status, said.count("\n")), (0, 1), said)
            self.assertIn("names: no name server has answered in time for 100 of 101 names. Check /etc/resolv.conf", said)
            found = [each for each in self.findings(server="sim.example.org").values() if each["verdict"] != "ok"]
            self.assertEqual([(each["subject"], each["verdict"], each["found"]) for each in found],
                             [("name server", "fault", "the name sim.example.org can't be resolved: no answer in time")])
            self.assertNotEqual(found[0]["remedy"], "")

    def test_folders_of_containers_do_not_steer_the_terminal(self):
        self.SERVER, self.environment = "simulation", {"EVIL_FOLDER": EVIL}
        status, said = self.check(docker=True, sandbox="docker", dockerDir="$EVIL_FOLDER")
        self.assertEqual(status, 2, said)
        self.assertIn("no simulation can start, since there is no docker-compose", said)

    def test_a_start_without_its_log_says_so_in_one_line(self):
        status, output, said = self.ask(logDir="/proc/nowhere")
        self.assertEqual((status, (output + said).count("\n")), (2, 1), output + said)

    def test_names_of_files_and_options_do_not_steer_the_terminal(self):
        self.name = f"{EVIL}.json"
        for keys, status in (({}, 0), ({"server": 5}, 2), ({"text": "{"}, 2)):
            found, *said = self.ask("--check-config", **keys)
            self.assertEqual(found, status)
            self.assertIn("\\x1b]0;title", "".join(said))
        for options in (["--log-format", EVIL], [f"--{EVIL}"]):
            status, _, said = self.ask(*options)
            self.assertEqual(status, 2)
            self.assertIn("\\x1b]0;title", said)


if __name__ == "__main__":
    main()
