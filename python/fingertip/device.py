"""Registers of one device, read and written."""

from typing import List

from .line import Line, NoAnswer
from .registers import Register


class Device:
    """A device on a line. Threads may share it: each exchange is whole."""

    def __init__(self, line: Line, device_id: int):
        if not 0 <= device_id <= 252:
            raise ValueError(f"device_id of {device_id}: 0 to 252 are allowed")
        self.line, self.device_id = line, device_id

    def ping(self) -> int:
        """Returns the model number."""
        return int(self.line.exchange("ping", self.device_id, self.line.packets.ping))

    def read_bytes(self, address: int, length: int) -> bytes:
        """Bytes of the control table, 1 to 256 of them."""
        doing = f"read {length} bytes at {address}"
        with self.line.lock:
            data = bytes(self.line.exchange(doing, self.device_id, self.line.packets.readTxRx, address, length))
            if len(data) != length:
                self.line.expect_another()
                raise NoAnswer(f"{doing}: {len(data)} came")
        return data

    def write_bytes(self, address: int, data: bytes, doing: str = "") -> None:
        """Writes whole registers side by side: all of it happens or nothing."""
        doing = doing or f"write {len(data)} bytes at {address}"
        self.line.exchange(doing, self.device_id, self.line.packets.writeTxRx, address, len(data), list(data))

    def read(self, register: Register) -> int:
        """The number of a register, in the unit that its name ends with."""
        return self.read_all(register)[0]

    def read_all(self, register: Register) -> List[int]:
        """The numbers of a register that has many."""
        return numbers(register, self.read_bytes(register.address, register.width * register.numbers))

    def write(self, register: Register, value: int) -> None:
        """Sets a register, in the unit that its name ends with."""
        self.write_bytes(register.address, encoded(register, value), f"set {register.name} to {value}")


def numbers(register: Register, data: bytes) -> List[int]:
    """The numbers that a register's bytes stand for."""
    width = register.width
    words = [data[at : at + width] for at in range(0, width * register.numbers, width)]
    return [int.from_bytes(word, "little", signed=register.signed) * register.scale for word in words]


def encoded(register: Register, value: int) -> bytes:
    """The bytes that a register's number is sent as."""
    raw, rest = divmod(value, register.scale)
    if rest or not register.least <= raw <= register.largest:
        least, largest = register.least * register.scale, register.largest * register.scale
        steps = f" in steps of {register.scale}" if register.scale != 1 else ""
        raise ValueError(f"{register.name} of {value}: {least} to {largest}{steps} are allowed")
    return raw.to_bytes(register.width, "little", signed=register.signed)
