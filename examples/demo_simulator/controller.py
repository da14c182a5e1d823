"""The part of Webots' Python API that the demo simulator has: `from controller import Robot`.

The simulator gives this file to Python on stdin, and names the program that drives the robot. Both speak line by line over the socket 3:
first comes `robot <basic time step> <name>`; after each `step <ms> <position> <velocity> <position> <velocity>` of the left and the right
wheel, and once that much time is simulated, `<time> <7 distances> <x> <y> <heading> <left angle> <right angle>`. The simulation waits meanwhile.
"""
import os
import sys

_SOCKET = 3
_MAX_VELOCITY = 20.0
_RANGE = 0.45
_NOTHING = float('nan')


def _warn(text):
    print('Warning: ' + text, file=sys.stderr)


class Device:
    def __init__(self, robot, name):
        self._robot = robot
        self._name = name

    def getName(self):
        return self._name


class Motor(Device):
    """Turns to a position, at first 0; after `setPosition(float('inf'))` it turns on at the velocity that is set."""

    def __init__(self, robot, name):
        super().__init__(robot, name)
        self._position = 0.0
        self._velocity = _MAX_VELOCITY

    def setPosition(self, position):
        position = float(position)
        if position != position:
            return _warn(f'{self._name}: setPosition(nan) has no effect.')
        self._position = position

    def setVelocity(self, velocity):
        velocity = float(velocity)
        if velocity != velocity:
            return _warn(f'{self._name}: setVelocity(nan) has no effect.')
        if abs(velocity) > _MAX_VELOCITY:
            _warn(f'{self._name}: it can turn by {_MAX_VELOCITY:g} radians per second at most, {velocity:g} is too much.')
            velocity = _MAX_VELOCITY if velocity > 0 else -_MAX_VELOCITY
        self._velocity = velocity

    def getTargetPosition(self):
        return self._position

    def getVelocity(self):
        return self._velocity

    def getMaxVelocity(self):
        return _MAX_VELOCITY


class Sensor(Device):
    """Measures from the step after `enable` on."""

    def __init__(self, robot, name, measure):
        super().__init__(robot, name)
        self._measure = measure
        self._period = 0
        self._value = None

    def enable(self, sampling_period):
        self._period = int(sampling_period)
        if self._period <= 0:
            self.disable()

    def disable(self):
        self._period = 0
        self._value = None

    def getSamplingPeriod(self):
        return self._period

    def _update(self, measured):
        if self._period > 0:
            self._value = self._measure(measured)


class _OneValue(Sensor):
    def getValue(self):
        return _NOTHING if self._value is None else self._value


class DistanceSensor(_OneValue):
    def getMinValue(self):
        return 0.0

    def getMaxValue(self):
        return _RANGE


class PositionSensor(_OneValue):
    pass


class _ThreeValues(Sensor):
    def getValues(self):
        return [_NOTHING] * 3 if self._value is None else list(self._value)


class GPS(_ThreeValues):
    pass


class Compass(_ThreeValues):
    pass


def _north(heading):
    import math
    return math.sin(heading), math.cos(heading), 0.0


class Robot:
    _exists = False

    def __init__(self):
        if Robot._exists:
            raise RuntimeError('a program has one Robot() only')
        Robot._exists = True
        self._received = b''
        _, time_step, self._name = self._receive().split(' ', 2)
        self._time_step = int(time_step)
        self._time = 0.0
        self._motors = [Motor(self, side + ' wheel motor') for side in ('left', 'right')]
        self._sensors = [DistanceSensor(self, f'ds{i}', lambda measured, i=i: measured[1 + i]) for i in range(7)]
        self._sensors += [GPS(self, 'gps', lambda measured: (measured[8], measured[9], 0.0)),
                          Compass(self, 'compass', lambda measured: _north(measured[10])),
                          PositionSensor(self, 'left wheel sensor', lambda measured: measured[11]),
                          PositionSensor(self, 'right wheel sensor', lambda measured: measured[12])]
        self._devices = {device.getName(): device for device in self._motors + self._sensors}

    def getName(self):
        return self._name

    def getTime(self):
        """Simulated seconds."""
        return self._time

    def getBasicTimeStep(self):
        return float(self._time_step)

    def getNumberOfDevices(self):
        return len(self._devices)

    def getDeviceByIndex(self, index):
        return list(self._devices.values())[index]

    def getDevice(self, name):
        device = self._devices.get(name)
        if device is None:
            _warn(f'the robot has no device "{name}"; it has {", ".join(self._devices)}.')
        return device

    def step(self, time_step=None):
        """Has the robot do for so many milliseconds what the motors were told. -1: the simulation is over."""
        duration = self._time_step if time_step is None else max(1, min(int(time_step), 10**9))
        wishes = ' '.join(f'{motor._position!r} {motor._velocity!r}' for motor in self._motors)
        try:
            os.write(_SOCKET, f'step {duration} {wishes}\n'.encode())
        except OSError:
            return -1
        line = self._receive()
        if not line:
            return -1
        measured = [float(word) for word in line.split()]
        self._time = measured[0] / 1000
        for sensor in self._sensors:
            sensor._update(measured)
        return 0

    def _receive(self):
        while b'\n' not in self._received:
            try:
                more = os.read(_SOCKET, 4096)
            except OSError:
                more = b''
            if not more:
                return ''
            self._received += more
        line, self._received = self._received.split(b'\n', 1)
        return line.decode()


def _report(kind, error, trace):
    """Shows where in the program it happened, without the lines of this file."""
    kept = []
    while trace:
        if trace.tb_frame.f_code.co_filename != _report.__code__.co_filename:
            kept.append(trace)
        trace = trace.tb_next
    for here, there in zip(kept, kept[1:] + [None]):
        here.tb_next = there
    sys.__excepthook__(kind, error.with_traceback(kept[0] if kept else None), kept[0] if kept else None)


def _run(file):
    # What programs import as `controller` is this module; `__main__` is theirs.
    sys.modules['controller'] = sys.modules['__main__']
    program = type(sys)('__main__')
    program.__file__ = file
    sys.modules['__main__'] = program
    sys.argv = [file]
    sys.path[0] = os.getcwd()
    sys.excepthook = _report
    with open(file, 'rb') as text:
        code = compile(text.read(), file, 'exec')
    exec(code, program.__dict__)


if __name__ == '__main__':
    _run(sys.argv[1])
