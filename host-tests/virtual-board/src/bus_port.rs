//! The bus's port, whose received bytes the DMA fetches a moment after they have arrived.
//!
//! The crate's DMA fetches a byte at the instant of its stop bit, so no read of the core could come before it. Here the
//! port asks for the DMA [`FETCH_NS`] later. A read of the data register in between consumes the byte, as on the part:
//! the DMA never sees it, and no flag reports the loss.

use crate::wire::Wire;
use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32f427::generated::usart6::{Register, cr3, sr};
use rigless::soc::stm32f427::peripherals::usart::{Kind, Usart};
use rigless::time::{EventId, VirtualNanos};

/// Time from a stop bit's end to the DMA's read: ten cycles of the core, for arbitration, bus matrix and bridge. An
/// estimate.
const FETCH_NS: u64 = 60;

/// USART2 of the part.
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

    /// The host's end of the bus.
    pub fn wire(&mut self) -> &mut Wire {
        self.port.chip_mut().expect("the wire was attached when the port was made")
    }
}

impl Device for BusPort {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        Device::layout(&self.port)
    }

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
