"""Certificate authorities of tests, and the certificates that they sign, made with openssl; and what clients of TLS say."""

import contextlib
import datetime
import os
import ssl
import subprocess

KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")


def openssl(*arguments):
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)


class Authority:
    """`certificate` is its own."""

    def __init__(self, folder, name):
        self.folder = os.path.join(folder, name.replace(" ", "_"))
        os.mkdir(self.folder)
        self.certificate, self.key = (os.path.join(self.folder, file) for file in ("authority.pem", "authority_key.pem"))
        openssl("req", "-x509", *KEY, "-days", "2", "-subj", f"/CN={name}", "-addext", "keyUsage=critical,keyCertSign", "-keyout", self.key,
                "-out", self.certificate)

    def issue(self, file, *names, days=2):
        """A certificate for names such as `DNS:localhost`, and its key: both paths. With days before today it has expired."""
        certificate, key, request, extensions = (os.path.join(self.folder, file + suffix) for suffix in (".pem", "_key.pem", ".request", ".names"))
        with open(extensions, "w") as text:
            text.write(f"subjectAltName={','.join(names)}\n")
        openssl("req", *KEY, "-subj", "/CN=a machine", "-keyout", key, "-out", request)
        # `openssl x509` takes no days before today from version 3.5 on, which Debian 13 has.
        database, config = (os.path.join(self.folder, name) for name in ("issued", "ca.cnf"))
        with open(database, "a"), open(config, "w") as text:
            text.write(f"[ca]\ndefault_ca=a\n[a]\ndatabase={database}\nnew_certs_dir={self.folder}\nunique_subject=no\nrand_serial=yes\ndefault_md=sha256\npolicy=p\n"
                       "[p]\ncommonName=supplied\n")
        now = datetime.datetime.now(datetime.timezone.utc)
        first, last = (f"{now + datetime.timedelta(days=each):%Y%m%d%H%M%SZ}" for each in (min(0, days - 2), days))
        openssl("ca", "-batch", "-notext", "-config", config, "-cert", self.certificate, "-keyfile", self.key, "-in", request,
                "-extfile", extensions, "-startdate", first, "-enddate", last, "-out", certificate)
        return certificate, key


def self_signed(folder, *names):
    """A certificate that has signed itself, and its key: both paths."""
    certificate, key = (os.path.join(folder, file) for file in ("self_signed.pem", "self_signed_key.pem"))
    openssl("req", "-x509", *KEY, "-days", "2", "-subj", "/CN=a machine", "-addext", f"subjectAltName={','.join(names)}", "-keyout", key,
            "-out", certificate)
    return certificate, key


def first_words_of_tls():
    """What a browser says first. It may be said again and again."""
    said = ssl.MemoryBIO()
    client = ssl.create_default_context().wrap_bio(ssl.MemoryBIO(), said, server_hostname="localhost")
    with contextlib.suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return said.read()
