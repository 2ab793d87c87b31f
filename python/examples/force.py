"""Command a force over the bus, with ROBOTIS' package `dynamixel-sdk` and the registers by name.

    pip install ./python
    python force.py --port /dev/ttyACM0 --newtons 1.5

The port is that of the board, or what `cargo xtask serve` prints. Whatever ends the program, the finger lets go: by the
program itself, or by the bus watchdog where the program was killed or the link is lost.
"""

import argparse
import signal
import sys
import time
from typing import Any, List, Sequence

from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler, PortHandler  # type: ignore[import-untyped]

from fingertip import registers as reg

BAUD = 1_000_000
MODES = ["off", "tare", "approach", "force", "release", "fault", "press", "strokes"]
TARING, TARED = 1, 2  # of the register TARE_STATE
WATCHDOG = 25  # in units of 20 ms
SIGNALS = [getattr(signal, name) for name in ["SIGTERM", "SIGHUP"] if hasattr(signal, name)]


class PatientPort(PortHandler):  # type: ignore[misc]
    """Waits longer for an answer: a simulated board may be slower than a real one."""

    patience_ms = 0

    def setPacketTimeout(self, packet_length: int) -> None:
        super().setPacketTimeout(packet_length)
        self.packet_timeout += self.patience_ms


class Fingertip:
    """A fingertip controller on the bus."""

    def __init__(self, port: PatientPort, device_id: int) -> None:
        self.port, self.id, self.packets = port, device_id, PacketHandler(2.0)

    def check(self, doing: str, result: int, error: int) -> None:
        if result != COMM_SUCCESS:
            sys.exit(f"{doing}: {self.packets.getTxRxResult(result)}")
        if error & 0x7F:
            sys.exit(f"{doing}: {self.packets.getRxPacketError(error & 0x7F)}")

    def ping(self) -> int:
        model, result, error = self.packets.ping(self.port, self.id)
        self.check("ping", result, error)
        return int(model)

    def read_all(self, register: reg.Register) -> List[int]:
        size = register.width * register.numbers
        data, result, error = self.packets.readTxRx(self.port, self.id, register.address, size)
        self.check(f"read {register.address}", result, error)
        return [
            int.from_bytes(bytes(data[at : at + register.width]), "little", signed=register.signed)
            for at in range(0, size, register.width)
        ]

    def read(self, register: reg.Register) -> int:
        return self.read_all(register)[0]

    def write(self, register: reg.Register, value: int) -> None:
        data = list(value.to_bytes(register.width, "little", signed=register.signed))
        result, error = self.packets.writeTxRx(self.port, self.id, register.address, len(data), data)
        self.check(f"write {register.address}", result, error)

    def tare(self) -> None:
        """Measures every taxel's zero; nothing may touch the tip."""
        self.write(reg.TORQUE_ENABLE, 0)
        self.write(reg.TARE, 1)
        while (state := self.read(reg.TARE_STATE)) == TARING:
            pass
        if state != TARED:
            sys.exit(f"tare: fault {self.read(reg.FAULT)}")

    def let_go(self) -> None:
        """Takes the tip off the object, then turns torque and watchdog off."""
        # A signal may have ended an exchange in the middle: its answer passes, and the port is free again.
        time.sleep(0.05)
        self.port.is_using = False
        self.write(reg.GOAL_FORCE_MN, 0)
        while MODES[self.read(reg.PRESENT_MODE)] in ["approach", "force", "release"]:
            at_rest = abs(self.read(reg.SPEED_UM_PER_S)) < 1_000 and self.read(reg.PRESENT_FORCE_MN) < 10
            if at_rest and MODES[self.read(reg.PRESENT_MODE)] == "release":
                break
        self.write(reg.TORQUE_ENABLE, 0)
        self.write(reg.BUS_WATCHDOG, 0)


def sync_read(port: PatientPort, ids: Sequence[int], register: reg.Register) -> List[int]:
    """One register of several devices, in one exchange."""
    group = GroupSyncRead(port, PacketHandler(2.0), register.address, register.width)
    for device_id in ids:
        group.addParam(device_id)
    if group.txRxPacket() != COMM_SUCCESS:
        sys.exit("sync read: no answer")
    data = [group.getData(device_id, register.address, register.width) for device_id in ids]
    return [int.from_bytes(v.to_bytes(register.width, "little"), "little", signed=register.signed) for v in data]


def hold(finger: Fingertip, newtons: float, readings: int) -> None:
    finger.write(reg.BUS_WATCHDOG, WATCHDOG)  # each read feeds it
    finger.write(reg.TORQUE_ENABLE, 1)
    finger.write(reg.GOAL_FORCE_MN, round(1000 * newtons))
    while finger.read(reg.PRESENT_MODE) != MODES.index("force"):
        if finger.read(reg.FAULT):
            sys.exit(f"approach: fault {finger.read(reg.FAULT)}")
    print("touched")
    force_mn = 0
    for _ in range(readings):
        [force_mn] = sync_read(finger.port, [finger.id], reg.PRESENT_FORCE_MN)
    indentation_um, radius_um = finger.read(reg.INDENTATION_UM), finger.read(reg.CONTACT_RADIUS_UM)
    print(f"holding {force_mn} mN: indentation {indentation_um} um, contact radius {radius_um} um")
    print(f"peak {max(finger.read_all(reg.PRESSURES)) / 100:.1f} kPa")


def end(number: int, frame: Any) -> None:
    for one in SIGNALS:
        signal.signal(one, signal.SIG_IGN)
    sys.exit(128 + number)


def main() -> None:
    parser = argparse.ArgumentParser(description="Touch, hold a force, let go.")
    parser.add_argument("--port", required=True, help="serial port or pseudo-terminal")
    parser.add_argument("--id", type=int, default=1)
    parser.add_argument("--newtons", type=float, default=1.0)
    parser.add_argument("--readings", type=int, default=1000, help="how often to read the force while it is held")
    parser.add_argument("--patience-ms", type=int, default=10_000, help="how much longer to wait for an answer: a simulated board may be slow")
    arguments = parser.parse_args()

    port = PatientPort(arguments.port)
    port.patience_ms = arguments.patience_ms
    if not port.openPort() or not port.setBaudRate(BAUD):
        sys.exit(f"cannot open {arguments.port}")
    finger = Fingertip(port, arguments.id)
    print(f"model {finger.ping()}")
    finger.tare()
    print(f"tared, force {finger.read(reg.PRESENT_FORCE_MN)} mN")
    for number in SIGNALS:
        signal.signal(number, end)
    try:
        hold(finger, arguments.newtons, arguments.readings)
    finally:
        finger.let_go()
    print(f"let go, mode {MODES[finger.read(reg.PRESENT_MODE)]}")
    port.closePort()


if __name__ == "__main__":
    main()
