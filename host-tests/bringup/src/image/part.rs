//! The part itself: its clocks against each other, by captures of timers that hear the oscillators inside the part (RM0390:
//! TIM11's and TIM5's option registers); times of the flash, in a blank parameter sector that is erased again afterwards, so
//! that stored parameters are kept; and the bus's port, which hears itself at each speed of the bus: in single-wire mode its
//! receiver is on the transmit pin.

use crate::board::flash::Chip;
use crate::board::guard;
use crate::{CYCLES_PER_US, passed, report, wait_for};
use bringup::BAUD;
use cortex_m::peripheral::DWT;
use embassy_stm32::pac::gpio::vals::Pupdr;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use embassy_stm32::peripherals::FLASH;
use embassy_stm32::{Peri, pac};
use fingertip::store::{Flash as _, Sector};

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
    let last = (0..CAPTURES).try_fold(first, |_, _| capture())?;
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
    let first = capture();
    let last = first.and_then(|first| (0..SLOW_CAPTURES).try_fold(first, |_, _| capture()));
    timer.ccer().modify(|w| w.set_cce(3, false));
    Some(guard::HZ as f32 * EACH * SLOW_CAPTURES as f32 / last?.wrapping_sub(first?) as f32)
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

const FLASH_WORDS: usize = 64;
const ERASED: u8 = 0xff;

pub fn flash_times(flash: Peri<'static, FLASH>) {
    let mut chip = Chip::new(flash);
    let blank = |chip: &Chip, sector| chip.bytes(sector).iter().all(|byte| *byte == ERASED);
    let Some(sector) = [Sector::A, Sector::B].into_iter().find(|sector| blank(&chip, *sector)) else {
        return report::say(format_args!("no parameter sector is blank: the flash's times are left out"));
    };
    report::say(format_args!("flash: some words and an erase, 1 to 2 s"));
    let (mut most, mut sound) = (0, true);
    for place in 0..FLASH_WORDS {
        let word = (place as u32).wrapping_mul(0x9E37_79B9);
        let taken = cycles(|| sound &= chip.program(sector, 4 * place, word).is_ok());
        most = most.max(taken);
        sound &= chip.bytes(sector).get(4 * place..4 * place + 4) == Some(&word.to_le_bytes()[..]);
    }
    let erase = cycles(|| sound &= chip.erase(sector).is_ok());
    sound &= blank(&chip, sector);
    report::figure("flash_word_us", most as f32 / CYCLES_PER_US as f32);
    report::figure("flash_erase_ms", erase as f32 / CYCLES_PER_US as f32 * 1e-3);
    report::figure("flash_reads_back", f32::from(u8::from(sound)));
}

fn cycles(work: impl FnOnce()) -> u32 {
    let since = DWT::cycle_count();
    work();
    DWT::cycle_count().wrapping_sub(since)
}

const BYTES: u32 = 256;
const TX_PIN: usize = 2;
/// The bus's speeds, but that of 9600 baud.
const SPEEDS: [u32; 5] = [57_600, 115_200, 1_000_000, 2_000_000, 3_000_000];

/// Reports for each speed the number of bytes that came back wrong.
pub fn loopback() {
    report::flush();
    pac::GPIOA.pupdr().modify(|w| w.set_pupdr(TX_PIN, Pupdr::PULL_UP));
    let wrong = SPEEDS.map(|baud| (baud, at(baud)));
    pac::GPIOA.pupdr().modify(|w| w.set_pupdr(TX_PIN, Pupdr::FLOATING));
    single_wire(false);
    report::set_baud(BAUD);
    // What the host made of the bytes above ends here.
    report::say(format_args!(""));
    for (baud, wrong) in wrong {
        report::figure(format_args!("loopback_{baud}"), wrong as f32);
    }
}

fn single_wire(on: bool) {
    pac::USART2.cr1().modify(|w| w.set_ue(false));
    pac::USART2.cr3().modify(|w| w.set_hdsel(on));
    pac::USART2.cr1().modify(|w| w.set_ue(true));
}

/// Returns the number of wrong bytes.
fn at(baud: u32) -> u32 {
    report::set_baud(baud);
    single_wire(true);
    while report::received().is_some() {}
    let mut wrong = 0;
    for byte in 0..BYTES {
        // All of them, in an order in which neighbours differ in many bits.
        let byte = (byte * 151) as u8;
        report::send(byte);
        let Some(came) = wait_for(1, report::received) else { return BYTES };
        wrong += u32::from(came != byte);
    }
    wrong
}
