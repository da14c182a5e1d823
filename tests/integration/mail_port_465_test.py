#!/usr/bin/python3
"""Mails to the port where TLS begins at once (RFC 8314). In a network of its own, since the number of that port is what says so."""

import os
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate, CompletionQueue
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

SENDER = "support@example.com"


@unittest.skipUnless(shutil.which("openssl"), "the program openssl is missing")
class Port465(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="webots_cloud_mail_"))
        cls.tls = Certificate(folder)

    def session(self, machine, trusted=True, **config):
        session = SessionServer([machine.address], loadThreshold=95, loadRefresh=0.2, administrator="admin@example.org", mailServer="localhost",
                                mailServerPort=465, mailSender=SENDER, **config)
        session.environment = {"SSL_CERT_FILE": self.tls.authority} if trusted else {}
        return session

    def test_a_mail_is_sent_after_a_login(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls, users={SENDER: "s3cret"}, port=465, at_once=True) as mailbox, \
                self.session(machine, mailSenderPassword="s3cret") as session:
            wait_until(lambda: mailbox.mails, lambda: f"no mail: {session.log()}")
            self.assertEqual([login[:2] for login in mailbox.logins], [(SENDER, "s3cret")])
            self.assertIn(b"Subject: Simulation server reached maximum load\r\n", mailbox.mails[0].content)
            self.assertNotIn("unable to send email", session.log())

    def test_a_mail_is_sent_without_a_login(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls, port=465, at_once=True) as mailbox, self.session(machine) as session:
            wait_until(lambda: mailbox.mails, lambda: f"no mail: {session.log()}")

    def test_nothing_is_told_to_a_server_whose_certificate_is_not_trusted(self):
        for password in ({}, {"mailSenderPassword": "s3cret"}):
            with self.subTest(**password), Machine("99") as machine, \
                    CompletionQueue(tls=self.tls, users={SENDER: "s3cret"} if password else None, port=465, at_once=True) as mailbox, \
                    self.session(machine, trusted=False, **password) as session:
                wait_until(lambda: "unable to send email" in session.log(), lambda: f"no complaint: {session.log()}")
                self.assertIn("certificate", session.log())
                self.assertEqual((mailbox.mails, mailbox.logins), ([], []))

    def test_a_server_without_logins_gets_no_mail_in_spite_of_the_password(self):
        with Machine("99") as machine, CompletionQueue(tls=self.tls, port=465, at_once=True) as mailbox, \
                self.session(machine, mailSenderPassword="s3cret") as session:
            wait_until(lambda: "offers no login" in session.log(), lambda: f"no complaint: {session.log()}")
            self.assertEqual(mailbox.mails, [])


if __name__ == "__main__":
    own_network.enter()
    main()
