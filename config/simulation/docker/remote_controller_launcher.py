"""Starts participant.py, the controller of a competition's participant, in a container whose Dockerfile says nothing about what to start.

It connects to the simulator first: so browsers see all that the participant prints, an error that ends it too. A participant that has ended
does nothing, and holds nobody up.
"""

import os
import sys
import traceback

NAME = "participant.py"
FOLDER = "/usr/local/webots-project/controllers/participant"
PAUSE = 1000  # milliseconds of the simulation between two looks at whether it goes on


def connect():
    """The library for controllers that is in the image, connected to the participant's robot."""
    os.environ.setdefault("WEBOTS_CONTROLLER_URL", "participant")
    home = os.environ.setdefault("WEBOTS_HOME", "/usr/local/webots")
    sys.path.append(os.path.join(home, "lib", "controller", "python"))
    try:
        from controller.wb import wb
    except ImportError as error:
        sys.exit(f"The image has no library for controllers: {error}. Start from one of Webots, or say in controllers/Dockerfile what to start.")
    wb.wb_robot_init()
    return wb


def run(names):
    """Runs the participant as Python runs a script; `names` gets its variables."""
    folder = os.getcwd() if os.path.exists(NAME) else FOLDER
    path = os.path.join(folder, NAME)
    os.chdir(folder)
    sys.path[0] = folder
    sys.argv[:] = [path]
    names.update({"__name__": "__main__", "__file__": path})
    with open(path, "rb") as file:
        exec(compile(file.read(), path, "exec"), names)


def main():
    library = connect()
    names = {}  # kept to the end: a robot that is let go of disconnects
    try:
        run(names)
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    while library.wb_robot_step(PAUSE) != -1:
        pass


if __name__ == "__main__":
    main()
