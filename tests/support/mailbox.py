"""A mail server for tests, which keeps mails and how they were sent."""

import os
import ssl
import subprocess

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult

from .ports import free_port


class Mail:
    """One mail, and the SMTP dialogue that delivered it."""

    def __init__(self, session, envelope, login):
        self.sender = envelope.mail_from
        self.recipients = envelope.rcpt_tos
        self.content = envelope.content
        self.greeted_as = session.host_name
        self.encrypted = session.ssl is not None
        self.login = login


class CompletionQueue:
    """Listens on the loopback. `tls` is a Certificate: then STARTTLS is offered. `users` maps logins to passwords.

    `at_once`: TLS begins with the first byte. `refusal` is what RCPT is answered with; `pause` an awaitable function that is called before a mail is taken.
    """

    def __init__(self, tls=None, users=None, refusal=None, pause=None, port=0, at_once=False):
        self.mails = []
        self.logins = []  # that were tried
        self.refusal = refusal
        self.pause = pause
        self.users = users or {}
        self.port = port or free_port()
        options = {"ssl_context" if at_once else "tls_context": tls.context()} if tls else {}
        if at_once:
            options["auth_require_tls"] = False  # it looks for STARTTLS
        if users:
            options.update(authenticator=self._authenticate, auth_required=True)
        self.controller = Controller(self, hostname="127.0.0.1", port=self.port, ready_timeout=30, **options)

    def __enter__(self):
        self.controller.start()
        return self

    def __exit__(self, *_):
        self.controller.stop()

    def _authenticate(self, server, session, envelope, mechanism, data):
        login, password = data.login.decode(), data.password.decode()
        self.logins.append((login, password, session.ssl is not None))
        return AuthResult(success=self.users.get(login) == password, handled=False)

    async def handle_EHLO(self, server, session, envelope, hostname, responses):
        session.host_name = hostname
        return [line for line in responses if self.users or "AUTH" not in line]

    async def handle_RCPT(self, server, session, envelope, address, options):
        if self.refusal:
            return self.refusal
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server, session, envelope):
        if self.pause:
            await self.pause()
        self.mails.append(Mail(session, envelope, self.logins[-1][0] if self.logins else None))
        return "250 taken"


class Certificate:
    """A certificate for localhost that its own authority signed, made in `folder` with openssl."""

    def __init__(self, folder):
        self.authority = os.path.join(folder, "authority.pem")
        self.certificate = os.path.join(folder, "certificate.pem")
        self.key = os.path.join(folder, "key.pem")
        authority_key, request, extensions = (os.path.join(folder, name) for name in ("ca_key.pem", "request.pem", "extensions"))
        with open(extensions, "w") as file:
            file.write("subjectAltName=DNS:localhost\n")
        key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
        for command in (["req", "-x509", *key, "-days", "2", "-subj", "/CN=test authority", "-addext", "keyUsage=critical,keyCertSign",
                         "-keyout", authority_key, "-out", self.authority],
                        ["req", *key, "-subj", "/CN=localhost", "-keyout", self.key, "-out", request],
                        ["x509", "-req", "-in", request, "-CA", self.authority, "-CAkey", authority_key, "-CAcreateserial",
                         "-days", "2", "-extfile", extensions, "-out", self.certificate]):
            subprocess.run(["openssl", *command], check=True, capture_output=True)

    def context(self):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(self.certificate, self.key)
        return context
