"""Lesson 1: move. Drive the robot onto the green square.

Change the program, run it, and look what the robot does.
"""
from controller import Robot

robot = Robot()
step = int(robot.getBasicTimeStep())  # milliseconds

left = robot.getDevice('left wheel motor')
right = robot.getDevice('right wheel motor')
left.setPosition(float('inf'))  # turn on for ever, not to a certain angle
right.setPosition(float('inf'))

# YOUR TURN: how fast do the wheels turn? The unit is radians per second, the most is 20.
# Both alike: straight on. One slower than the other: a curve. Less than 0: backwards.
left.setVelocity(0)
right.setVelocity(0)

print('Hello, I am your robot. The wheels turn with', left.getVelocity(), 'and', right.getVelocity())

# The robot moves while the program waits in robot.step().
while robot.step(step) != -1:
    pass
