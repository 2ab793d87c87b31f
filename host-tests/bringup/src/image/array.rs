//! The scan's rows, read back at their pins while the scan runs by itself. And the converters: their noise beside the
//! running step, the supply and temperature that the first one measures, and the end of a sample, found by a step of the
//! DAC on the pin of column 5.

use crate::board::analogue::Analogue;
use crate::board::{health, scan};
use crate::{CYCLES_PER_US, passed, report, wait_for};
use bringup::script::Bench;
use cortex_m::peripheral::DWT;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use fingertip::chip::FRAMES;
use fingertip::scan::ScanTiming;
use fingertip::shipped::{Frame, Pipeline, ROWS};

const ALL: u32 = (1 << ROWS) - 1;
/// Time after which a slow edge has ended: 200 ns.
const EDGE_CYCLES: u32 = 34;
const LINES: u32 = 10;

/// Watches the given number of frames.
pub fn rows(frames: u32) {
    report::say(format_args!("rows: {frames} frames of 100 us"));
    report::flush();
    // The scan needs no processor; its interrupts would only be late here.
    interrupt::DMA2_STREAM1.disable();
    interrupt::DMA2_STREAM2.disable();
    let mut seen = Seen { frames: 0, wrong: 0, least: u32::MAX, most: 0, frame_cycles: 0, stopped: false };
    // A line takes many slots: the watch restarts behind it.
    while seen.frames < frames && !seen.stopped {
        seen.watch(frames.min(seen.frames + frames / LINES + 1));
        report::say(format_args!("rows: {} frames", seen.frames));
        report::flush();
    }
    interrupt::DMA2_STREAM1.unpend();
    interrupt::DMA2_STREAM2.unpend();
    // SAFETY: as the scan's start enabled them.
    unsafe {
        interrupt::DMA2_STREAM1.enable();
        interrupt::DMA2_STREAM2.enable();
    }
    let ns = |cycles: f32| cycles * 1e3 / CYCLES_PER_US as f32;
    report::figure("rows_frames", seen.frames as f32);
    report::figure("rows_wrong", seen.wrong as f32);
    report::figure("slot_least_ns", ns(seen.least as f32));
    report::figure("slot_most_ns", ns(seen.most as f32));
    report::figure("frame_ns", ns(seen.frame_cycles as f32 / seen.frames.max(1) as f32));
}

struct Seen {
    frames: u32,
    wrong: u32,
    least: u32,
    most: u32,
    frame_cycles: u64,
    /// True if the rows do not move.
    stopped: bool,
}

fn driven() -> u32 {
    pac::GPIOB.idr().read().0 & ALL
}

/// The row after this one, one bit each; none after the last.
const fn next(rows: u32) -> u32 {
    if rows == 0 { 1 } else { rows << 1 & ALL }
}

impl Seen {
    /// Watches until the given number of frames was seen.
    fn watch(&mut self, frames: u32) {
        let (mut rows, mut edge, mut first) = (driven(), None::<u32>, None::<u32>);
        let mut looked = DWT::cycle_count();
        while self.frames < frames {
            if driven() == rows {
                if passed(looked, 1_000 * CYCLES_PER_US) {
                    (self.stopped, self.wrong) = (true, self.wrong + 1);
                    return;
                }
                continue;
            }
            looked = DWT::cycle_count();
            cortex_m::asm::delay(EDGE_CYCLES);
            let now = driven();
            self.wrong += u32::from(first.is_some() && now != next(rows));
            if let Some(edge) = edge.replace(looked) {
                let slot = looked.wrapping_sub(edge);
                self.least = self.least.min(slot);
                self.most = self.most.max(slot);
            }
            rows = now;
            if rows == 1
                && let Some(first) = first.replace(looked)
            {
                self.frames += 1;
                self.frame_cycles += u64::from(looked.wrapping_sub(first));
            }
        }
    }
}

const SAMPLES: u32 = 2_048;
/// The DAC's code while the noise is measured.
const MIDDLE: u16 = 2_048;
/// The column on the DAC's pin, PA4: the first that its converter takes.
const COLUMN: usize = 5;
/// The slot in which it steps.
const SLOT: usize = 2;
/// Code of the step, and threshold above which a sample includes the step.
const STEP: u16 = 3_000;
const SEEN: u16 = 1_500;
/// Ticks of the scan's timer between two places of the step.
const STRIDE: usize = 4;

/// The noise of the DAC's column in the slot that drives no row, with the flash's prefetch on and off, while the step
/// runs without a pause. The other columns' pins are open on a bare board.
pub fn noise(scan: &mut scan::Scan, bench: &mut Bench, pipeline: &mut Pipeline) {
    start_dac();
    pac::DAC1.dhr12r(0).write(|w| w.set_dhr(MIDDLE));
    cortex_m::asm::delay(1_000 * CYCLES_PER_US);
    let [with, without] = [true, false].map(|prefetch| {
        pac::FLASH.acr().modify(|w| w.set_prften(prefetch));
        deviation(scan, bench, pipeline)
    });
    pac::FLASH.acr().modify(|w| w.set_prften(true));
    pac::DAC1.cr().modify(|w| w.set_en(0, false));
    if let (Some(with), Some(without)) = (with, without) {
        report::figure("noise_prefetch_codes", with);
        report::figure("noise_by_prefetch_codes", with - without);
    }
}

/// The analogue supply and the microcontroller's temperature, as in as many frames as a mean takes.
pub fn means(mut analogue: Analogue) {
    for _ in 0..=FRAMES {
        cortex_m::asm::delay(100 * CYCLES_PER_US);
        analogue.take();
    }
    report::figure("analogue_mv", f32::from(health::health().analogue_mv));
    if let Some(chip) = analogue.chip() {
        report::figure("chip_c", chip.0.to_num());
    }
}

/// Standard deviation of the codes; `None` if the scan stopped.
fn deviation(scan: &mut scan::Scan, bench: &mut Bench, pipeline: &mut Pipeline) -> Option<f32> {
    let (mut count, mut sum, mut squares) = (0u64, 0u64, 0u64);
    let mut frame = Frame::EMPTY;
    for _ in 0..SAMPLES {
        let before = scan::newest();
        let newest = wait_for(1, || {
            bench.record(pipeline);
            Some(scan::newest()).filter(|newest| *newest != before)
        })?;
        if scan.copy(newest, &mut frame) {
            let code = u64::from(frame.code(ROWS, COLUMN));
            (count, sum, squares) = (count + 1, sum + code, squares + code * code);
        }
    }
    (count > 0).then(|| libm::sqrtf((squares * count - sum * sum) as f32) / count as f32)
}

fn start_dac() {
    pac::RCC.apb1enr().modify(|w| w.set_dacen(true));
    pac::DAC1.cr().modify(|w| {
        w.set_en(0, true);
        w.set_boff(0, true);
    });
}

/// Measures the time from the trigger to the end of the column's sample: the latest step of the DAC that it includes.
pub fn sample_instant(scan: &mut scan::Scan, timing: ScanTiming) {
    start_dac();
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

/// Steps the DAC up at a tick of the slot; returns the actual tick, and the column's code.
fn step_at(scan: &mut scan::Scan, at: u16) -> Option<(u16, u16)> {
    let set = |code: u16| pac::DAC1.dhr12r(0).write(|w| w.set_dhr(code));
    let stepped = cortex_m::interrupt::free(|_| {
        let in_slot = |is: bool| ((pac::GPIOB.odr().read().0 & ALL == 1 << SLOT) == is).then_some(());
        set(0);
        wait_for(1, || in_slot(true))?;
        let now = wait_for(1, || Some(pac::TIM8.cnt().read().cnt()).filter(|now| *now >= at))?;
        set(STEP);
        wait_for(1, || in_slot(false))?;
        set(0);
        Some(now)
    })?;
    // What waited for the interrupts is counted by now: the frame with the step is the next to be complete.
    let before = scan::newest();
    let mut frame = Frame::EMPTY;
    let newest = wait_for(1, || Some(scan::newest()).filter(|newest| *newest != before))?;
    scan.copy(newest, &mut frame).then(|| (stepped, frame.code(SLOT, COLUMN)))
}
