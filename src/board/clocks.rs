//! The clock tree: 168 MHz from the ST-LINK's 8 MHz, or from the internal oscillator where that is not there.
//!
//! A clock that fails later resets the board: the clock security system raises the exception that nothing masks, and
//! breaks TIM1 without the processor.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllRDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

/// Number of checks for the external clock: for about 0.4 s, at 16 MHz and about 6 cycles a check.
const LOOKS: u32 = 1_000_000;

/// Starts the external clock and its guard; returns true if the clock runs. Must precede [`init`], which would wait
/// for ever for a missing clock.
pub fn start_external() -> bool {
    pac::RCC.cr().modify(|w| w.set_hsebyp(true));
    pac::RCC.cr().modify(|w| w.set_hseon(true));
    let ready = (0..LOOKS).any(|_| pac::RCC.cr().read().hserdy());
    if ready {
        pac::RCC.cr().modify(|w| w.set_csson(true));
    }
    ready
}

/// HSE 8 MHz / 4 x 168 / 2 = 168 MHz for the core, or HSI 16 MHz / 8 x 168 / 2; APB1 at 42 MHz, APB2 at 84 MHz.
///
/// Nothing uses the outputs Q (48 MHz) and R, but the dividers 0, as the driver leaves them, and 1 are wrong
/// configurations (RM0390, RCC_PLLCFGR).
fn config(external: bool) -> Config {
    let mut config = Config::default();
    config.rcc.hse = external.then_some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    let (source, prediv) = if external { (PllSource::HSE, PllPreDiv::DIV4) } else { (PllSource::HSI, PllPreDiv::DIV8) };
    config.rcc.pll_src = source;
    let (divp, divq, divr) = (Some(PllPDiv::DIV2), Some(PllQDiv::DIV7), Some(PllRDiv::DIV2));
    config.rcc.pll = Some(Pll { prediv, mul: PllMul::MUL168, divp, divq, divr });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.dma_interrupt_priority = Priority::P6;
    config
}

/// Sets the clocks and takes the peripherals.
///
/// The time driver zeroes its counter by an update, which may leave the flags of compares at 0: that of the half turn
/// would be counted as one. The clock would be 65.5 ms ahead and, from each half turn until its interrupt has run, fall
/// back by as much: an alarm set in there comes 65.5 ms late.
pub fn init(external: bool) -> Peripherals {
    cortex_m::interrupt::free(|_| {
        let peripherals = embassy_stm32::init(config(external));
        pac::TIM2.sr().write(|_| ());
        NVIC::unpend(pac::Interrupt::TIM2);
        peripherals
    })
}

/// Stops the watchdogs and the bridge's timer while a debugger halts the core. The stopped timer releases the
/// outputs.
pub fn freeze_when_halted() {
    pac::DBGMCU.apb1fzr().modify(|w| {
        w.set_iwdg(true);
        w.set_wwdg(true);
    });
    pac::DBGMCU.apb2fzr().modify(|w| w.set_tim1(true));
}

/// Takes PB3, a row, back from the trace, which a debugger may have turned on: only power-off does that otherwise.
pub fn free_trace_pin() {
    pac::DBGMCU.cr().modify(|w| w.set_trace_ioen(false));
}

/// Turns on the flash accelerator: instruction cache, data cache and prefetch, which the reset and embassy leave off.
/// Without it every fetch would wait for the flash, five cycles a line.
pub fn accelerate_flash() {
    pac::FLASH.acr().modify(|w| {
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(true);
    });
}
