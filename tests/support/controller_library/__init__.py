"""Stands in for Webots' Python library for controllers, in containers and with the demo simulator."""

from .wb import wb


class Robot:
    def __init__(self):
        wb.wb_robot_init()

    def step(self, duration):
        return wb.wb_robot_step(duration)
