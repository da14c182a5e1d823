"""What the fuzzers start from: small, ordinary and a few not so ordinary inputs. The function with the name of a fuzzer has its inputs."""

import base64
import hashlib
import io
import json
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
    for path in (b"g/s/r/-/blob/main/worlds/a.wbt", b"g/src/r/-/raw/main/worlds/a.wbt", b"o/r/src/branch/main/worlds/a.wbt", b"o/r/src/tag/v1/worlds/a.wbt",
                 b"o/r/src/commit/" + ID + b"/worlds/a.wbt", b"o/r/src/main/worlds/a.wbt", b"o/r/media/branch/x/worlds/a.wbt", b"o/r/tree/main", b"o/r"):
        yield b"local:/" + path
    yield b"https://raw.githubusercontent.com/o/r/main/worlds/a.wbt"
    yield b"https://media.githubusercontent.com/media/o/r/main/worlds/a.wbt"
    for path in (b"", b"/", b"/mjpeg", b"//../%2e"):
        yield b"/simulation/kqwzbfyhadnvtjgmxcrpeoulsiwy/2001" + path
    yield b"/2000/simulation/a/65535/"


def port_path():
    yield from (b"/2000/client", b"/2009", b"/2000/metrics", b"/2000//%6detrics", b"/2005/a/../api/x", b"/2000/api//../x", b"/22/", b"//10.0.0.9:22/",
                b"/ticket/" + b"A" * 75 + b"/client", b"/ticket/x/y/client", b"/.well-known/acme-challenge/a-B_1", b"/.well-known/acme-challenge/../x",
                b"sim.example.org:80", b"[::1]:80", b"someone@sim.example.org", b"127.0.0.1", b"/machine/" + b"a" * 24 + b"/client",
                b"/machine/" + b"a" * 24, b"/machine/" + b"a" * 24 + b"//%6detrics", b"wss://sim.example.org:8443/1999/machine/abc")


def controller_greeting():
    key = b"abcdefghijklmnopqrst"
    for path in (key, key + b"/e-puck", key + b"%2Fmy%20robot", key + b"%2Fmy%2520robot", key + b"/~2", key + b"%2", b"e-puck", b"2000/" + key + b"/x",
                 b"2000%2F" + key + b"%2Fx", key + b"/a\0", key + b"/%0A"):
        yield b"CTR\nRobot-Name: " + path
    yield from (b"CTR", b"CT", b"CONNECTED\0\0", b"PROCESSING", b"tcp://<ip_address>:2001/my%20robot", b"ipc://2001/" + b"x" * 60)


def waiting_ticket():
    now = 400_000 * 3600 * 10**9
    for rank, issued in ((now, now), (now - 10**10, now - 80 * 10**9), (now + 305 * 10**9, now), (0, now), (-1, -1), (2**63 - 1, -2**63)):
        for group in (b"groupgro", b"\0" * 8):
            yield base64.urlsafe_b64encode(b"i" * 16 + group + struct.pack(">qq", rank, issued) + b"x" * 32)
    yield from (b"", b"A" * 96, b"A" * 95 + b"=")


def docker_project():
    for world, header, text in ((b"a.wbt", b"#VRML_SIM R2025a utf8", b"type: demo\ndockerCompose:theia:webots-project/controllers/\n"),
                                (b"a b.wbt", b"#VRML_SIM R2022b utf8", b"dockerCompose: competition:webots-project/controllers/participant/\n"),
                                (b"a\nX=1.wbt", b"#VRML_SIM", b"dockerCompose:theia\n"),
                                (b"$(id).wbt", b"p", b"p-webots-1  | .\nwebots_1 | a\ncontroller-1 | b\nwebots-1 exited with code 0\nFROM a \\\n AS b\n")):
        yield bytes((len(world),)) + world + bytes((len(header),)) + header + text
    yield b"\0\0dockerCompose:theia:a..b/"  # an ordinary name, though it has two dots
    yield b"\0\0dockerCompose:theia:a/../b/"
    yield b"\0\0ARG X=docker.io/a:$V\nFROM scratch AS a\nRUN a \\\n # b\n c\nFROM r/i:1 AS b\nCOPY --from=a --chown=a / /\nLABEL a=b\nADD a b\n"
    yield b"\0\0ARG WEBOTS_DEFAULT_IMAGE\nFROM ${WEBOTS_DEFAULT_IMAGE}\nONBUILD COPY --from=0a / /\n"


def form():
    for content_type, body in ((b"application/x-www-form-urlencoded", b"project=robots&key=a+b%26&user1Id=1&&=x&%zz"),
                               (b"", b"a=1"), (b"text/plain", b"a=1"),
                               (b'multipart/form-data; boundary="b"',
                                b'--b\r\nContent-Disposition: form-data; name="dirname"\r\n\r\nrobots/controllers/a\r\n'
                                b'--b\r\nContent-Type: text/plain\r\nContent-Disposition: form-data; x=y; name="content"\r\n\r\n'
                                b'1\r\n--b2\r\n\r\n--b--\r\n'),
                               (b"multipart/form-data; boundary=b", b"p\r\n--b\r\n\r\n\r\n--b--")):
        yield bytes((len(content_type),)) + content_type + body


def class_message():
    open_class = b'0{"teach":{"password":"p","world":"https://e.org/a.wbt","mode":"mjpeg","seats":2}}\n'
    join = b'1{"join":{"code":"222222","name":"Ada"}}\n'
    yield open_class + join + b'0{"watch":true}\n1{"picture":"/9j/wAALCAB4AKABAREA"}\n1{"picture":"/9j/4AACAAEC/8I="}\n0{"code":"new"}\n1{"state":{"state":"running","time":5,"simulator":"ws://h:2001"}}\n'
    yield open_class + join + b'0{"tell":{"students":[1],"do":"message","text":"x"}}\n0{"tell":{"students":null,"do":"remove"}}\n'
    yield open_class + b'2{"check":"K7M2QX"}\n' + join + b'1{"sign":"hand"}\n1{"state":{"state":"waiting","why":"busy","ahead":3}}\n0{"tell":{"students":null,"do":"lower"}}\n0{"world":{"world":"https://e.org/b.wbt","mode":"w3d"}}\n'
    yield open_class + b'2{"join":{"token":"02020202020202020202020202020202"}}\n1{"leave":true}\n0{"seats":5}\n0{"close":true}\n'
    yield b'3{"teach":{"key":"01010101010101010101010101010101"}}\n'


def client_message():
    yield b'{"start":{"url":"https://github.com/o/r/blob/m/worlds/a.wbt","mode":"mjpeg"}}'
    yield b'{ "init" : [ "https://w.org", "p", "a.wbt", "42", "Ada", "secret", "", "", "" ] }'
    yield b'{"init":["http://localhost:8080","a/b","a.wbt"]}'
    yield b'{"init":["http://[::1]","../x","../a.wbt"]}'
    yield b'{"reset controller":"c/c.py"}'
    yield b'{"init":[],"start":{"url":5}}'
    yield b'{"start":{"url":"u","fetch_only":true,"heartbeat":true,"reasons":true}}'
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


def git_layout():
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
    yield b"webots_cloud folder 3\nd " + ID + b" 0 worlds\nf " + ID + b" 12 worlds/a.wbt\nl " + ID + b" 5 link\nend\n"
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"a" * 64 + b"\nsize 12\n"
    name = hashlib.sha1(b"blob %d\0" % len(pointer) + pointer).hexdigest().encode()
    yield b"webots_cloud folder 3\nF " + name + b" 12 " + pointer.hex().encode() + b" mesh.stl\nend\n"


def git_lfs():
    version, one, two = "version https://git-lfs.github.com/spec/v1\n", "a" * 64, "b" * 64
    pointer = f"{version}oid sha256:{one}\nsize 5\n"
    action = {"download": {"href": "https://cdn.example.com/a?b=c", "header": {"Authorization": "Basic x"}, "expires_in": 60}}
    objects = [{"oid": one, "size": 5, "authenticated": True, "actions": action},
               {"oid": two, "size": 7, "error": {"code": 404, "message": "Object does not exist"}}]
    texts = [pointer, pointer.replace("git-lfs.github.com", "hawser.github.com"), pointer.replace("\n", "\r\n"),
             f"{version}ext-0-zip sha256:{two}\noid sha256:{one}\nsize 5\n", json.dumps({"transfer": "basic", "objects": objects}),
             json.dumps({"objects": objects[1:]}), json.dumps({"message": "no"}), "https://forge.org/a", "https://[::1]/a",
             "https://10.0.0.1:80/a", "http://user@forge.org/", "https://cdn.example.com?a#b"]
    return [text.encode() for text in texts]


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


def forward():
    """Bits of the first byte: a request; an answer to HEAD; an answer to a handshake."""
    for request in http_request():
        yield b"\1" + request
    yield b"\1GET / HTTP/1.1\r\nHost: h\r\nConnection: X-Forwarded-For, Host\r\nTE: trailers\r\nContent-Length: 0\r\n\r\n"
    for kind in b"\0\2\4":
        for answer in (b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\nConnection: close, X\r\nX: y\r\n\r\nbody",
                       b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nTrailer: X\r\n\r\n0\r\n\r\n",
                       b"HTTP/1.0 304 Not Modified\r\nContent-Length: 4\r\n\r\n",
                       b"HTTP/1.1 103 Early Hints\r\nLink: x\r\n\r\nHTTP/1.1 200 OK\r\nX: folded\r\n value\r\n\r\n",
                       b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: x\r\n\r\n"):
            yield bytes([kind]) + answer


def http_request():
    yield b"GET / HTTP/1.1\r\nHost: h\r\n\r\n"
    yield b"GET /session?url=x HTTP/1.1\r\nHost: h\r\nAccept: */*\r\n\r\nGET /load HTTP/1.0\r\n\r\n"
    yield (b"GET /client HTTP/1.1\r\nHost: h\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n"
           b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n\x81\x80\0\0\0\0")
    yield (b"GET / HTTP/1.1\r\nHost: h\r\nX-Forwarded-For: 192.0.2.1, [2001:db8::7]:80\r\nX-Forwarded-For: 10.0.0.1,, ::ffff:10.0.0.2\r\n"
           b"Forwarded: for=\"[2001:db8::7]:80\";proto=https, for=10.0.0.1\r\n\r\n")
    yield b"GET /monitor HTTP/1.1\r\nHost: h\r\nAccept: text/html\r\nAccept-Language: de-AT,de;q=0.9, en;q=0.85,*;q=0\r\n\r\n"
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


def world_list():
    yield b'#VRML_SIM R2025a utf8\nEXTERNPROTO "../protos/A.proto"\nWorldInfo {\n  title "A \\"b\\""\n  info [ "One," "two." ] # }\n}\n'
    yield b'WorldInfo { contactProperties [ ContactProperties { title "inner" } ] info "one" title "\xc3\xa4\xe2\x80\xae" }'
    yield b'WorldInfo { title "half'
    yield b'{"worlds":[{"url":"local:/o/r/blob/main/worlds/a_b.wbt","title":"A","text":"About it.","group":"G"},{"url":"wss://h/p/worlds/a.wbt"}]}'
    yield b'{"worlds":[{"url":"local:/o/r/blob/main/worlds/%zz.wbt"},1,{}],"pictures":["0123456789abcdef","x"]}'
    yield (b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=WebotsFrame\r\n\r\n--WebotsFrame\r\n"
           b"Content-Type: image/jpeg\r\nContent-Length: 6\r\n\r\n\xff\xd8\xffabc\r\n")


def load_report():
    yield b"12.5"
    yield b" 0\n"
    yield b"1e16"
    yield b"-1"
    yield b"nan"
    yield b'{"load":7.875,"sessions":3,"starting":1,"capacity":100,"memory":41.5,"draining":false,"version":"1.0"}'
    yield (b'{"load":1,"sessions":2,"labels":["gpu","R2025a"],"processors":16,"worlds":[{"world":"0123456789abcdef",'
           b'"repository":"fedcba9876543210","mode":"0000000000000001","running":1,"starting":1,"processors":0.5,"memory":1e8}]}')
    yield b'{"load":1,"processors":4,"memoryBytes":8e9,"worlds":[],"projects":"AAAAAfvvvvs"}'
    yield b'{"load":1e999,"sessions":-1}'
    yield b'{"load":0,"sessions":1.5}'
    yield b"<html>502 Bad Gateway</html>"


def policy():
    """Length and text of a rule, then the address of a world."""
    base = b"https://github.com/"
    for rule in (b"", base + b"good", base + b"Good/Robots/blob/main", base + b"o/r/tree/feature/x", base + b"o//r.git", b"https://", b"%6fx"):
        for world in (b"good/robots/blob/main/worlds/a.wbt", b"GOOD/ROBOTS/tree/refs/heads/main/worlds/a.wbt", b"o/r/blob/feature/x/p/worlds/a.wbt",
                      b"o/r/blob/" + b"a" * 40 + b"/worlds/a.wbt", b"o/r/blob/HEAD/worlds/a.wbt", b"o/r.GIT/blob/main/worlds/a.wbt",
                      b"o/%72/blob/m%61in/%77orlds/a%20b.wbt?x#y", b"o/r/blob/v1/worlds/a.wbt", b"o/../r/blob/main/worlds/a.wbt",
                      b"o//r/blob/main/worlds/a.wbt"):
            yield bytes((len(rule),)) + rule + base + world
    for rule in (base + b"o/r/raw/main", b"https://raw.githubusercontent.com/o/r/main", base + b"o/r/-/tree/main"):
        for world in (base + b"o/r/raw/refs/heads/main/worlds/a.wbt", b"https://raw.githubusercontent.com/o/r/main/worlds/a.wbt", b"https://github.dev/o/r/blob/main/worlds/a.wbt"):
            yield bytes((len(rule),)) + rule + world


def simulator_output():
    yield b".\n.\nopen\npause\r\nreal-time\nfast\nstep\nreset\nINFO: controller\n"
    yield b"\n" * 50 + b"\r\r\n" + b"x" * 300
    yield b"p-webots-1  | .\np_webots_1 exited with code 137\n\x1b[2Kp-controller-1  | a | b\n"
    yield b"webots-1 exited with code 0\n\x1b[31;1mStep 1/5 : FROM a\x1b[0m\n"
    yield b"x" * 700 + b"\nlast"


def mount_table():
    yield b"36 35 98:0 / /tmp/instances/1/a\\040b rw,noatime master:1 - ext3 /dev/root rw\n36 35 0:1 / / rw - ext4 /dev/sda rw\n"
    yield b"1 1 1 / /tmp/instances/1\\134x\n1 1 1 / /tmp/instances/10/y\n\\\\\\04"
    yield b"\x00\x03a b\x04\x02\\0\x01\x01x\x03\x04\t\n\\0\x02\x011"


def docker_listing():
    ours = b"webots-2000-1f3a9c4d"
    yield (b'0a1b\t"' + ours + b'-1"\t""\tUp 2 hours\n0c2d\t"other"\t""\tUp 2 hours\n0e3f\t""\t"' + ours + b'"\tExited (1) 3 hours ago\n')
    yield b'0a1b\t""\t"' + ours + b'"\tCreated\n--all\t"' + ours + b'-1"\n\t"' + ours + b'-1"\n0a1b\t"x\\n' + ours + b'-1"\n'
    yield (b"cyberbotics/webots.cloud:R2023b-ubuntu22.04\t2026-11-01 17:25:24 +0000 UTC\n" + ours + b"-7-webots:latest\t2026-11-01 07:05:04 -0730 X\n"
           b"cyberbotics/webots.cloud:R2025a\t2020-01-01 00:00:00 +0000 UTC\n")
    yield b"cyberbotics/webots.cloud:a\t9999-12-31 99:99:99 +9999 UTC\ncyberbotics/webots.cloud:b\t-999-1-1 -1:-1:-1 -9999 UTC\n"
    yield bytes(range(60))


def mail():
    def notice(when, subject, name, sender, recipient, text):
        return bytes((when,)) + b"".join(bytes((len(part),)) + part for part in (subject, name, sender, recipient)) + text
    yield notice(1, b"Servers are down", b"1.2-3", b"a@b.org", b"c@d.org", b"host:2000 is down\nhost:2001 is down\n")
    yield notice(255, b"a\r\nBcc: x@y.org\r\n\r\nText", b">\r\n", b"a@b\r\nX: y", b"c>\n", b"\r\n.\r\nQUIT\r\n.\n")
    yield notice(0, "caf\u00e9".encode(), b"", b"", b"@", "caf\u00e9\r\r\n\n".encode())


def configuration():
    """Even: of a session server; odd: of a simulation server."""
    yield (b'0{"port":1999,"portRewrite":true,"server":"h.org","administrator":"a@h.org","mailServer":"m.h.org","mailServerPort":587,'
           b'"mailSender":"s@h.org","mailSenderUser":"u","mailSenderPassword":"p","simulationServers":["h.org/2000",'
           b'{"address":"g.org:2000","weight":2,"drain":true,"labels":["gpu"]}],"loadRefresh":5,"loadTimeout":0.5,"loadThreshold":95,"scheduling":"random"}')
    yield (b'1{"server":"h.org","ssl":false,"port":65000,"docker":true,"dockerDir":"d","allowedRepositories":["https://github.com/a"],'
           b'"blockedRepositories":["https://github.com/b"],"shareIdleTime":50,"forges":["https://github.com",{"url":"local:","directory":"x"}],'
           b'"notify":["https://r.org/x"],"cacheSize":1.5,"maxConnections":499,"timeout":7200,"title":"A\\u001b","description":"B"}')
    yield b'1{"sslCertificate":"$HOME/c","sslKey":"~/k","multimediaServer":"a","multimediaStream":"b:1","display":":0","sandbox":"auto","network":"host","keyDir":"k","caFile":"c"}'
    yield b'0{"mailSenderUser":"a\\r\\nRCPT TO:<x>","mailSenderPassword":"\\u0000","port":1,"simulationServers":[]}'
    yield b'0{"prot":1,"prto":2,"\\u001b[2J":3,"simulationServers":[{"adress":5}]}'
    yield b'1{"timeout":1,"port":2000,"startTimeout":1e300,"loadFormula":"reference","logFormat":"json","simulationLogDays":0}'
    yield (b'1{"launcher":{"slurm":{"partition":"p","memory":512,"processors":2,"gres":"gpu:1","timeLimit":3600,"copyTo":"/tmp",'
           b'"overrides":[{"mode":"x3d","qos":"q"},{"label":"l","account":"a"}]}}}')
    yield b'1{"forges":["local:"],"staged":[{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"x3d","count":2},"a"],"stagedMaxAge":60}'
    yield b"0[[[[{"


def http_answer():
    yield b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\n12.5"
    yield b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n4;x=y\r\n12.5\r\n0\r\nA: b\r\n\r\n"
    yield b"HTTP/1.0 200 OK\r\n\r\n12.5"
    yield b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 204 No Content\r\n\r\n"
    yield b"HTTP/1.1 301 Moved\r\nLocation: /x\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
    yield b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n12.5"
    yield b"HTTP/1.1 200 OK\r\nContent-Length: 2000\r\n\r\n" + b"x" * 2000
    yield b"HTTP/1.1 200 OK\r\n" + b"X: " + b"y" * 9000 + b"\r\n\r\n"
    yield b"\x15\x03\x01\x00\x02\x02\x0a"
    yield b""


def service_answer():
    """Two machines, of which one has another priority; a name that points into the question; and what makes no sense."""
    question = b"\2_w\4_tcp\4test\0" + struct.pack(">HH", 33, 1)

    def answer(*records, count=None):
        head = struct.pack(">HHHHHH", 1, 0x8180, 1, len(records) if count is None else count, 0, 0)
        return head + question + b"".join(records)

    def record(target, priority=10, weight=1, port=2000, kind=33, ttl=60):
        data = struct.pack(">HHH", priority, weight, port) + target
        return b"\xc0\x0c" + struct.pack(">HHIH", kind, 1, ttl, len(data)) + data

    yield answer(record(b"\4sim1\4test\0"), record(b"\4sim2\4test\0", 20, 65535))
    yield answer(record(b"\4sim1\xc0\x14"), record(b"\11localhost\0"), record(b"\x03127\0010\0010\0011\0", port=0, ttl=2**31))
    yield answer(record(b"\1x\0", kind=1), record(b"\0"), count=9)
    yield answer(record(b"\xc0\xff"), record(b"\x3f" + b"a" * 63 + b"\0"))
    yield b""


def smtp_reply():
    """Odd: with a password. Then all replies in a row."""
    good = b"220 m ESMTP\r\n250-m\r\n250 8BITMIME\r\n250 sender\r\n250 recipient\r\n354 go on\r\n250 queued\r\n221 bye\r\n"
    yield b"\0" + good
    yield b"\1" + good
    yield b"\1220 m\r\n250-m\r\n250-STARTTLS\r\n250 AUTH PLAIN LOGIN\r\n220 go on\r\n"
    yield b"\0220-a\r\n220 b\r\n250 m\r\n550 5.1.1 no such sender\x1b[2J\r\n"
    yield b"\0421 busy\r\n"
    yield b"\0220 m\r\n500 what\r\n250 m\r\n250 a\r\n251 b\r\n354 c\r\n452 full\r\n"
    yield b"\0220 " + b"x" * 3000
    yield b"\0\r\n\r\n999\r\n"
