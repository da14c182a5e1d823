#!/usr/bin/python3
"""What attack_rows.py starts against a server: attackers on the load's core, and hostile simulators.

    attacks.py frames PORT PATH MEGABYTES   WebSocket messages of no bytes in frames of six, again and again
    attacks.py pages PORT PATH CLIENTS      clients that ask for a page each and read nothing, again and again
    attacks.py hellos PORT RATE ADDRESSES   50 connections at a time that begin to shake hands by TLS, so many a second, and go
    attacks.py simulator KIND ...           in Webots' place
"""

import contextlib
import itertools
import os
import resource
import select
import signal
import socket
import struct
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from support.certificates import first_words_of_tls  # noqa: E402

HANDSHAKE = ("GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n")
EMPTY_MESSAGE = b"\x81\x80\0\0\0\0"

PROCESSES, FILES = 300, 1000


def frames(port, path, megabytes):
    block = EMPTY_MESSAGE * (int(megabytes) * 1_000_000 // len(EMPTY_MESSAGE))
    while True:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(HANDSHAKE.format(path=path).encode())
            connection.recv(4096)
            connection.sendall(block)
            connection.sendall(b"\x88\x80\0\0\0\0")
            connection.recv(4096)


def pages(port, path, clients):
    request = f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    while True:
        connections = []
        for _ in range(int(clients)):
            with contextlib.suppress(OSError):
                connection = socket.socket()
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.connect(("127.0.0.1", port))
                connection.sendall(request)
                connections.append(connection)
        for connection in connections:
            connection.close()


def hellos(port, rate, addresses):
    """They reset their connections, as whoever floods does, so that no ports run out."""
    said, interval, at_once = first_words_of_tls(), 1 / float(rate), 50
    sources = itertools.cycle([f"127.0.2.{1 + number}" for number in range(int(addresses))])
    answered, next_one = select.epoll(), time.monotonic()
    connections = {}
    os.nice(10)  # the bystander's own work is not what is measured
    while True:
        while len(connections) < at_once and time.monotonic() >= next_one:
            connection = socket.socket()
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            connection.bind((next(sources), 0))
            connection.connect(("127.0.0.1", port))
            connection.send(said)
            connections[connection.fileno()] = connection
            answered.register(connection, select.EPOLLIN)
            next_one = max(next_one + interval, time.monotonic() - 0.1)
        for descriptor, _ in answered.poll(max(0.0, next_one - time.monotonic()) if len(connections) < at_once else 1):
            connections.pop(descriptor).close()


def simulator(kind, arguments):
    if kind == "newlines":
        print(".", flush=True)
        block = b"\n" * 65536
        with contextlib.suppress(OSError):
            while True:
                os.write(1, block)
    port = next(int(argument.partition("=")[2]) for argument in arguments if argument.startswith("--port="))
    resource.setrlimit(resource.RLIMIT_NOFILE, (2 * FILES, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    for number in range(PROCESSES):
        if os.fork() == 0:
            for _ in range(FILES):
                os.open("/dev/null", os.O_RDONLY)
            if number == PROCESSES - 1:  # where it is found last
                listener = socket.create_server(("", port))
                assert listener
            signal.pause()
    while True:
        print(".", flush=True)
        time.sleep(1)


if __name__ == "__main__":
    if sys.argv[1] == "simulator":
        simulator(sys.argv[2], sys.argv[3:])
    {"frames": frames, "pages": pages, "hellos": hellos}[sys.argv[1]](int(sys.argv[2]), *sys.argv[3:])
