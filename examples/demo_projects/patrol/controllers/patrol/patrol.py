"""Drives a robot round a block. Change what you like, save, and reset the simulation."""
from controller import Robot

SENSORS = 7
AHEAD = SENSORS // 2
RANGE = 0.45  # metres
WEIGHTS = (0.15, 0.55, 0.8)
CRUISE = 8.0  # radians per second


def main():
    robot = Robot()
    step = int(robot.getBasicTimeStep())
    sensors = [robot.getDevice(f'ds{i}') for i in range(SENSORS)]
    for sensor in sensors:
        sensor.enable(step)
    motors = [robot.getDevice(f'{side} wheel motor') for side in ('left', 'right')]
    for motor in motors:
        motor.setPosition(float('inf'))
        motor.setVelocity(0)

    escape = 0
    while robot.step(step) != -1:
        near = [1 - sensor.getValue() / RANGE for sensor in sensors]
        left = sum(w * n for w, n in zip(WEIGHTS, near))
        right = sum(w * n for w, n in zip(WEIGHTS, reversed(near)))
        front = max(near[AHEAD], 0.8 * near[AHEAD - 1], 0.8 * near[AHEAD + 1])
        if front > 0.45 and escape == 0:
            escape = 1 if right >= left else -1
            print(f'robot {robot.getName()}: obstacle ahead')
        elif front < 0.15:
            escape = 0
        turn = 0.6 * escape if escape else max(-0.8, min(0.8, right - left))
        forward = max(0.08, 1 - 1.1 * front)
        motors[0].setVelocity(CRUISE * (forward - turn))
        motors[1].setVelocity(CRUISE * (forward + turn))


if __name__ == '__main__':
    main()
