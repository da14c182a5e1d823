"""Projects as people keep them in Webots repositories, and the configurations that ship, for tests."""

import json
import os

EXAMPLES = os.path.join(os.path.dirname(__file__), "..", "..", "examples", "demo_projects")
CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config")


def local_config(kind):
    """What ./server.sh start runs with, where nothing else is said."""
    with open(os.path.join(CONFIG, kind, "local.json")) as file:
        return json.load(file)


def demo_project(under=""):
    """The files of the demo project by path, as they lie in a repository below the folder `under`."""
    return files_of("robots", under)


def files_of(project, under=""):
    """The same of another one of the demo projects."""
    files = {}
    root = os.path.join(EXAMPLES, project)
    for folder, _, names in os.walk(root):
        for file in names:
            path = os.path.join(folder, file)
            with open(path, "rb") as content:
                files[os.path.join(under, os.path.relpath(path, root))] = content.read()
    return files
