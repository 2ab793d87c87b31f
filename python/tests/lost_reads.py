"""Counts the reads that get no answer in time on a busy machine, with the cause of each: not a test, it takes minutes.

    python lost_reads.py --serve target/debug/serve --tool target/debug/fingertip --reads 100000 package sdk tool

Serves a finger, keeps some processes busy beside it, and reads 54 bytes of the state again and again without a pause:
by this package, by `dynamixel-sdk` alone, by `fingertip latency`. Needs Linux: `/proc/PID/schedstat` has the time
for which client and server were ready to run and did not get a processor.
"""

import argparse
import os
import subprocess
import sys
import time
from collections import Counter
from typing import Any, Callable, List

from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler  # type: ignore[import-untyped]

from fingertip import Fingertip, NoAnswer

FIRST, LENGTH = 264, 54
PACKET = LENGTH + 11  # bytes of the answer


class Counting(PortHandler):  # type: ignore[misc]
    """The SDK's port; counts the bytes that an exchange read."""

    got = 0

    def readPort(self, length: int) -> Any:
        data = super().readPort(length)
        self.got += len(data)
        return data

    def writePort(self, packet: Any) -> Any:
        self.got = 0
        return super().writePort(packet)


def waited_s(process: int) -> float:
    """Time for which a process was ready to run without a processor; a present wait is not included."""
    with open(f"/proc/{process}/schedstat") as file:
        return int(file.read().split()[1]) * 1e-9


def measure(reads: int, server: int, read: Callable[[], bool], there: Callable[[], int]) -> None:
    """Reads; `there` counts the bytes of the answer that are in the port behind a read that failed."""
    took: List[float] = []
    lost: Counter[str] = Counter()
    for _ in range(reads):
        before = time.monotonic(), waited_s(os.getpid()), waited_s(server)
        if read():
            took.append(time.monotonic() - before[0])
            continue
        given_up = time.monotonic(), waited_s(os.getpid())
        late = there() < PACKET
        while there() < PACKET and time.monotonic() < given_up[0] + 5.0:
            time.sleep(0.001)
        came_s = time.monotonic() - before[0]
        time.sleep(0.05)
        why = "the answer came too late" if late else "the answer was in the port, the client had not looked"
        lost[why] += 1
        print(
            f"  lost after {1e3 * (given_up[0] - before[0]):.0f} ms, of which the client had no processor for "
            f"{1e3 * (given_up[1] - before[1]):.0f} ms: {why}; all of it was there after {1e3 * came_s:.0f} ms, "
            f"until then the server had no processor for {1e3 * (waited_s(server) - before[2]):.0f} ms"
        )
    took.sort()
    at = [took[int(len(took) * share)] * 1e3 for share in (0.5, 0.99, 0.999)]
    print(
        f"{reads} reads, {sum(lost.values())} lost; an answer takes {at[0]:.2f} ms in the middle, {at[1]:.1f} ms at 99 %, "
        f"{at[2]:.1f} ms at 99.9 %, {took[-1] * 1e3:.1f} ms at most; load {os.getloadavg()[0]:.1f}"
    )
    for why, count in lost.items():
        print(f"  {count}: {why}", flush=True)


def by_package(port: str, reads: int, server: int) -> None:
    with Fingertip(port) as finger:

        def read() -> bool:
            try:
                finger.read_bytes(FIRST, LENGTH)
            except NoAnswer:
                return False
            return True

        measure(reads, server, read, lambda: int(finger.line.ser.in_waiting))


def by_sdk(port_name: str, reads: int, server: int) -> None:
    port, packets = Counting(port_name), PacketHandler(2.0)
    if not (port.openPort() and port.setBaudRate(1_000_000)):
        sys.exit(f"cannot open {port_name}")

    def read() -> bool:
        return bool(packets.readTxRx(port, 1, FIRST, LENGTH)[1] == COMM_SUCCESS)

    measure(reads, server, read, lambda: int(port.got + port.ser.in_waiting))
    port.closePort()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("clients", nargs="*", default=["package"], choices=["package", "sdk", "tool"])
    parser.add_argument("--serve", required=True, help="the program `serve` that `cargo xtask serve` builds")
    parser.add_argument("--tool", default="fingertip", help="the program `fingertip`")
    parser.add_argument("--reads", type=int, default=100_000)
    parser.add_argument("--seconds", type=float, default=60.0, help="for `fingertip latency`")
    parser.add_argument("--busy", type=int, default=4, help="processes that keep the machine busy")
    options = parser.parse_args()

    pipe = subprocess.PIPE
    served = subprocess.Popen([options.serve], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(options.busy)]
    try:
        assert served.stdout
        port = served.stdout.readline().split()[1]
        served.stdout.readline()
        for client in options.clients:
            print(f"{client}, beside {options.busy} busy processes on {os.cpu_count()} processors:", flush=True)
            if client == "tool":
                subprocess.run([options.tool, "--port", port, "latency", "--seconds", str(options.seconds)], check=True)
            else:
                (by_sdk if client == "sdk" else by_package)(port, options.reads, served.pid)
    finally:
        processes: List["subprocess.Popen[Any]"] = [*busy, served]
        for process in processes:
            process.terminate()
            process.wait()


if __name__ == "__main__":
    main()
