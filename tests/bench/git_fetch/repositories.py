"""The three repositories of the benchmark, made deterministically: projects as people have them.

tiny      50 kB in 8 files, 3 commits
medium    20 MB in 300 files, 200 commits
monorepo  20 projects of 10 MB in 120 files each, 300 commits; one project is wanted
"""

import os
import random
import subprocess

WANTED = {"tiny": "", "medium": "", "monorepo": "projects/p07"}

WORLD = "#VRML_SIM R2023b utf8\nWorldInfo { }\nRobot { controller \"demo\" }\n"
CONTROLLER = "from controller import Robot\nrobot = Robot()\nwhile robot.step(16) != -1:\n    pass\n"


def _mesh(random_source, size):
    lines = []
    while size > 0:
        lines.append("v %.6f %.6f %.6f\n" % tuple(random_source.random() for _ in range(3)))
        size -= len(lines[-1])
    return "".join(lines).encode()


def _project(prefix, random_source, size, count):
    """Four fifths textures that can't be compressed, one fifth text."""
    files = {"worlds/demo.wbt": WORLD.encode(), "controllers/demo/demo.py": CONTROLLER.encode(), "README.md": b"# Demo\n"}
    textures = (count - len(files)) * 7 // 10
    texts = count - len(files) - textures
    for i in range(textures):
        files[f"worlds/textures/{i:03}.jpg"] = random_source.randbytes(size * 4 // 5 // textures)
    for i in range(texts):
        name = f"protos/{i:03}.proto" if i % 2 else f"worlds/meshes/{i:03}.obj"
        files[name] = _mesh(random_source, size // 5 // texts)
    return {prefix + name: content for name, content in files.items()}


def _make(path, files, commits, random_source):
    """Each commit after the first changes a texture or two texts."""
    subprocess.run(["git", "init", "-q", "--bare", "-b", "main", path], check=True)
    textures = sorted(name for name in files if name.endswith(".jpg"))
    texts = sorted(name for name in files if name.endswith((".py", ".wbt")))
    stream = subprocess.Popen(["git", "-C", path, "fast-import", "--quiet"], stdin=subprocess.PIPE)
    for number in range(commits):
        changes = files
        if number % 2:
            name = random_source.choice(textures)
            changes = {name: random_source.randbytes(len(files[name]))}
        elif number:
            changes = {name: files[name] + b"# %d\n" % number for name in random_source.sample(texts, 2)}
        stream.stdin.write(b"commit refs/heads/main\ncommitter Bench <bench@localhost> %d +0000\ndata 1\nx\n"
                           % (1600000000 + 3600 * number))
        for name, content in changes.items():
            stream.stdin.write(b"M 100644 inline %s\ndata %d\n%s\n" % (name.encode(), len(content), content))
        stream.stdin.write(b"\n")
    stream.stdin.close()
    if stream.wait() != 0:
        raise RuntimeError("git fast-import failed")
    for key in ("allowFilter", "allowAnySHA1InWant"):
        subprocess.run(["git", "-C", path, "config", "uploadpack." + key, "true"], check=True)
    subprocess.run(["git", "-C", path, "repack", "-q", "-a", "-d", "-b"], check=True)


def _tiny(path):
    _make(path, _project("", random.Random(1), 50_000, 8), 3, random.Random(2))


def _medium(path):
    _make(path, _project("", random.Random(3), 20_000_000, 300), 200, random.Random(4))


def _monorepo(path):
    files = {}
    for k in range(20):
        files.update(_project(f"projects/p{k:02}/", random.Random(100 + k), 10_000_000, 120))
    _make(path, files, 300, random.Random(5))


def make_all(folder, names=tuple(WANTED)):
    """Makes `<folder>/<name>.git` of each; what is there already stays."""
    os.makedirs(folder, exist_ok=True)
    makers = {"tiny": _tiny, "medium": _medium, "monorepo": _monorepo}
    for name in names:
        path = os.path.join(folder, name + ".git")
        if not os.path.isdir(path):
            makers[name](path)
