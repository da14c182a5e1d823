"""Lesson 2: turn at walls. Drive round the block to the green square.

The robot sees: seven sensors look to the left (ds0), ahead (ds3) and to the right (ds6), and in between.
Each measures how many metres are free, 0.45 at most.
"""
from controller import Robot

robot = Robot()
step = int(robot.getBasicTimeStep())  # milliseconds

left = robot.getDevice('left wheel motor')
right = robot.getDevice('right wheel motor')
left.setPosition(float('inf'))
right.setPosition(float('inf'))

ahead = robot.getDevice('ds3')
ahead.enable(step)  # a sensor measures once it is enabled


def drive(left_speed, right_speed):
    left.setVelocity(left_speed)
    right.setVelocity(right_speed)


while robot.step(step) != -1:
    if ahead.getValue() > 0.2:
        drive(6, 6)
    else:
        # YOUR TURN: there is a wall ahead. How do the wheels have to turn, so that the robot turns left?
        drive(0, 0)
