"""Third-party clients on a served fingertip: each uses as much of the bus as it supports, in its usual manner.

    python clients.py PORT FOLDER --patience-ms 7200000

FOLDER holds `dynamixel.model` and `fingertip.model`. With --patience-ms 0 each client waits for its own default time;
a test waits longer, so that it passes on a slow machine. One line reports what each client did.
"""

import argparse
import pathlib
import sys

import dynamixel_easy_sdk.control_table
import dynamixel_sdk
import rustypot
from dynamixel_easy_sdk.connector import Connector
from dynamixel_easy_sdk.data_types import OperatingMode

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "python"))
from fingertip import registers as reg  # noqa: E402

ID, BAUD = 1, 1_000_000
ok = dynamixel_sdk.COMM_SUCCESS


def number(data, signed=True):
    return int.from_bytes(bytes(data), "little", signed=signed)


def sdk(port):
    """dynamixel-sdk: reads across gaps, bulk and fast bulk reads, indirect access, Clear."""
    packets = dynamixel_sdk.PacketHandler(2.0)
    done = 0

    def read(address, length):
        nonlocal done
        done += 1
        data, result, error = packets.readTxRx(port, ID, address, length)
        assert (result, error & 0x7F) == (ok, 0), (address, result, error)
        return data

    def write(address, data):
        nonlocal done
        done += 1
        result, error = packets.writeTxRx(port, ID, address, len(data), list(data))
        assert result == ok, (address, result)
        return error & 0x7F

    assert packets.ping(port, ID)[:2] == (21574, ok)
    assert packets.broadcastPing(port) == ({ID: [21574, 1]}, ok)

    # Whatever an earlier client left.
    assert write(reg.TORQUE_ENABLE.address, [0]) == 0

    # From the least address to the largest, whatever lies between.
    least, largest = reg.TORQUE_ENABLE.address, reg.PRESENT_MODE.address + 54
    assert len(read(least, largest - least)) == largest - least
    for fast in [False, True]:
        bulk = dynamixel_sdk.GroupBulkRead(port, packets)
        assert bulk.addParam(ID, least, largest - least)
        done += 1
        assert (bulk.fastBulkRead() if fast else bulk.txRxPacket()) == ok
        assert bulk.isAvailable(ID, reg.PRESENT_FORCE_MN.address, 4)
        assert bulk.getData(ID, reg.GOAL_FORCE_MN.address, 4) == 0
    sync = dynamixel_sdk.GroupSyncRead(port, packets, reg.PRESENT_MODE.address, 62)
    assert sync.addParam(ID)
    done += 2
    assert sync.txRxPacket() == ok and sync.getData(ID, reg.PRESENT_FORCE_MN.address, 4) == 0
    assert sync.fastSyncRead() == ok and sync.getData(ID, reg.FRAME_PERIOD_NS.address, 4) > 0

    # Bytes gathered from three places, and a goal written through others.
    def lead(block, target, count):
        return write(block, b"".join((target + place).to_bytes(2, "little") for place in range(count)))

    assert lead(reg.INDIRECT_ADDRESS_29.address, reg.PRESENT_FORCE_MN.address, 4) == 0
    assert lead(reg.INDIRECT_ADDRESS_29.address + 8, reg.FAULT.address, 1) == 0
    assert lead(reg.INDIRECT_ADDRESS_1.address, reg.GOAL_FORCE_MN.address, 4) == 0
    assert lead(reg.INDIRECT_ADDRESS_1.address + 8, reg.INDIRECT_DATA_1.address, 1) == 4
    assert write(reg.TORQUE_ENABLE.address, [1]) == 0
    assert write(reg.INDIRECT_DATA_1.address, (1500).to_bytes(4, "little")) == 0
    assert number(read(reg.GOAL_FORCE_MN.address, 4)) == 1500
    assert number(read(reg.INDIRECT_DATA_29.address, 4)) == number(read(reg.PRESENT_FORCE_MN.address, 4))
    assert read(reg.INDIRECT_DATA_29.address + 4, 1) == [0]
    assert write(reg.TORQUE_ENABLE.address, [0]) == 0
    assert number(read(reg.GOAL_FORCE_MN.address, 4)) == 0, "torque off takes the goal back"

    # The error numbers of ROBOTIS: range, length, limit, access.
    goal = reg.GOAL_FORCE_MN.address
    assert write(goal, (200_000).to_bytes(4, "little")) == 4
    assert write(goal, [0]) == 5
    assert write(goal, (9_000).to_bytes(4, "little")) == 6
    assert write(reg.PRESENT_FORCE_MN.address, [0] * 4) == 7
    done += 1
    clear_turns, _ = packets.clearMultiTurn(port, ID)[0:2]
    assert clear_turns == ok
    return done


def easy(name, folder):
    """dynamixel_easy_sdk: by the model file alone."""
    dynamixel_easy_sdk.control_table.CONTROL_TABLE_PATH = folder
    connector = Connector(name, BAUD)
    [motor] = connector.createAllMotors()
    assert motor.model_number == 21574 and motor.model_name == "fingertip.model"
    assert motor.getOperatingMode() == OperatingMode.CURRENT
    motor.disableTorque()
    motor.setOperatingMode(OperatingMode.CURRENT)
    motor.enableTorque()
    motor.setGoalCurrent(1_200)
    held = [motor.getPresentCurrent(), motor.getPresentPWM(), motor.getPresentVelocity(), motor.getPresentPosition()]
    assert all(isinstance(value, int) for value in held)
    group = connector.createGroupExecutor()
    group.addCmd(motor.stageSetGoalCurrent(1_300))
    group.executeWrite()
    group.addCmd(motor.stageGetPresentCurrent())
    assert len(group.executeRead()) == 1
    item = motor.control_table["Goal Force"]
    assert motor._readData(ID, item.address, item.size) == 1_300
    motor.disableTorque()
    assert motor._readData(ID, item.address, item.size) == 0
    connector.closePort()
    return 17


def rusty(name, patience_s):
    """rustypot: addresses of 8 bits."""
    finger = rustypot.Xl330PyController(name, BAUD, patience_s or 0.01)
    assert finger.ping(ID)
    # All that it drives by: one read below 256.
    begin = reg.MIRROR_GOAL_MN.address
    state = finger.read_raw_data(ID, begin, 19)
    assert len(state) == 19 and number(state[0:4]) == 0
    finger.write_torque_enable(ID, True)
    finger.write_raw_data(ID, begin, list((800).to_bytes(4, "little")))
    state = finger.read_raw_data(ID, begin, 19)
    assert number(state[0:4]) == 800
    # And as the servo that it takes the finger for.
    def one(value):
        return value[0] if isinstance(value, (list, tuple)) else value

    finger.write_goal_current(ID, 900)
    assert one(finger.read_goal_current(ID)) == 900
    assert isinstance(one(finger.read_present_current(ID)), int)
    assert one(finger.sync_read_present_current([ID])) == one(finger.read_present_current(ID))
    # Any register, by the indirect addresses of the X series.
    for place in range(4):
        finger.write_raw_data(ID, reg.INDIRECT_ADDRESS_1.address + 2 * place, list((reg.PRESSURES.address + place).to_bytes(2, "little")))
    assert len(finger.read_raw_data(ID, reg.INDIRECT_DATA_1.address, 4)) == 4
    finger.write_torque_enable(ID, False)
    assert one(finger.read_goal_current(ID)) == 0
    return 17


class PatientPort(dynamixel_sdk.PortHandler):
    """Waits longer for an answer."""

    patience_ms = 0

    def setPacketTimeout(self, packet_length):
        super().setPacketTimeout(packet_length)
        self.packet_timeout += PatientPort.patience_ms


def main():
    arguments = argparse.ArgumentParser(description="Try clients on a served fingertip.")
    arguments.add_argument("port")
    arguments.add_argument("folder", help="where dynamixel.model and fingertip.model are")
    arguments.add_argument("--patience-ms", type=int, default=0, help="how much longer to wait than by default")
    arguments = arguments.parse_args()
    PatientPort.patience_ms = arguments.patience_ms
    dynamixel_easy_sdk.connector.PortHandler = PatientPort

    port = PatientPort(arguments.port)
    assert port.openPort() and port.setBaudRate(BAUD)
    print(f"dynamixel-sdk: {sdk(port)} operations")
    port.closePort()
    print(f"dynamixel_easy_sdk: {easy(arguments.port, arguments.folder)} operations")
    print(f"rustypot: {rusty(arguments.port, arguments.patience_ms / 1000)} operations")


if __name__ == "__main__":
    main()
