"""Lesson 3: find the exit. Drive through the maze to the green square.

An old trick: keep your right hand on the wall, and you get out of every maze that has no islands. A robot has no hand,
but it has sensors: keep the wall on the right at the same distance. Too far away: turn right. Too near: turn left.
"""
from controller import Robot

robot = Robot()
step = int(robot.getBasicTimeStep())  # milliseconds

left = robot.getDevice('left wheel motor')
right = robot.getDevice('right wheel motor')
left.setPosition(float('inf'))
right.setPosition(float('inf'))

# ds0 looks to the left, ds3 ahead, ds6 to the right.
sensors = [robot.getDevice(f'ds{number}') for number in range(7)]
for sensor in sensors:
    sensor.enable(step)


def drive(left_speed, right_speed):
    left.setVelocity(left_speed)
    right.setVelocity(right_speed)


while robot.step(step) != -1:
    ahead = sensors[3].getValue()  # metres
    right_side = sensors[5].getValue()  # half right: it sees the wall before the robot is there
    if ahead < 0.15:
        drive(-3, 3)  # a wall: turn left, on the spot
    else:
        # YOUR TURN: is the wall on the right too far away, or too near? 0.15 is a good distance.
        drive(6, 6)
