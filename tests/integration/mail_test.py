#!/usr/bin/python3
"""E-mails of the session server to a real SMTP server. Protocol sections 8.1 and 10, quirk Q3."""

import asyncio
import contextlib
import email.utils
import os
import re
import shutil
import socket
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.ports import free_port  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.servers import PATIENCE, SessionServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate, CompletionQueue
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

ADMINISTRATOR = "admin@example.org"
SENDER = "support@example.com"
FAILED = f"Error: unable to send email to {ADMINISTRATOR}: "


def session_server(machines, mail_port, trusted=None, **config):
    """A session server that mails to localhost; `trusted` is the file of the certificate authorities that it trusts."""
    mail = {"administrator": ADMINISTRATOR, "mailServer": "localhost", "mailServerPort": mail_port, "mailSender": SENDER}
    session = SessionServer([machine.address for machine in machines], loadThreshold=95, loadRefresh=0.2, **{**mail, **config})
    session.environment = {"SSL_CERT_FILE": trusted} if trusted else {}
    return session


def message(subject, sentence, session):
    """The mail as sent, with {} in place of what differs between mails."""
    return (f"Date: {{}}\r\nFrom: Simulation Server <{SENDER}>\r\nTo: Administrator <{ADMINISTRATOR}>\r\n"
            f"Subject: {subject}\r\nMessage-ID: <{{}}>\r\nMIME-Version: 1.0\r\nContent-Type: text/plain; charset=utf-8\r\n"
            "Content-Transfer-Encoding: 7bit\r\nAuto-Submitted: auto-generated\r\n\r\n"
            f"Hello,\r\n\r\n{sentence}\r\nCheck it at http://localhost:{session.port}/monitor\r\n\r\n-Simulation Server\r\n")


class Mails(unittest.TestCase):
    def check_message(self, mail, subject, sentence, session):
        """The whole message, byte for byte; returns its id."""
        content = mail.content.decode("ascii")
        date = re.match(r"Date: ([^\r\n]*)\r\n", content).group(1)
        identity = re.search(r"\r\nMessage-ID: <([^<>\s]+@example\.com)>\r\n", content).group(1)
        self.assertEqual(content, message(subject, sentence, session).format(date, identity))
        age = time.time() - email.utils.parsedate_to_datetime(date).timestamp()
        self.assertTrue(-5 < age < 300, date)
        self.assertEqual((mail.sender, mail.recipients), (SENDER, [ADMINISTRATOR]))
        return identity

    def test_each_change_is_one_plain_mail_instead_of_a_log_line(self):
        with Machine() as falling, Machine() as filling, CompletionQueue() as mailbox, \
                session_server([falling, filling], mailbox.port) as session:
            wait_until(lambda: len(falling.polls) and len(filling.polls) and session.get("/") == "1", "up")
            falling.status = 500
            wait_until(lambda: len(mailbox.mails) == 1, "not responding")
            falling.status, falling.load = 200, "7"
            wait_until(lambda: len(mailbox.mails) == 2, "working again")
            filling.load = "99.5"
            wait_until(lambda: len(mailbox.mails) == 3, "reached maximum")
            filling.load = "12"
            wait_until(lambda: len(mailbox.mails) == 4, "available again")
            expected = [
                ("Simulation server not responding", f"{falling.address} simulation server may be down, as it is not responding "
                                                     "to the requests of the session server..."),
                ("Simulation server working again", f"{falling.address} simulation server is up and running again (load = 7.0%)."),
                ("Simulation server reached maximum load", f"{filling.address} simulation server has reached maximum load (99.5%)."),
                ("Simulation server available again", f"{filling.address} simulation server is available again (load = 12.0%)."),
            ]
            identities = {self.check_message(mail, *words, session) for mail, words in zip(mailbox.mails, expected)}
            self.assertEqual(len(identities), 4)
            self.assertEqual({(mail.encrypted, mail.login, mail.greeted_as) for mail in mailbox.mails},
                             {(False, None, "localhost")})
            self.assertNotIn("simulation server", session.log())

    def test_a_machine_that_is_merely_slow_is_logged_and_not_mailed(self):
        with Machine() as machine, CompletionQueue() as mailbox, session_server([machine], mailbox.port, loadTimeout=0.3) as session:
            wait_until(lambda: session.get("/") == "1", "up")
            machine.answers.clear()
            wait_until(lambda: "is taking too long to respond (assuming 100% load)" in session.log(), "the log line")
            machine.answers.set()
            wait_until(lambda: mailbox.mails, "working again")
            self.assertIn(b"Subject: Simulation server working again", mailbox.mails[0].content)

    def test_without_an_administrator_changes_are_logged(self):
        with Machine("99") as machine, CompletionQueue() as mailbox, session_server([machine], mailbox.port, administrator="") as session:
            wait_until(lambda: "has reached maximum load (99.0%)" in session.log(), "the log line")
        self.assertEqual(mailbox.mails, [])

    def test_the_mail_library_is_loaded_where_there_is_an_administrator_and_nowhere_else(self):
        def loads_libcurl(session):
            with open(f"/proc/{session.process.pid}/maps") as maps:
                return "libcurl" in maps.read()
        with Machine() as machine, session_server([machine], free_port()) as mailing, \
                session_server([machine], free_port(), administrator="") as silent:
            self.assertTrue(loads_libcurl(mailing))
            self.assertFalse(loads_libcurl(silent))

    def test_without_the_mail_library_it_does_not_start_and_systemd_does_not_try_again(self):
        with contextlib.closing(session_server([], free_port())) as session:
            folder = os.path.dirname(session.configure())  # the server may read there
            with open(os.path.join(folder, "libcurl.so.4"), "w"):
                session.environment = {"LD_LIBRARY_PATH": folder}
            status, said = session.command()
        self.assertEqual(status, 2, said)
        self.assertIn("e-mail needs libcurl (package libcurl4): ", said)

    def test_an_administrator_without_a_sender_is_dropped_with_a_line(self):
        with Machine("99") as machine, CompletionQueue() as mailbox, session_server([machine], mailbox.port, mailSender="") as session:
            wait_until(lambda: "has reached maximum load (99.0%)" in session.log(), "the log line")
            self.assertIn('key "administrator" is ignored: no e-mails without "mailSender"', session.log())
        self.assertEqual(mailbox.mails, [])

    def test_a_flapping_machine_is_two_mails_and_a_digest_in_the_end(self):
        with Machine() as machine, CompletionQueue() as mailbox, session_server([machine], mailbox.port) as session:
            wait_until(lambda: session.get("/") == "1", "up")
            for _ in range(4):
                machine.status = 500
                wait_until(lambda: session.get("/") == "0", "down")
                machine.status = 200
                wait_until(lambda: session.get("/") == "1", "up")
            wait_until(lambda: len(mailbox.mails) == 2, "the first two")
            self.assertEqual(session.stop(), 0)
            self.assertEqual(len(mailbox.mails), 3)
            self.assertEqual(mailbox.mails[-1].content.count(b" UTC "), 6)
            self.assertNotIn("not sent", session.log())


@unittest.skipUnless(shutil.which("openssl"), "the program openssl is missing")
class Logins(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="webots_cloud_mail_")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.tls = Certificate(cls.folder.name)
        cls.users = {SENDER: "s3cret pässword", "robot": "other"}

    def refused(self, mailbox, reason, trusted=True, password="s3cret pässword"):
        """Checks that a mail is never sent, and the reason in the log."""
        with Machine("99") as machine, mailbox, \
                session_server([machine], mailbox.port, self.tls.authority if trusted else None,
                               mailSenderPassword=password) as session:
            wait_until(lambda: FAILED in session.log(), "the failure")
            line = next(line for line in session.log().splitlines() if FAILED in line)
            self.assertRegex(line, reason)
            self.assertNotIn(password, session.log())
        self.assertEqual(mailbox.mails, [])

    def test_a_password_turns_on_starttls_and_the_login_of_the_sender(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls, users=self.users) as mailbox, \
                session_server([machine], mailbox.port, self.tls.authority, mailSenderPassword="s3cret pässword") as session:
            wait_until(lambda: mailbox.mails, "the mail")
            self.assertEqual(mailbox.logins, [(SENDER, "s3cret pässword", True)])
            self.assertTrue(mailbox.mails[0].encrypted)
            self.assertIn(b"Subject: Simulation server reached maximum load\r\n", mailbox.mails[0].content)
            self.assertNotIn(FAILED, session.log())

    def test_the_login_may_be_another_one(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls, users=self.users) as mailbox, \
                session_server([machine], mailbox.port, self.tls.authority, mailSenderUser="robot", mailSenderPassword="other"):
            wait_until(lambda: mailbox.mails, "the mail")
            self.assertEqual(mailbox.logins, [("robot", "other", True)])
            self.assertEqual(mailbox.mails[0].sender, SENDER)

    def test_without_a_password_starttls_is_not_used_even_if_it_is_offered(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls) as mailbox, session_server([machine], mailbox.port):
            wait_until(lambda: mailbox.mails, "the mail")
            self.assertFalse(mailbox.mails[0].encrypted)

    def test_no_password_is_sent_to_a_mail_server_whose_certificate_is_not_trusted(self):
        mailbox = CompletionQueue(tls=self.tls, users=self.users)
        self.refused(mailbox, "certificate", trusted=False)
        self.assertEqual(mailbox.logins, [])

    def test_no_password_is_sent_without_tls(self):
        mailbox = CompletionQueue(users=self.users)
        self.refused(mailbox, "STARTTLS")
        self.assertEqual(mailbox.logins, [])

    def test_a_wrong_password_is_a_refusal(self):
        self.refused(CompletionQueue(tls=self.tls, users=self.users), "535", password="wrong")

    def test_a_mail_server_without_logins_gets_no_mail_in_spite_of_the_password(self):
        self.refused(CompletionQueue(tls=self.tls), "offers no login")


class Trouble(unittest.TestCase):
    """A mail server that is down, slow or refuses costs a line of the log, never availability (quirk Q3)."""

    def check_availability(self, session, machine):
        """The machine fails and recovers, and browsers are notified."""
        wait_until(lambda: session.get("/") == "1", "up")
        machine.status = 500
        wait_until(lambda: session.get("/") == "0", "a dead machine stays available")
        self.assertTrue(session.get("/session").startswith("Error:"))
        machine.status = 200
        wait_until(lambda: session.get("/") == "1", "up again")

    def test_a_mail_server_that_is_absent_gets_the_mails_when_it_is_back(self):
        port = free_port()
        with Machine() as machine, session_server([machine], port) as session:
            self.check_availability(session, machine)
            wait_until(lambda: FAILED in session.log(), "the failure")
            with CompletionQueue(port=port) as mailbox:
                wait_until(lambda: len(mailbox.mails) == 2, "the retries", patience=120)
                wait_until(lambda: f"Emails to {ADMINISTRATOR} are sent again" in session.log(), "the line")
            self.assertIn(b"not responding", mailbox.mails[0].content)
            self.assertIn(b"up and running again", mailbox.mails[1].content)
            self.assertEqual(session.log().count(FAILED), 1)

    def test_a_mail_server_that_refuses_costs_one_line_that_quotes_it(self):
        with Machine() as machine, CompletionQueue(refusal="550 no such mailbox here") as mailbox, \
                session_server([machine], mailbox.port) as session:
            self.check_availability(session, machine)
            wait_until(lambda: FAILED in session.log(), "the failure")
            self.assertIn(FAILED + 'the mail server answered "550 no such mailbox here"', session.log())
            self.assertEqual(session.log().count(FAILED), 1)

    def test_a_mail_server_that_hangs_delays_nobody_not_even_the_end(self):
        with Machine() as machine, socket.create_server(("127.0.0.1", 0)) as hanging, \
                session_server([machine], hanging.getsockname()[1]) as session:
            self.check_availability(session, machine)
            hanging.settimeout(30)
            connection, _ = hanging.accept()  # it has connected, and waits for a greeting
            with connection:
                self.assertEqual(session.stop(), 0)
                self.assertEqual(connection.recv(100), b"")
            self.assertEqual(session.log().count("not sent (the session server ends)"), 2)
            self.assertNotIn(FAILED, session.log())

    def test_a_mail_server_that_is_slow_gets_its_mail_while_browsers_are_told(self):
        let_go = threading.Event()

        async def pause():
            await asyncio.to_thread(let_go.wait, PATIENCE)

        with Machine() as machine, CompletionQueue(pause=pause) as mailbox, session_server([machine], mailbox.port) as session:
            self.check_availability(session, machine)
            self.assertEqual(mailbox.mails, [])
            let_go.set()
            wait_until(lambda: len(mailbox.mails) == 2, "the mails")
            self.assertNotIn(FAILED, session.log())


if __name__ == "__main__":
    main()
