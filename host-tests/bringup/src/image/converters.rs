//! The converters: their noise by the internal reference, what the first one tells of the microcontroller, and when a
//! sample ends by a step of the DAC, which is on the pin of column 5.

use cortex_m::peripheral::DWT;
use embassy_stm32::pac;
use embassy_stm32::peripherals::ADC1;
use embassy_stm32::rcc;
use fingertip::chip::FRAMES;
use fingertip::scan::ScanTiming;
use fingertip::shipped::{Frame, ROWS};

use crate::board::analogue::{Analogue, REFERENCE};
use crate::board::{converter, health, scan};
use crate::{CYCLES_PER_US, passed, report};

const SAMPLES: u32 = 4_096;
/// The column on the DAC's pin, PA4: the first that its converter takes.
const COLUMN: usize = 5;
/// The slot in which it steps.
const SLOT: usize = 2;
/// The step, and what a sample that saw it is above.
const STEP: u16 = 3_000;
const SEEN: u16 = 1_500;
/// Ticks of the scan's timer between two places of the step.
const STRIDE: usize = 4;

/// The noise of the reference, with the flash's prefetch on and off. The first converter is free.
pub fn noise() {
    rcc::enable_and_reset::<ADC1>();
    converter::set_clock();
    pac::ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(true));
    converter::set_sequence(pac::ADC1, [REFERENCE], converter::sample_time(480));
    pac::ADC1.cr2().write(|w| w.set_adon(true));
    cortex_m::asm::delay(10 * CYCLES_PER_US);
    for (name, prefetch) in [("noise_prefetch_codes", true), ("noise_codes", false)] {
        pac::FLASH.acr().modify(|w| w.set_prften(prefetch));
        if let Some(codes) = deviation() {
            report::figure(name, codes);
        }
    }
    pac::FLASH.acr().modify(|w| w.set_prften(true));
    pac::ADC1.cr2().write(|_| ());
    pac::ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(false));
}

/// The analogue supply and the microcontroller's temperature, as in as many frames as a mean takes.
pub fn means(mut analogue: Analogue) {
    for _ in 0..=FRAMES {
        cortex_m::asm::delay(100 * CYCLES_PER_US);
        analogue.read_mv();
    }
    report::figure("analogue_mv", f32::from(health::health().analogue_mv));
    if let Some(chip) = analogue.chip() {
        report::figure("chip_c", chip.0.to_num());
    }
}

/// The standard deviation of the codes; none where the converter does not answer.
fn deviation() -> Option<f32> {
    let (mut sum, mut squares) = (0u64, 0u64);
    for _ in 0..SAMPLES {
        pac::ADC1.cr2().modify(|w| w.set_swstart(true));
        let since = DWT::cycle_count();
        while !pac::ADC1.sr().read().eoc() {
            if passed(since, 1_000 * CYCLES_PER_US) {
                return None;
            }
        }
        let code = u64::from(pac::ADC1.dr().read().data());
        sum += code;
        squares += code * code;
    }
    let count = u64::from(SAMPLES);
    Some(libm::sqrtf((squares * count - sum * sum) as f32) / count as f32)
}

/// From the trigger to the end of the column's sample: the latest step that it still sees.
pub fn sample_instant(scan: &mut scan::Scan, timing: ScanTiming) {
    pac::RCC.apb1enr().modify(|w| w.set_dacen(true));
    pac::DAC1.cr().modify(|w| {
        w.set_en(0, true);
        w.set_boff(0, true);
    });
    let (from, to) = (timing.settle.0 as u16, timing.slot.0 as u16);
    let mut latest = None;
    for at in (from..to).step_by(STRIDE) {
        if let Some((stepped, code)) = step_at(scan, at)
            && code > SEEN
        {
            latest = latest.max(Some(stepped));
        }
    }
    pac::DAC1.cr().modify(|w| w.set_en(0, false));
    if let Some(latest) = latest {
        report::figure("sample_ends_ns", f32::from(latest.saturating_sub(from)) * 1e3 / CYCLES_PER_US as f32);
    }
}

/// Steps up at a tick of the slot; when that was, and what the column's code became of it.
fn step_at(scan: &mut scan::Scan, at: u16) -> Option<(u16, u16)> {
    let set = |code: u16| pac::DAC1.dhr12r(0).write(|w| w.set_dhr(code));
    let stepped = cortex_m::interrupt::free(|_| {
        set(0);
        wait_until(|| pac::GPIOB.odr().read().0 & ((1 << ROWS) - 1) == 1 << SLOT)?;
        let mut now = 0;
        wait_until(|| {
            now = pac::TIM8.cnt().read().cnt();
            now >= at
        })?;
        set(STEP);
        wait_until(|| pac::GPIOB.odr().read().0 & ((1 << ROWS) - 1) != 1 << SLOT)?;
        set(0);
        Some(now)
    })?;
    // What waited for the interrupts is counted by now: the frame with the step is the next to be complete.
    let before = scan::newest();
    let mut frame = Frame::EMPTY;
    wait_until(|| scan::newest() != before)?;
    scan.copy(scan::newest(), &mut frame).then(|| (stepped, frame.code(SLOT, COLUMN)))
}

/// Waits for a millisecond at most.
fn wait_until(mut holds: impl FnMut() -> bool) -> Option<()> {
    let since = DWT::cycle_count();
    while !holds() {
        if passed(since, 1_000 * CYCLES_PER_US) {
            return None;
        }
    }
    Some(())
}
