"""What the package makes of wrong numbers, of what ends it, and of a controller that starts anew: package.py PORT TIMEOUT_MS."""

import os
import sys
import unittest
from pathlib import Path

from fingertip import Fault, Fingertip, FingertipError, Mode, Restarted, registers


def refused(doing, error):
    try:
        doing()
    except error:
        return
    raise AssertionError(f"{doing} was not refused with {error}")


def restart(finger):
    """A broadcast, which nobody answers."""
    finger._packets.txPacket(finger._port, [0xFF, 0xFF, 0xFD, 0, 254, 3, 0, 8, 0, 0])
    finger._port.is_using = finger._port.owed = False


for number in range(registers.FAULT.largest + 1):
    Fault(number)
for number in range(registers.PRESENT_MODE.largest + 1):
    Mode(number)

with Fingertip(sys.argv[1], timeout_ms=float(sys.argv[2])) as finger:
    finger.tare()
    # Beyond what the register takes, beyond force_max_mn, and no number at all.
    for newtons, error in [(-1.0, ValueError), (1e6, ValueError), (100.0, FingertipError), (float("nan"), ValueError)]:
        refused(lambda: finger.press(newtons), error)
        assert finger.read(registers.TORQUE_ENABLE) == 0, newtons
    for rate_hz, seconds in [(float("nan"), 1.0), (-1.0, 1.0), (1e-30, 1.0), (100.0, float("nan")), (100.0, -1.0)]:
        refused(lambda: next(finger.stream(rate_hz, seconds)), ValueError)
    assert len(list(finger.stream(0, 0.05, pressures=False))) > 1, "0 is as fast as it goes"

    stream = finger.stream(0, pressures=False)
    [next(stream) for _ in range(10)]
    restart(finger)
    refused(lambda: [None for _ in stream], FingertipError)
    # What comes then is of another time, which begins anew.
    assert finger.state().time_s == 0.0
    refused(lambda: finger.press(1.0), FingertipError)

    # A jog or a measurement during which it starts anew showed nothing.
    read = finger.read

    def read_and_restart(register):
        value = read(register)
        if register is registers.FRAME_COUNTER:
            finger.read = read
            restart(finger)
        return value

    for task in [finger.jog, finger.measure_drive]:
        finger.tare()
        finger.read = read_and_restart
        refused(task, Restarted)

    # A number is written as it is read, in the register's unit.
    finger.write(registers.BUS_WATCHDOG, 500)
    assert finger.read(registers.BUS_WATCHDOG) == 500
    finger.write(registers.BUS_WATCHDOG, 0)
    for value in [10, 2560, -20]:
        refused(lambda: finger.write(registers.BUS_WATCHDOG, value), ValueError)

    # The watchdog is there as long as it presses.
    for silence_s in [0.0, 3.0, float("nan")]:
        refused(lambda: finger.press(1.0, silence_s), ValueError)
    finger.tare()
    finger.press(0.5, silence_s=2.54)
    assert finger.read(registers.BUS_WATCHDOG) == 2540
    finger.release()
    assert finger.read(registers.BUS_WATCHDOG) == 0

# What ends the block before its end turns torque off.
try:
    with Fingertip(sys.argv[1], timeout_ms=float(sys.argv[2])) as finger:
        finger.press(0.5)
        raise KeyboardInterrupt
except KeyboardInterrupt:
    pass
with Fingertip(sys.argv[1], timeout_ms=float(sys.argv[2])) as finger:
    assert finger.read(registers.TORQUE_ENABLE) == 0

os.environ.update(FINGERTIP_PORT=sys.argv[1], FINGERTIP_TIMEOUT_MS=sys.argv[2])
tests = unittest.defaultTestLoader.discover(str(Path(__file__).resolve().parents[3] / "python/tests"))
sys.exit(not unittest.TextTestRunner().run(tests).wasSuccessful())
