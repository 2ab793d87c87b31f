"""Command a force over the bus, with ROBOTIS' package `dynamixel-sdk` and the registers by name.

    pip install ./python
    python force.py --port /dev/ttyACM0 --newtons 1.5

The port is that of the board, or what `cargo xtask serve` prints.
"""

import argparse
import sys

from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, PacketHandler, PortHandler

from fingertip import registers as reg

BAUD = 1_000_000
MODES = ["off", "tare", "approach", "force", "release", "fault", "identify", "commission"]
TARING, TARED = 1, 2  # of the register TARE_STATE


class PatientPort(PortHandler):
    """Waits longer for an answer: a simulated board may be slower than a real one."""

    patience_ms = 0

    def setPacketTimeout(self, packet_length):
        super().setPacketTimeout(packet_length)
        self.packet_timeout += self.patience_ms


class Fingertip:
    """A fingertip controller on the bus."""

    def __init__(self, port, device_id):
        self.port, self.id, self.packets = port, device_id, PacketHandler(2.0)

    def check(self, doing, result, error):
        if result != COMM_SUCCESS:
            sys.exit(f"{doing}: {self.packets.getTxRxResult(result)}")
        if error & 0x7F:
            sys.exit(f"{doing}: {self.packets.getRxPacketError(error & 0x7F)}")

    def ping(self):
        model, result, error = self.packets.ping(self.port, self.id)
        self.check("ping", result, error)
        return model

    def read(self, register):
        size = register.width * register.numbers
        data, result, error = self.packets.readTxRx(self.port, self.id, register.address, size)
        self.check(f"read {register.address}", result, error)
        values = [
            int.from_bytes(bytes(data[at : at + register.width]), "little", signed=register.signed)
            for at in range(0, size, register.width)
        ]
        return values if register.numbers > 1 else values[0]

    def write(self, register, value):
        data = list(value.to_bytes(register.width, "little", signed=register.signed))
        result, error = self.packets.writeTxRx(self.port, self.id, register.address, len(data), data)
        self.check(f"write {register.address}", result, error)

    def tare(self):
        """Measures every taxel's zero; nothing may touch the tip."""
        self.write(reg.TORQUE_ENABLE, 0)
        self.write(reg.TARE, 1)
        while (state := self.read(reg.TARE_STATE)) == TARING:
            pass
        if state != TARED:
            sys.exit(f"tare: fault {self.read(reg.FAULT)}")


def sync_read(port, ids, register):
    """One register of several devices, in one exchange."""
    group = GroupSyncRead(port, PacketHandler(2.0), register.address, register.width)
    for device_id in ids:
        group.addParam(device_id)
    if group.txRxPacket() != COMM_SUCCESS:
        sys.exit("sync read: no answer")
    data = [group.getData(device_id, register.address, register.width) for device_id in ids]
    return [int.from_bytes(v.to_bytes(register.width, "little"), "little", signed=register.signed) for v in data]


def main():
    arguments = argparse.ArgumentParser(description="Touch, hold a force, let go.")
    arguments.add_argument("--port", required=True, help="serial port or pseudo-terminal")
    arguments.add_argument("--id", type=int, default=1)
    arguments.add_argument("--newtons", type=float, default=1.0)
    arguments.add_argument("--readings", type=int, default=1000, help="how often to read the force while it is held")
    arguments.add_argument("--patience-ms", type=int, default=10_000, help="how much longer to wait for an answer: a simulated board may be slow")
    arguments = arguments.parse_args()

    port = PatientPort(arguments.port)
    port.patience_ms = arguments.patience_ms
    if not port.openPort() or not port.setBaudRate(BAUD):
        sys.exit(f"cannot open {arguments.port}")
    finger = Fingertip(port, arguments.id)
    print(f"model {finger.ping()}")

    finger.tare()
    print(f"tared, force {finger.read(reg.PRESENT_FORCE_MN)} mN")
    finger.write(reg.TORQUE_ENABLE, 1)
    finger.write(reg.GOAL_FORCE_MN, round(1000 * arguments.newtons))
    while finger.read(reg.PRESENT_MODE) != MODES.index("force"):
        if finger.read(reg.FAULT):
            sys.exit(f"approach: fault {finger.read(reg.FAULT)}")
    print("touched")

    for _ in range(arguments.readings):
        [force_mn] = sync_read(port, [arguments.id], reg.PRESENT_FORCE_MN)
    indentation_um, radius_um = finger.read(reg.INDENTATION_UM), finger.read(reg.CONTACT_RADIUS_UM)
    print(f"holding {force_mn} mN: indentation {indentation_um} um, contact radius {radius_um} um")
    print(f"peak {max(finger.read(reg.PRESSURES)) / 100:.1f} kPa")

    finger.write(reg.GOAL_FORCE_MN, 0)
    while finger.read(reg.PRESENT_FORCE_MN) > 10:
        pass
    finger.write(reg.TORQUE_ENABLE, 0)
    print(f"let go, mode {MODES[finger.read(reg.PRESENT_MODE)]}")
    port.closePort()


if __name__ == "__main__":
    main()
