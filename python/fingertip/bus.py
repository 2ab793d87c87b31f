"""Registers read and written, by `dynamixel-sdk`."""

import errno
import os
import threading
import time
import weakref
from typing import Any, List, Optional, Tuple, Type

import serial  # type: ignore[import-untyped, unused-ignore]
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
_TCP, _BUSY = "tcp:", b"busy: "
_POLL_S = 0.01  # longest wait for bytes before the time-out is looked at
_PORT_ERRORS: Tuple[Type[Exception], ...] = (OSError,)
try:
    import termios

    _PORT_ERRORS += (termios.error,)
except ImportError:
    pass  # not on Windows


class FingertipError(Exception):
    """Something went wrong on the bus."""


class NoAnswer(FingertipError):
    """There was no answer, or a damaged one."""


class Refused(FingertipError):
    """The controller refused; `number` is the protocol's."""

    def __init__(self, doing: str, number: int):
        super().__init__(f"{doing}: refused with error {number}: {_ERRORS.get(number, 'unknown')}")
        self.number = number


class PortLost(FingertipError):
    """The port is closed, was unplugged, or serves another client."""


class _Line(PortHandler):  # type: ignore[misc]
    """An open port. All objects of this program that name the same port share one: several devices on one bus."""

    def __init__(self, name: str, baud: int):
        super().__init__(name)
        self.lock = threading.RLock()  # held during one exchange
        self.users: "weakref.WeakSet[Bus]" = weakref.WeakSet()
        self.patience_ms = 0.0  # time beyond the SDK's: a controller behind USB or on a busy machine may be late
        self.owed = False  # an answer may still come
        self.heard, self._again = b"", b""  # bytes of this exchange, and those to be read a second time
        self._looked = False
        if not self.setBaudRate(baud):
            raise FingertipError(f"cannot open {name} at {baud} baud")

    def setupPort(self, cflag_baud: int) -> bool:
        name = self.port_name
        url = "socket://" + name[len(_TCP) :] if name.startswith(_TCP) else name
        # Two programs on one line would read each other's answers: `exclusive` is the `flock` of the tool `fingertip`.
        self.ser = serial.serial_for_url(url, baudrate=self.baudrate, timeout=_POLL_S, exclusive=True)
        self.tx_time_per_byte = 10_000.0 / self.baudrate
        self.is_open = True
        return True

    def closePort(self) -> None:
        if self.is_open:
            super().closePort()

    def clearPort(self) -> None:
        if not self.port_name.startswith(_TCP):
            self.ser.reset_input_buffer()
            return
        # What a served finger tells a second client may be there already, and the end of the connection.
        while self.ser.in_waiting:
            self.readPort(len(_BUSY))

    def readPort(self, length: int) -> bytes:
        if self._again:
            data, self._again = self._again[:length], self._again[length:]
            return data
        data = bytes(self.ser.read(length))
        self.heard += data
        if data.startswith(_BUSY):
            # A served finger tells a second client in words that the port is in use.
            raise serial.SerialException((data + self.ser.readline()).decode(errors="replace").strip())
        return data

    def writePort(self, packet: Any) -> int:
        self.owed, self.heard, self._again = True, b"", b""
        return int(self.ser.write(packet))

    def settle(self, packets: Any) -> None:
        """Waits for an answer that is still owed: the protocol does not number its packets.

        Without this, the late answer would be taken for the next one. Ctrl-C may have ended the exchange before with a
        part of the answer read.
        """
        if self.owed:
            self._again = self.heard
            self.setPacketTimeout(0)
            packets.rxPacket(self, False)

    def getCurrentTime(self) -> float:
        return time.monotonic() * 1000.0

    def setPacketTimeout(self, packet_length: int) -> None:
        super().setPacketTimeout(packet_length)
        self.packet_timeout += self.patience_ms
        self._looked = False

    def isPacketTimeout(self) -> bool:
        """Returns True once the time is over and the port was read once more after that.

        A busy machine may stop this program between a read and this call until the time is over. The answer has often
        come meanwhile.
        """
        if self._looked:
            return True
        self._looked = self.getTimeSinceStart() > self.packet_timeout
        return False


_lines: "weakref.WeakValueDictionary[str, _Line]" = weakref.WeakValueDictionary()
_opening = threading.Lock()


class Bus:
    """One controller on a port: a serial port, a pseudo-terminal, or `tcp:ADDRESS:PORT` of a served finger.

    Threads may share it: each exchange is whole.
    """

    def __init__(self, port: str, device_id: int = 1, baud: int = 1_000_000, timeout_ms: float = 100.0):
        self.name, self.device_id, self.baud, self._timeout_ms = port, device_id, baud, timeout_ms
        self._packets: Any = PacketHandler(2.0)
        key = port if port.startswith(_TCP) else os.path.realpath(port)
        with _opening:
            line = _lines.get(key)
            if line is None or not line.is_open:
                try:
                    line = _Line(port, baud)
                except _PORT_ERRORS as why:
                    raise FingertipError(f"cannot open {port}: {_reason(why)}") from None
                _lines[key] = line
            elif line.baudrate != baud:
                raise FingertipError(f"cannot open {port} at {baud} baud: this program uses it at {line.baudrate} baud")
            line.users.add(self)
            self._port: Any = line

    def __enter__(self) -> "Bus":
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], why: Any, trace: Any) -> None:
        self.close()

    def close(self) -> None:
        """Gives the port back."""
        with _opening, self._port.lock:
            self._port.users.discard(self)
            if not self._port.users:
                self._port.closePort()

    def ping(self) -> int:
        """The model number of who answers."""
        return int(self._ask("ping", self._packets.ping))

    def read_bytes(self, address: int, length: int) -> bytes:
        """Bytes of the control table, 1 to 256 of them."""
        doing = f"read {length} bytes at {address}"
        with self._port.lock:
            data = bytes(self._ask(doing, self._packets.readTxRx, address, length))
            if len(data) != length:
                self._port.owed, self._port.heard = True, b""  # that was another answer
                raise NoAnswer(f"{doing}: {len(data)} came")
        return data

    def write_bytes(self, address: int, data: bytes, doing: str = "") -> None:
        """Writes whole registers side by side: all of it happens or nothing."""
        doing = doing or f"write {len(data)} bytes at {address}"
        self._ask(doing, self._packets.writeTxRx, address, len(data), list(data))

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

    def _ask(self, doing: str, call: Any, *arguments: Any) -> Any:
        """One exchange with the controller. Returns what the SDK's call returns in front of result and error."""
        line = self._port
        with line.lock:
            if self not in line.users or not line.is_open:
                raise PortLost(f"{doing}: {self.name} is not open any more")
            line.patience_ms = self._timeout_ms
            try:
                line.settle(self._packets)
                line.is_using = False  # Ctrl-C may have ended the exchange before
                *data, result, error = call(line, self.device_id, *arguments)
                line.owed = result != COMM_SUCCESS
            except _PORT_ERRORS as lost:
                line.closePort()
                raise PortLost(f"{self.name}: {_reason(lost)}; is it still connected?") from lost
        if result != COMM_SUCCESS:
            why = self._packets.getTxRxResult(result)
            raise NoAnswer(f"{doing}: no answer of ID {self.device_id} on {self.name} at {self.baud} baud ({why})")
        if error & ~_ALERT:
            raise Refused(doing, error & ~_ALERT)
        return data[0] if data else None


def _reason(why: Exception) -> str:
    """The system's reason for an error of a port."""
    number = getattr(why, "errno", None)
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has it open"
    return os.strerror(number) if number else str(why.args[-1] if why.args else why)


def numbers(register: Register, data: bytes) -> List[int]:
    """What bytes come to."""
    width = register.width
    words = [data[at : at + width] for at in range(0, width * register.numbers, width)]
    return [int.from_bytes(word, "little", signed=register.signed) * register.scale for word in words]
