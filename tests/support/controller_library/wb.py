"""The functions of it that need a simulator: of Webots' own they have names, environment variables and the path of the socket, and not the protocol."""

import glob
import os
import select
import socket
import types

TRIES = 300
robot = None


def wb_robot_init():
    """Connects, and has what is printed go to the simulator if the environment asks for it."""
    global robot
    if robot:
        return
    pattern = f"/tmp/webots/{os.environ['USER']}/*/ipc/{os.environ['WEBOTS_CONTROLLER_URL']}/extern"
    robot = socket.socket(socket.AF_UNIX)
    for _ in range(TRIES):
        if any(robot.connect_ex(path) == 0 for path in glob.glob(pattern)):
            break
        select.select([], [], [], 0.1)
    else:
        raise SystemExit(f"no simulator at {pattern}")
    for number, name in ((1, "WEBOTS_STDOUT_REDIRECT"), (2, "WEBOTS_STDERR_REDIRECT")):
        if name in os.environ:
            os.dup2(robot.fileno(), number)


def wb_robot_step(duration):
    """Waits as long, in the time of this machine; -1: the simulator is gone."""
    gone = select.select([robot], [], [], duration / 1000)[0]
    return -1 if gone else 0


wb = types.SimpleNamespace(wb_robot_init=wb_robot_init, wb_robot_step=wb_robot_step)
