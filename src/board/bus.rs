//! The bus on USART2: receives into a ring by DMA, sends by DMA, and holds the transceiver's direction.

use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::mode::Async;
use embassy_stm32::pac::usart::regs::Sr;
use embassy_stm32::peripherals::{DMA1_CH5, DMA1_CH6, PA2, PA3, PC8, USART2};
use embassy_stm32::usart::{self, ConfigError, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{Peri, bind_interrupts, dma, pac};
use static_cell::ConstStaticCell;

bind_interrupts!(struct Irqs {
    USART2 => GiveBack, usart::InterruptHandler<USART2>;
    DMA1_STREAM5 => dma::InterruptHandler<DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
});

/// Gives the line back at the end of the last stop bit. The task would come after control, up to a frame later, when
/// another device may send already.
struct GiveBack;

impl Handler<typelevel::USART2> for GiveBack {
    unsafe fn on_interrupt() {
        if !pac::USART2.sr().read().tc() || !pac::USART2.cr1().read().tcie() {
            return;
        }
        if pac::DMA1.st(TX_STREAM).ndtr().read().ndt() == 0 {
            pac::GPIOC.bsrr().write(|w| w.set_br(TRANSMIT_ENABLE, true));
        } else {
            // The DMA came late between two bytes.
            forget_completion();
        }
    }
}

const TRANSMIT_ENABLE: usize = 8;
const TX_STREAM: usize = 6;

/// 1.7 ms of bytes at 3 Mbaud.
static RING: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);

/// The hardware that the bus takes.
pub struct Parts {
    /// The port.
    pub usart: Peri<'static, USART2>,
    /// Transmits.
    pub tx: Peri<'static, PA2>,
    /// Receives.
    pub rx: Peri<'static, PA3>,
    /// High while sending.
    pub transmit_enable: Peri<'static, PC8>,
    /// Carries what is sent.
    pub tx_dma: Peri<'static, DMA1_CH6>,
    /// Carries what is received.
    pub rx_dma: Peri<'static, DMA1_CH5>,
}

/// Eight bits, no parity, one stop bit.
pub struct Bus {
    rx: RingBufferedUartRx<'static>,
    tx: UartTx<'static, Async>,
    transmit_enable: Output<'static>,
}

impl Bus {
    /// Listens at `baud`.
    ///
    /// # Errors
    /// The clocks cannot make that speed.
    pub fn new(parts: Parts, baud: u32) -> Result<Self, ConfigError> {
        let mut config = usart::Config::default();
        config.baudrate = baud;
        config.rx_pull = Pull::Up;
        let uart = Uart::new(parts.usart, parts.rx, parts.tx, parts.tx_dma, parts.rx_dma, Irqs, config)?;
        let (tx, rx) = uart.split();
        let mut rx = rx.into_ring_buffered(RING.take());
        rx.start_uart();
        Ok(Self { rx, tx, transmit_enable: Output::new(parts.transmit_enable, Level::Low, Speed::Medium) })
    }

    /// Waits for bytes: until the line falls idle, or half of the ring is full.
    ///
    /// # Errors
    /// Framing, noise, parity or overrun; the next call listens again.
    pub async fn receive(&mut self, bytes: &mut [u8]) -> Result<usize, usart::Error> {
        self.rx.read(bytes).await
    }

    /// Sends, and gives the line back after the last stop bit.
    ///
    /// # Errors
    /// The port's own.
    pub async fn send(&mut self, bytes: &[u8]) -> Result<(), usart::Error> {
        self.transmit_enable.set_high();
        // The flag of the last transmission still stands, as the DMA alone does not clear it: the line would be given
        // back early.
        forget_completion();
        cortex_m::interrupt::free(|_| pac::USART2.cr1().modify(|w| w.set_tcie(true)));
        let mut result = self.tx.write(bytes).await;
        if result.is_ok() {
            result = self.tx.flush().await;
        }
        self.transmit_enable.set_low();
        result
    }

    /// Changes the speed of both directions.
    ///
    /// # Errors
    /// The clocks cannot make that speed.
    pub fn set_baud(&mut self, baud: u32) -> Result<(), ConfigError> {
        self.rx.set_baudrate(baud)
    }
}

/// Flags of the status register are cleared by writing 0 and left alone by writing 1.
fn forget_completion() {
    let mut cleared = Sr(u32::MAX);
    cleared.set_tc(false);
    pac::USART2.sr().write_value(cleared);
}
