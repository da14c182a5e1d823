"""The commands of the Python servers, session_server.py and simulation_server.py, for autostart entries and habits of before: each becomes the program
that has replaced it. As before, there is a default configuration, and relative paths in configurations begin at the folder of the scripts."""

import os
import shutil
import sys

FOLDER = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def run(kind):
    """Becomes the server of that kind, so that signals and exit statuses are its own. Returns only where it can't, after saying why."""
    name = f"webots-{kind}-server"
    built = os.path.join(FOLDER, "build", "release", "bin", name)
    program = built if os.access(built, os.X_OK) else shutil.which(name)
    if program is None:
        sys.exit(f"{name} is neither built in this folder nor installed. Run ./server.sh start once, which builds it, then ./server.sh stop.")
    arguments = sys.argv[1:] or [os.path.join("config", kind, "default.json")]
    # Paths on the command line are relative to where it was typed, if there is such a file.
    arguments = [os.path.abspath(each) if sys.argv[1:] and os.path.exists(each) else each for each in arguments]
    os.chdir(FOLDER)
    sys.stdout.flush()
    os.execv(program, [program, *arguments])
