"""Registers read and written, by `dynamixel-sdk`."""

import os
import time
from typing import Any, List, Optional, Type

from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler  # type: ignore[import-untyped]

from .registers import Register

_ERRORS = {
    1: "it was understood, but cannot be carried out as the loop stands now",
    2: "it knows no such instruction",
    3: "the packet arrived damaged: is the line noisy?",
    4: "a value outside of its register's range",
    5: "the data do not cover whole registers",
    6: "a value beyond what other registers allow",
    7: "the register cannot be written, or not while torque is on",
}
_ALERT = 0x80


class FingertipError(Exception):
    """Something went wrong on the bus."""


class NoAnswer(FingertipError):
    """There was no answer, or a damaged one."""


class Refused(FingertipError):
    """The controller refused; `number` is the protocol's."""

    def __init__(self, doing: str, number: int):
        super().__init__(f"{doing}: refused with error {number}: {_ERRORS.get(number, 'unknown')}")
        self.number = number


class _PatientPort(PortHandler):  # type: ignore[misc]
    """Waits longer than a real controller takes: one behind USB or on a busy machine may be late."""

    patience_ms = 0.0

    def setPacketTimeout(self, packet_length: int) -> None:
        super().setPacketTimeout(packet_length)
        self.packet_timeout += self.patience_ms


class Bus:
    """One controller on a port."""

    def __init__(self, port: str, device_id: int = 1, baud: int = 1_000_000, timeout_ms: float = 100.0):
        self.name, self.device_id, self.baud = port, device_id, baud
        self._port: Any = _PatientPort(port)
        self._port.patience_ms = timeout_ms
        self._packets: Any = PacketHandler(2.0)
        try:
            opened = self._port.openPort() and self._port.setBaudRate(baud)
        except OSError as why:
            reason = os.strerror(why.errno) if why.errno else why
            raise FingertipError(f"cannot open {port}: {reason}") from None
        if not opened:
            raise FingertipError(f"cannot open {port} at {baud} baud")

    def __enter__(self) -> "Bus":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], why: Any, trace: Any) -> None:
        self.close()

    def close(self) -> None:
        """Gives the port back."""
        self._port.closePort()

    def ping(self) -> int:
        """The model number of who answers."""
        model, result, error = self._packets.ping(self._port, self.device_id)
        self._check("ping", result, error)
        return int(model)

    def read_bytes(self, address: int, length: int) -> bytes:
        """Bytes of the control table, 1 to 256 of them."""
        data, result, error = self._packets.readTxRx(self._port, self.device_id, address, length)
        self._check(f"read {length} bytes at {address}", result, error)
        if len(data) != length:
            raise NoAnswer(f"read {length} bytes at {address}: {len(data)} came")
        return bytes(data)

    def write_bytes(self, address: int, data: bytes, doing: str = "") -> None:
        """Writes whole registers side by side: all of it happens or nothing."""
        result, error = self._packets.writeTxRx(self._port, self.device_id, address, len(data), list(data))
        self._check(doing or f"write {len(data)} bytes at {address}", result, error)

    def read(self, register: Register) -> int:
        """The number of a register, in the unit that its name ends with."""
        return numbers(register, self.read_bytes(register.address, register.width * register.numbers))[0]

    def read_all(self, register: Register) -> List[int]:
        """The numbers of a register that has many."""
        return numbers(register, self.read_bytes(register.address, register.width * register.numbers))

    def write(self, register: Register, value: int) -> None:
        """Sets a register, in the unit that its name ends with."""
        raw, rest = divmod(value, register.scale)
        if rest or not register.least <= raw <= register.largest:
            least, largest = register.least * register.scale, register.largest * register.scale
            steps = f" in steps of {register.scale}" if register.scale != 1 else ""
            raise ValueError(f"{register.name} of {value}: {least} to {largest}{steps} are allowed")
        data = raw.to_bytes(register.width, "little", signed=register.signed)
        self.write_bytes(register.address, data, f"set {register.name} to {value}")

    def _check(self, doing: str, result: int, error: int) -> None:
        if result != COMM_SUCCESS:
            # The protocol does not number its packets: an answer that comes late must not be taken for the next one.
            time.sleep(self._port.patience_ms / 1000.0)
            self._port.clearPort()
            why = self._packets.getTxRxResult(result)
            raise NoAnswer(f"{doing}: no answer of ID {self.device_id} on {self.name} at {self.baud} baud ({why})")
        if error & ~_ALERT:
            raise Refused(doing, error & ~_ALERT)


def numbers(register: Register, data: bytes) -> List[int]:
    """What bytes come to."""
    width = register.width
    words = [data[at : at + width] for at in range(0, width * register.numbers, width)]
    return [int.from_bytes(word, "little", signed=register.signed) * register.scale for word in words]
