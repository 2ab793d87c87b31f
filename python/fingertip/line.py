"""A port, and the packets that go over it by `dynamixel-sdk`."""

import errno
import os
import threading
import time
from typing import Any, Callable, Dict, Iterable, Mapping, Optional, Tuple, Type

import serial  # type: ignore[import-untyped, unused-ignore]
from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler, PortHandler  # type: ignore[import-untyped]
from serial.urlhandler import protocol_socket  # type: ignore[import-untyped, unused-ignore]

_ERRORS = {
    1: "it was understood, but cannot be carried out in this state of the controller",
    2: "it knows no such instruction",
    3: "the packet arrived damaged: is the line noisy?",
    4: "a value outside of its register's range",
    5: "the data do not cover whole registers",
    6: "a value beyond what other registers allow",
    7: "the register cannot be written, or not while torque is on; or another client of `fingertip share` commands",
}
DAMAGED, FORBIDDEN = 3, 7
_ALERT = 0x80
_BROADCAST = 254
_TCP, _BUSY = "tcp:", b"busy: "
_POLL_S = 0.01  # longest wait for bytes before the time-out is looked at
_WRITE_S = 5.0  # longest wait until the port takes a packet
_PACKET_MAX = 1024  # bytes of the longest packet that the SDK takes
# A Sync Write for no device. It is a broadcast: it feeds the watchdog of every controller, and none answers.
_KEEP_ALIVE = bytes([0xFF, 0xFF, 0xFD, 0, _BROADCAST, 7, 0, 0x83, 0, 0, 0, 0])
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


class _Babble(Exception):
    """The line does not fall silent, and nothing on it is an answer."""


class _Socket(protocol_socket.Serial):  # type: ignore[misc, unused-ignore]
    def reset_input_buffer(self) -> None:
        """Keeps the bytes received before the port was opened: a served finger sends a second client a refusal."""


class Line(PortHandler):  # type: ignore[misc]
    """An open port, with one exchange at a time: threads wait for each other."""

    def __init__(self, name: str, baud: int, timeout_ms: float):
        super().__init__(name)
        if not timeout_ms >= 0:
            raise ValueError(f"timeout_ms of {timeout_ms}: 0 or more")
        self.packets: Any = PacketHandler(2.0)
        self.lock = threading.RLock()
        self.timeout_ms = timeout_ms  # beyond the SDK's: a controller behind USB or on a busy machine may be late
        self.feed_s: Optional[float] = None  # time between two keep-alive packets; None: no watchdog is on
        self._fed_s = 0.0
        self._owed = False  # an answer may still come
        self._heard, self._again = b"", b""  # bytes of this exchange, and those to be read a second time
        self._looked, self._beyond = False, 0  # after the time-out: looked at the port once more, bytes since then
        crc = self.packets.updateCRC(0, _KEEP_ALIVE, len(_KEEP_ALIVE))
        self._keep_alive = _KEEP_ALIVE + bytes([crc & 0xFF, crc >> 8])
        try:
            opened = self.setBaudRate(baud)
        except _PORT_ERRORS + (ValueError,) as why:
            raise FingertipError(f"cannot open {name}: {_reason(why)}") from None
        if not opened:
            raise FingertipError(f"cannot open {name} at {baud} baud")

    def exchange(self, doing: str, device_id: int, call: Any, *arguments: Any) -> Any:
        """One exchange with a device. Returns the data of the SDK's call, without result and error."""

        def action() -> Tuple[Any, int]:
            *data, result, error = call(self, device_id, *arguments)
            return (data[0] if data else None, error), result

        data, error = self._run(f"{doing}: no answer of ID {device_id}", action)
        if error & ~_ALERT:
            raise Refused(doing, error & ~_ALERT)
        return data

    def sync_write(self, address: int, width: int, data: Mapping[int, bytes]) -> None:
        """Writes a register of several devices in one packet, without an answer."""
        flat = [byte for device_id, own in data.items() for byte in (device_id, *own)]
        self._run("sync write", lambda: (None, self.packets.syncWriteTxOnly(self, address, width, flat, len(flat))))

    def sync_read(self, address: int, length: int, ids: Iterable[int]) -> Dict[int, bytes]:
        """Reads the same bytes of several devices by Fast Sync Read; returns the parts if all of them arrived."""
        wanted, part = list(ids), length + 4  # error, ID and CRC

        def action() -> Tuple[bytes, int]:
            result = self.packets.syncReadTx(self, address, length, wanted, len(wanted), True)
            if result != COMM_SUCCESS:
                return b"", result
            data, result, _ = self.packets.fastSyncReadRx(self, _BROADCAST, part * len(wanted))
            return bytes(data), result

        data = self._run("sync read: not all answered", action)
        parts = [data[at : at + part] for at in range(0, len(data), part)]
        return {own[1]: own[2:-2] for own in parts if len(own) == part and own[1] in wanted and not own[0] & ~_ALERT}

    def scan(self) -> Dict[int, int]:
        """Model numbers of all devices that answer a broadcast Ping, by ID."""

        def action() -> Tuple[Any, int]:
            found, result = self.packets.broadcastPing(self)
            return found, COMM_SUCCESS if result == COMM_RX_TIMEOUT else result

        found = self._run("scan", action)
        return {device_id: model for device_id, (model, _) in found.items()}

    def feed(self) -> None:
        """Feeds the bus watchdogs while the program sends nothing."""
        self._run("keep alive", lambda: (None, COMM_SUCCESS))

    def keep_alive(self) -> None:
        """Feeds the bus watchdogs of all controllers by a broadcast, if it is due."""
        if self.feed_s is not None and time.monotonic() - self._fed_s > self.feed_s:
            self._fed_s = time.monotonic()
            self.ser.write(self._keep_alive)

    def _run(self, failing: str, action: Callable[[], Tuple[Any, int]]) -> Any:
        with self.lock:
            if not self.is_open:
                raise PortLost(f"{failing}: {self.port_name} is not open any more")
            came, result = None, COMM_RX_CORRUPT
            try:
                self._settle()
                self.keep_alive()
                self.is_using = False  # Ctrl-C may have ended the exchange before
                came, result = action()
                self._owed = result != COMM_SUCCESS
            except (_Babble, IndexError, serial.SerialTimeoutException):
                pass  # too short a packet in junk, or bytes not sent
            except PortLost:
                self.closePort()
                raise
            except _PORT_ERRORS as lost:
                self.closePort()
                raise PortLost(f"{self.port_name}: {_reason(lost)}; is it still connected?") from lost
        if result != COMM_SUCCESS:
            why = self.packets.getTxRxResult(result)
            raise NoAnswer(f"{failing} on {self.port_name} at {self.baudrate} baud ({why})")
        return came

    def _settle(self) -> None:
        """Waits once more for an answer that is still owed, as long as before: the protocol does not number its packets.

        Without this, the late answer would be taken for the next one. Ctrl-C may have ended the exchange before with a
        part of the answer read.
        """
        if self._owed:
            self._again = self._heard
            self.setPacketTimeout(0)
            try:
                self.packets.rxPacket(self, True)  # of any ID, also that of a Fast Sync Read
            except (_Babble, IndexError):
                pass

    def expect_another(self) -> None:
        """The answer that came was another one's: the right one is still owed."""
        self._owed, self._heard = True, b""

    # The SDK calls the following methods.

    def setupPort(self, cflag_baud: int) -> bool:
        name = self.port_name
        tcp = name.startswith(_TCP)
        kind, url = (_Socket, "socket://" + name[len(_TCP) :]) if tcp else (serial.Serial, name)
        # Two programs on one line would read each other's answers: `exclusive` is the `flock` of the tool `fingertip`.
        self.ser = kind(url, baudrate=self.baudrate, timeout=_POLL_S, write_timeout=_WRITE_S, exclusive=True)
        self.tx_time_per_byte = 10_000.0 / self.baudrate
        self.is_open = True
        return True

    def closePort(self) -> None:
        if self.is_open:
            try:
                super().closePort()
            except _PORT_ERRORS:
                self.is_open = False  # it was lost before

    def clearPort(self) -> None:
        if not self.port_name.startswith(_TCP):
            self.ser.reset_input_buffer()
            return
        for _ in range(_PACKET_MAX):
            if not self.ser.in_waiting:
                break
            # A served finger's refusal of a second client may be there already. The connection ends after it: a longer
            # read would only report that end.
            self.readPort(len(_BUSY))

    def readPort(self, length: int) -> bytes:
        if self._again:
            data, self._again = self._again[: max(0, length)], self._again[max(0, length) :]
            return data
        data = bytes(self.ser.read(length))
        self._heard += data
        if data.startswith(_BUSY):
            # A served finger refuses a second client with a line of text: the port is in use.
            raise PortLost(f"{self.port_name}: {(data + self.ser.readline()).decode(errors='replace').strip()}")
        beyond_ms = self.getTimeSinceStart() - self.packet_timeout
        if beyond_ms > 0:
            self._beyond += len(data)
            if self._beyond > 2 * _PACKET_MAX:
                raise _Babble
        elif beyond_ms > -self.timeout_ms and not data:
            # By the SDK's time-out an answer would have begun: this does not meet it on the line.
            self.keep_alive()
        return data

    def writePort(self, packet: Any) -> int:
        self._owed, self._heard, self._again = True, b"", b""
        return int(self.ser.write(packet))

    def getCurrentTime(self) -> float:
        return time.monotonic() * 1000.0

    def setPacketTimeout(self, packet_length: int) -> None:
        super().setPacketTimeout(packet_length)
        self.packet_timeout += self.timeout_ms
        self._looked, self._beyond = False, 0

    def isPacketTimeout(self) -> bool:
        """Returns True once the time is over and the port was read once more after that.

        A busy machine may stop this program between a read and this call until the time is over. The answer has often
        come meanwhile.
        """
        if self._looked:
            return True
        self._looked = self.getTimeSinceStart() > self.packet_timeout
        return False


def _reason(why: Exception) -> str:
    """The system's reason for an error of a port."""
    for error in (why, why.__context__):  # `pyserial` often raises its own error in place of the system's
        number = getattr(error, "errno", None)
        if number in (errno.EAGAIN, errno.EBUSY):
            return "another program, or this one, has it open already"
        if number:
            return os.strerror(number)
    if isinstance(why, serial.SerialException):
        return "the other side is gone"
    return str(why.args[-1] if why.args else why)
