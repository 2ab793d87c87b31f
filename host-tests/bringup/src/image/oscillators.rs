//! The clocks against each other, by captures of timers that hear the oscillators inside the part (RM0390: TIM11's and
//! TIM5's option registers).

use cortex_m::peripheral::DWT;
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;

use crate::board::guard;
use crate::passed;

/// The core's clock before the PLL.
const INTERNAL_HZ: f32 = 16e6;
/// TIM11's option register, and its input from the external oscillator.
const TIM11_OPTIONS: usize = 0x50;
const EXTERNAL: u32 = 0b10;
/// TIM5's option register, and its fourth input from the low-speed oscillator.
const TIM5_OPTIONS: usize = 0x50;
const LOW_SPEED: u32 = 0b01 << 6;
/// Periods between two captures.
const EACH: f32 = 8.0;
const BY_EIGHT: u8 = 0b11;
/// Captures between the first and the last.
const CAPTURES: u32 = 400;
const SLOW_CAPTURES: u32 = 64;
/// Looks for a capture: some ms each.
const LOOKS: u32 = 50_000;

/// The external clock by the internal one, which runs the core just now; `None` without a capture.
pub fn external_by_internal() -> Option<f32> {
    pac::RCC.apb2enr().modify(|w| w.set_tim11en(true));
    // 1 MHz, as the manual requires.
    pac::RCC.cfgr().modify(|w| w.set_rtcpre(8));
    let timer = pac::TIM11;
    // SAFETY: the option register of TIM11, which nothing else uses.
    unsafe { timer.as_ptr().byte_add(TIM11_OPTIONS).cast::<u32>().write_volatile(EXTERNAL) };
    timer.arr().write(|w| w.set_arr(u16::MAX));
    timer.ccmr_input(0).modify(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_icpsc(0, BY_EIGHT);
    });
    timer.ccer().modify(|w| w.set_cce(0, true));
    timer.cr1().modify(|w| w.set_cen(true));
    let capture = || (0..LOOKS).any(|_| timer.sr().read().ccif(0)).then(|| timer.ccr(0).read().ccr());
    let first = capture()?;
    let mut last = first;
    for _ in 0..CAPTURES {
        last = capture()?;
    }
    pac::RCC.apb2enr().modify(|w| w.set_tim11en(false));
    let ticks = f32::from(last.wrapping_sub(first));
    // 400 x 8 us are 51,200 ticks: less than the timer's wrap.
    Some(8.0 * INTERNAL_HZ * EACH * CAPTURES as f32 / ticks)
}

/// The watchdog's oscillator by the stopwatch.
pub fn low_speed() -> Option<f32> {
    pac::RCC.csr().modify(|w| w.set_lsion(true));
    if !(0..LOOKS).any(|_| pac::RCC.csr().read().lsirdy()) {
        return None;
    }
    let timer = pac::TIM5;
    // SAFETY: the option register of TIM5, of which nothing else uses the fourth channel.
    unsafe { timer.as_ptr().byte_add(TIM5_OPTIONS).cast::<u32>().write_volatile(LOW_SPEED) };
    timer.ccmr_input(1).modify(|w| {
        w.set_ccs(1, CcmrInputCcs::TI4);
        w.set_icpsc(1, BY_EIGHT);
    });
    timer.ccer().modify(|w| w.set_cce(3, true));
    let capture = || (0..LOOKS).any(|_| timer.sr().read().ccif(3)).then(|| timer.ccr(3).read());
    let mut ends = [capture(), None];
    for _ in 0..SLOW_CAPTURES {
        ends[1] = capture();
    }
    timer.ccer().modify(|w| w.set_cce(3, false));
    let [first, last] = [ends[0]?, ends[1]?];
    Some(guard::HZ as f32 * EACH * SLOW_CAPTURES as f32 / last.wrapping_sub(first) as f32)
}

/// Cycles of the core in a tick of the stopwatch, over a millisecond.
pub fn core_per_stopwatch() -> f32 {
    cortex_m::interrupt::free(|_| {
        let (cycles, ticks) = (DWT::cycle_count(), guard::now());
        while !passed(cycles, 168_000) {}
        let (cycles, ticks) = (DWT::cycle_count().wrapping_sub(cycles), guard::now().wrapping_sub(ticks));
        cycles as f32 / ticks as f32
    })
}
