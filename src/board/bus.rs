//! The bus on USART2: receives into a ring by DMA, sends by DMA, and holds the transceiver's direction.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::mode::Async;
use embassy_stm32::pac::usart::regs::Sr;
use embassy_stm32::peripherals::{DMA1_CH5, DMA1_CH6, PA2, PA3, PC8, USART2};
use embassy_stm32::usart::{self, ConfigError, UartTx};
use embassy_stm32::{Peri, bind_interrupts, dma, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use super::pins;

bind_interrupts!(struct Irqs {
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
});

/// Takes the end of what comes in, and of what goes out.
///
/// A read of the data register takes a byte that the DMA has not yet fetched, and no flag reports it. But nothing else
/// clears the flags of the receiver. So the register is read here only: where the line has just fallen idle, and
/// the next byte takes longer to arrive than this takes to run, or with a byte in error.
///
/// The line is given back here, at the end of the last stop bit. The task would come after control, up to a frame
/// later, when another device may send already.
#[embassy_stm32::interrupt]
fn USART2() {
    let status = pac::USART2.sr().read();
    let error = status.fe() || status.ne() || status.ore();
    if error || status.idle() {
        pac::USART2.dr().read();
        // A signaled error must reach the task: an idle line must not overwrite it.
        if error || !RECEIVED.signaled() {
            RECEIVED.signal(status);
        }
    }
    if status.tc() && pac::USART2.cr1().read().tcie() {
        if pac::DMA1.st(TX_STREAM).ndtr().read().ndt() == 0 {
            pac::GPIOC.bsrr().write(|w| w.set_br(TRANSMIT_ENABLE, true));
            pac::USART2.cr1().modify(|w| w.set_tcie(false));
            SENT.signal(());
        } else {
            // The DMA came late between two bytes.
            forget_completion();
        }
    }
}

/// Half of the ring is full, or all of it. A stream that lost its memory receives nothing until a reset.
#[embassy_stm32::interrupt]
fn DMA1_STREAM5() {
    assert!(!pac::DMA1.isr(1).read().teif(RX_STREAM - 4));
    pac::DMA1.ifcr(1).write(|w| {
        w.set_htif(RX_STREAM - 4, true);
        w.set_tcif(RX_STREAM - 4, true);
    });
    if !RECEIVED.signaled() {
        RECEIVED.signal(Sr(0));
    }
}

/// The port's status when the line fell idle, or when a byte was in error.
static RECEIVED: Signal<CriticalSectionRawMutex, Sr> = Signal::new();
static SENT: Signal<CriticalSectionRawMutex, ()> = Signal::new();

const TRANSMIT_ENABLE: usize = 8;
const RX_STREAM: usize = 5;
const TX_STREAM: usize = 6;
/// USART2 in the list of both streams.
const CHANNEL: u8 = 4;
const USART2_FUNCTION: u8 = 7;

/// 1.7 ms of bytes at 3 Mbaud.
static RING: [AtomicU8; 512] = [const { AtomicU8::new(0) }; 512];

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
    /// Stream of the sent bytes.
    pub tx_dma: Peri<'static, DMA1_CH6>,
    /// Stream of the received bytes.
    pub rx_dma: Peri<'static, DMA1_CH5>,
}

/// Eight bits, no parity, one stop bit.
pub struct Bus {
    /// The place in the ring of the next byte to take.
    next: usize,
    tx: UartTx<'static, Async>,
    transmit_enable: Output<'static>,
}

impl Bus {
    /// Listens at `baud`.
    ///
    /// # Errors
    /// The clocks cannot make that speed.
    pub fn new(parts: Parts, baud: u32) -> Result<Self, ConfigError> {
        let Parts { usart, tx, rx, transmit_enable, tx_dma, rx_dma: _rx_dma } = parts;
        let mut config = usart::Config::default();
        config.baudrate = baud;
        let tx = UartTx::new(usart, tx, tx_dma, Irqs, config)?;
        pins::input(rx, USART2_FUNCTION, Pull::Up);
        let stream = pac::DMA1.st(RX_STREAM);
        stream.par().write_value(pac::USART2.dr().as_ptr() as u32);
        stream.m0ar().write_value(&raw const RING as u32);
        stream.ndtr().write(|w| w.set_ndt(RING.len() as u16));
        stream.cr().write(|w| {
            w.set_chsel(CHANNEL);
            w.set_circ(true);
            w.set_minc(true);
            w.set_htie(true);
            w.set_tcie(true);
            w.set_teie(true);
            w.set_en(true);
        });
        pac::USART2.cr3().modify(|w| {
            w.set_eie(true);
            w.set_dmar(true);
        });
        pac::USART2.cr1().modify(|w| {
            w.set_re(true);
            w.set_idleie(true);
        });
        // SAFETY: the handlers above touch only atomics and flags of their own, and their priority is set.
        unsafe {
            interrupt::USART2.enable();
            interrupt::DMA1_STREAM5.enable();
        }
        Ok(Self { next: 0, tx, transmit_enable: Output::new(transmit_enable, Level::Low, Speed::Medium) })
    }

    /// Waits for bytes: until the line falls idle, or half of the ring is full.
    ///
    /// # Errors
    /// Framing, noise or overrun; the next call continues.
    pub async fn receive(&mut self, bytes: &mut [u8]) -> Result<usize, usart::Error> {
        loop {
            let stored = RING.len() - usize::from(pac::DMA1.st(RX_STREAM).ndtr().read().ndt());
            let end = if stored < self.next { RING.len() } else { stored };
            let fresh = RING.get(self.next..end).unwrap_or_default();
            let count = fresh.len().min(bytes.len());
            if count > 0 {
                for (byte, stored) in bytes.iter_mut().zip(fresh) {
                    *byte = stored.load(Ordering::Relaxed);
                }
                self.next = (self.next + count) % RING.len();
                return Ok(count);
            }
            let status = RECEIVED.wait().await;
            if status.fe() {
                return Err(usart::Error::Framing);
            } else if status.ne() {
                return Err(usart::Error::Noise);
            } else if status.ore() {
                return Err(usart::Error::Overrun);
            }
        }
    }

    /// Sends, and gives the line back after the last stop bit.
    ///
    /// # Errors
    /// The port's own.
    pub async fn send(&mut self, bytes: &[u8]) -> Result<(), usart::Error> {
        self.transmit_enable.set_high();
        // The DMA does not clear the flag of the last transmission: with the flag still set, the line would be released
        // early.
        forget_completion();
        SENT.reset();
        cortex_m::interrupt::free(|_| pac::USART2.cr1().modify(|w| w.set_tcie(true)));
        let result = self.tx.write(bytes).await;
        if result.is_ok() {
            SENT.wait().await;
        }
        self.transmit_enable.set_low();
        result
    }

    /// Changes the speed of both directions.
    ///
    /// # Errors
    /// The clocks cannot make that speed.
    pub fn set_baud(&mut self, baud: u32) -> Result<(), ConfigError> {
        self.tx.set_baudrate(baud)
    }
}

/// Flags of the status register are cleared by writing 0 and left alone by writing 1.
fn forget_completion() {
    let mut cleared = Sr(u32::MAX);
    cleared.set_tc(false);
    pac::USART2.sr().write_value(cleared);
}
