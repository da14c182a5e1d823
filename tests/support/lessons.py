"""Solutions of the lessons of the demo projects, as changes of the programs that they begin with."""

import os

from support.projects import EXAMPLES

# By world: the controller, and what a pupil writes instead of what.
SOLUTIONS = {
    "lesson_1_move": ("move", [("left.setVelocity(0)\nright.setVelocity(0)\n", "left.setVelocity(10)\nright.setVelocity(10)\n")]),
    "lesson_2_walls": ("walls", [("        drive(0, 0)\n", "        drive(-3, 3)\n")]),
    "lesson_3_exit": ("find_exit", [("        drive(6, 6)\n", """\
        if right_side > 0.15:
            drive(6, 3)
        else:
            drive(3, 6)
""")]),
}


def solved(world):
    """The program of a lesson's controller with its solution in it."""
    name, changes = SOLUTIONS[world]
    with open(os.path.join(EXAMPLES, "lessons", "controllers", name, name + ".py")) as file:
        text = file.read()
    for before, after in changes:
        assert text.count(before) == 1, (name, before)
        text = text.replace(before, after)
    return text
