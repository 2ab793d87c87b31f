//! The far end of the bus: what the host sends at its time, what the image sent and when.

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::generated::usart6::{Register, cr3, sr};
use rigless::soc::stm32f427::peripherals::usart::{Kind, Usart};
use rigless::time::{EventId, VirtualNanos};
use std::collections::VecDeque;

/// A byte and the instant at which its stop bit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedByte {
    /// Virtual time of the end of its stop bit, ns.
    pub at_ns: u64,
    pub byte: u8,
}

/// The host's end of USART2. The port times each byte by its baud rate, both ways.
#[derive(Debug, Default)]
pub struct Wire {
    outgoing: VecDeque<(u64, u8)>,
    /// Bytes that the image has sent and nobody has taken.
    pub incoming: Vec<TimedByte>,
    /// Single-wire mode: the receiver is on the transmit pin and receives what the port sends.
    pub single: bool,
}

// A run has no snapshot.
impl Store for Wire {}

impl Wire {
    /// Queues bytes that start no earlier than an instant; each follows the one before it.
    pub fn send(&mut self, from_ns: u64, bytes: &[u8]) {
        self.outgoing.extend(bytes.iter().map(|byte| (from_ns, *byte)));
    }

    /// Earliest time at which the next byte may be sent, ns.
    pub fn sends_ns(&self) -> Option<u64> {
        self.outgoing.front().map(|(from_ns, _)| *from_ns)
    }

    /// Bytes that have not started yet.
    pub fn pending(&self) -> usize {
        self.outgoing.len()
    }
}

impl Peer for Wire {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let byte = TimedByte { at_ns: context.now().0, byte: (word & 0xff) as u8 };
        self.incoming.push(byte);
        if self.single {
            self.outgoing.push_back((byte.at_ns, byte.byte));
        }
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let (_, byte) = self.outgoing.pop_front_if(|(from_ns, _)| *from_ns <= now.0)?;
        Some(u16::from(byte))
    }
}

// The bus's port, whose received bytes the DMA fetches a moment after they have arrived.
//
// The crate's DMA fetches a byte at the instant of its stop bit, so no read of the core could come before it. Here the
// port asks for the DMA [`FETCH_NS`] later. A read of the data register in between consumes the byte, as on the part:
// the DMA never sees it, and no flag reports the loss.

/// Time from a stop bit's end to the DMA's read: ten cycles of the core, for arbitration and bridge; an estimate.
const FETCH_NS: u64 = 60;

/// USART2 of the microcontroller, at which the bus is.
#[derive(Debug)]
pub struct BusPort {
    port: Usart,
    fetch: Option<EventId>,
}

impl BusPort {
    /// Out of reset, with the host on its far end.
    pub fn new(clock_hz: u64) -> Self {
        let mut port = Usart::with_clock(Kind::Usart, clock_hz);
        port.attach(Wire::default());
        Self { port, fetch: None }
    }

    pub fn wire(&mut self) -> &mut Wire {
        self.port.chip_mut().expect("the wire was attached when the port was made")
    }
}

impl Device for BusPort {
    type Register = Register;

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_clock(&mut self.port, hz, registers, context);
    }

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        Device::read(&mut self.port, register, file, context)
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        Device::peek(&self.port, register, registers, now)
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.port, register, value, registers, context);
    }

    /// Enables the DMA request at its time: the port itself holds it back from the arrival of a byte on.
    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let control = registers.get(Register::Cr3);
        let empty = !sr::RXNE.is_set(registers.get(Register::Sr));
        if empty {
            registers.set(Register::Cr3, cr3::DMAR.set(control, 0));
        }
        Device::on_event(&mut self.port, event, registers, context);
        registers.set(Register::Cr3, control);
        if empty && sr::RXNE.is_set(registers.get(Register::Sr)) {
            self.fetch = Some(context.schedule(VirtualNanos(context.now().0 + FETCH_NS)));
        } else if self.fetch.take_if(|fetch| *fetch == event).is_some() {
            Device::write(&mut self.port, Register::Cr3, control, registers, context);
        }
    }

    fn poll(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::poll(&mut self.port, registers, context);
    }

    fn reset(&mut self) {
        Device::reset(&mut self.port);
        self.fetch = None;
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.port, registers, context);
        self.fetch = None;
    }
}
