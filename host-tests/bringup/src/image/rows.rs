//! The scan's rows, read back at their pins while the scan runs by itself.

use cortex_m::peripheral::DWT;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use fingertip::shipped::ROWS;

use crate::{CYCLES_PER_US, passed, report};

const ALL: u32 = (1 << ROWS) - 1;
/// Time after which a slow edge has ended: 200 ns.
const EDGE_CYCLES: u32 = 34;
/// Number of progress lines.
const LINES: u32 = 10;

/// Watches the given number of frames.
pub fn run(frames: u32) {
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

/// State of the pins.
struct Seen {
    frames: u32,
    wrong: u32,
    least: u32,
    most: u32,
    /// Cycles of all frames.
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
