#!/usr/bin/python3
"""Somebody else every twenty milliseconds, who connects by TLS and asks for one page: newcomer.py PORT SECONDS prints how long the longest of
them waited and the median, in milliseconds, and how many there were."""

import socket
import ssl
import statistics
import sys
import time

REQUEST = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"


def visit(port, context, address):
    begin = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), timeout=30, source_address=(address, 0)) as plain:
        with context.wrap_socket(plain) as connection:
            connection.sendall(REQUEST)
            if not connection.recv(4096).startswith(b"HTTP/1.1 200 "):
                raise AssertionError("no answer")
            return (time.monotonic() - begin) * 1e3


def main(port, seconds):
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE  # the certificate has signed itself
    waits = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        waits.append(visit(port, context, f"127.0.3.{1 + len(waits) % 250}"))
        time.sleep(0.02)
    print("visits", max(waits), statistics.median(waits), len(waits))


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
