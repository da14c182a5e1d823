"""What the fuzzers start from: small, ordinary and a few not so ordinary inputs for each parser."""

import hashlib
import io
import os
import struct
import sys
import zipfile
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.archives import zip64_of  # noqa: E402

ID = b"0123456789abcdef0123456789abcdef01234567"


def world_url():
    base = "https://github.com/o/r/blob/main/"
    for path in ("worlds/a.wbt", "projects/arm/worlds/arm.wbt", "feature/x/worlds/a%20b.wbt", "../worlds/a.wbt", "%2e%2e/worlds/a.wbt",
                 "worlds/a.wbt?x#y", "%", "%zz/worlds/a.wbt", "worlds/.wbt", ".git/worlds/a.wbt", "caf%C3%A9/worlds/a.wbt"):
        yield (base + path).encode()
    yield b"https://github.com/o/r/tree/" + ID + b"/worlds/a.wbt"
    yield b"https://github.com.evil.org/o/r/blob/m/worlds/a.wbt"
    yield b"local:/demo_projects/robots/blob/main/worlds/arena.wbt"


def docker_project():
    for world, header, text in ((b"a.wbt", b"#VRML_SIM R2025a utf8", b"type: demo\ndockerCompose:theia:webots-project/controllers/\n"),
                                (b"a b.wbt", b"#VRML_SIM R2022b utf8", b"dockerCompose: competition:webots-project/controllers/participant/\n"),
                                (b"a\nX=1.wbt", b"#VRML_SIM", b"dockerCompose:theia\n"),
                                (b"$(id).wbt", b"p", b"p-webots-1  | .\nwebots_1 | a\ncontroller-1 | b\nwebots-1 exited with code 0\nFROM a \\\n AS b\n")):
        yield bytes((len(world),)) + world + bytes((len(header),)) + header + text
    yield b"\0\0dockerCompose:theia:a..b/"  # an ordinary name, though it has two dots
    yield b"\0\0dockerCompose:theia:a/../b/"


def client_message():
    yield b'{"start":{"url":"https://github.com/o/r/blob/m/worlds/a.wbt","mode":"mjpeg"}}'
    yield b'{ "init" : [ "https://w.org", "p", "a.wbt", "42", "Ada", "secret", "", "", "" ] }'
    yield b'{"init":["http://localhost:8080","a/b","a.wbt"]}'
    yield b'{"init":["http://[::1]","../x","../a.wbt"]}'
    yield b'{"reset controller":"c/c.py"}'
    yield b'{"init":[],"start":{"url":5}}'
    yield b'[[[[[[{"start":"\\ud83d\\ude00\\u0000"}]]]]]]'
    yield b"1e999"


def pkt(text):
    return b"%04x" % (len(text) + 4) + text


def git_protocol():
    yield pkt(ID + b" HEAD symref-target:refs/heads/main\n") + pkt(ID + b" refs/heads/main\n") + b"0000"
    yield pkt(ID + b" refs/tags/v1 peeled:" + ID + b"\n") + b"0001" + pkt(b"") + b"0002"
    yield pkt(b"# service=git-upload-pack\n") + b"0000" + pkt(b"version 2\n") + pkt(b"fetch=shallow filter\n") + b"0000"
    yield pkt(b"packfile\n") + pkt(b"\x01PACK") + pkt(b"\x02Counting\n") + pkt(b"\x03no such repository\n")
    yield b"0003" + b"ffff" + b"00"
    yield b"100644 a.wbt\0" + bytes(20) + b"40000 worlds\0" + bytes(20) + b"120000 link\0" + bytes(20)
    yield b"tree " + ID + b"\nparent " + ID + b"\nauthor A <a> 0 +0000\n\ntext\n"
    yield pkt(b"want " + ID + b"\n") + b"0000" + pkt(b"done\n")  # what libgit2 asks, and what it is answered
    yield pkt(b"shallow " + ID + b"\n") + b"0000" + pkt(b"NAK\n") + pkt(b"\x01PACK")
    yield pkt(b"ERR out of order")
    yield b"\x0a\x0b\x91\x00\x05\x03new"  # a delta: copy 5, insert 3
    yield b"feature/x/projects/arm"


def git_object(kind, content, base=b""):
    size = len(content)
    header = bytes([(0x80 if size > 15 else 0) | kind << 4 | size & 15]) + (bytes([size >> 4]) if size > 15 else b"")
    return header + base + zlib.compress(content)


def git_pack():
    """The first byte chooses: 0, the bytes as they are but for the digest at the end; otherwise a recipe of objects."""
    for objects in ([], [git_object(3, b"hello")], [git_object(2, b"100644 a\0" + bytes(20)), git_object(1, b"tree " + ID + b"\n")],
                    [git_object(3, b"0123456789"), git_object(6, b"\x0a\x05\x90\x05", b"\x13")],
                    [git_object(7, b"\x0a\x05\x90\x05", hashlib.sha1(b"blob 10\0000123456789").digest()), git_object(3, b"0123456789")],
                    [git_object(6, b"\x00\x00", b"\x05")], [git_object(3, bytes(2000))]):
        yield b"\0PACK" + struct.pack(">II", 2, len(objects)) + b"".join(objects)
    yield b"\x01" + b"\x03\x0a0123456789" + b"\x06\x04\x0a\x05\x90\x05\x13"
    yield b"\x01" + b"\x01\x05hello\x02\x05hello\x04\x05hello"


def git_plan():
    """Limit of entries, length and text of a path; then the folders: entries, each a mode, a name with its length, and a target."""
    def entry(mode, name, target):
        return bytes([mode, len(name)]) + name + bytes([target])
    worlds = b"\x01" + entry(1, b"a.wbt", 9)
    yield b"\xff\x06worlds" + b"\x04" + entry(0, b"worlds", 1) + entry(2, b"run.py", 9) + entry(3, b"link", 9) + entry(4, b"module", 9) + worlds
    yield b"\xff\x03a/b" + b"\x01" + entry(0, b"a", 1) + b"\x01" + entry(0, b"b", 2) + worlds
    yield b"\x20\x00" + b"\x02" + entry(0, b"a", 0) + entry(0, b"b", 0)  # it holds itself
    for name in (b"..", b".git", b"GIT~1", b"a/b", b"a\\b", b"a\nb", b"\xff", b""):
        yield b"\xff\x00" + b"\x01" + entry(1, name, 9)
    yield b"\x02\x00" + b"\x03" + entry(4, b"a", 9) + entry(4, b"b", 9) + entry(4, b"c", 9)
    yield b"webots_cloud folder 2\nd " + ID + b" 0 worlds\nf " + ID + b" 12 worlds/a.wbt\nl " + ID + b" 5 link\nend\n"


def archive_of(files, method=zipfile.ZIP_DEFLATED, mode=0o100644):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as archive:
        for name, data in files:
            info = zipfile.ZipInfo(name)
            info.create_system = 3
            info.external_attr = mode << 16
            info.compress_type = method
            archive.writestr(info, data)
    return content.getvalue()


def archive():
    yield archive_of([])
    yield archive_of([("worlds/a.wbt", b"#VRML_SIM R2021b utf8\n"), ("c/c.py", b"x")])
    yield archive_of([("a/", b""), ("a/b/c", b"y" * 300)], zipfile.ZIP_STORED)
    yield archive_of([("../evil", b"x"), ("/evil", b"x"), ("a\\b", b"x"), ("caf\u00e9", b"x")])
    yield archive_of([("link", b"/etc")], mode=0o120777)
    yield archive_of([("device", b"")], mode=0o020666)
    yield archive_of([("zeros", bytes(300_000))])
    yield archive_of([("a", b"x"), ("a/b", b"x")])
    yield archive_of([("lzma", b"x" * 100)], zipfile.ZIP_LZMA)
    yield archive_of([("bzip2", b"x" * 100)], zipfile.ZIP_BZIP2)
    yield zip64_of({"worlds/a.wbt": "#VRML_SIM R2021b utf8\n"})


def http_request():
    yield b"GET / HTTP/1.1\r\nHost: h\r\n\r\n"
    yield b"GET /session?url=x HTTP/1.1\r\nHost: h\r\nAccept: */*\r\n\r\nGET /load HTTP/1.0\r\n\r\n"
    yield (b"GET /client HTTP/1.1\r\nHost: h\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n"
           b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n\x81\x80\0\0\0\0")
    yield (b"GET / HTTP/1.1\r\nHost: h\r\nX-Forwarded-For: 192.0.2.1, [2001:db8::7]:80\r\nX-Forwarded-For: 10.0.0.1,, ::ffff:10.0.0.2\r\n"
           b"Forwarded: for=\"[2001:db8::7]:80\";proto=https, for=10.0.0.1\r\n\r\n")
    yield b"POST /api/drain?exit HTTP/1.1\r\nHost: h\r\nContent-Length: 0\r\n\r\n"
    yield b"POST / HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
    yield b"OPTIONS * HTTP/1.1\nHost: h\n\n"
    yield b"GET http://h/x HTTP/1.1\r\nHost: h\r\nHost: g\r\n folded\r\n\r\n"
    yield b"\x16\x03\x01\x02\x00\x01"


def frame(first, payload):
    mask = b"\x11\x22\x33\x44"
    size = bytes([0x80 | len(payload)]) if len(payload) < 126 else b"\xfe" + struct.pack(">H", len(payload))
    return bytes([first]) + size + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))


def websocket_frames():
    yield frame(0x81, b'{"start":{}}')
    yield frame(0x82, bytes(300))
    yield frame(0x01, "caf\u00e9".encode()[:4]) + frame(0x89, b"ping") + frame(0x80, b"\xa9")
    yield frame(0x88, b"\x03\xe8bye")
    yield frame(0x88, b"") + frame(0x8a, b"pong")
    yield frame(0x81, b"\xff") + frame(0xf1, b"x")
    yield b"\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0"


SEEDS = {each.__name__: each for each in (archive, client_message, docker_project, git_pack, git_plan, git_protocol, http_request, websocket_frames, world_url)}
