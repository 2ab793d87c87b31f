"""What the package makes of what is wrong: package.py PORT TIMEOUT_MS."""

from fingertip import Fault, Mode, registers


for number in range(registers.FAULT.largest + 1):
    Fault(number)
for number in range(registers.PRESENT_MODE.largest + 1):
    Mode(number)
