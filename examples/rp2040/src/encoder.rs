//! The encoder: an interrupt counts both channels' edges. Above 50,000 counts a second use a program of the PIO.

use crate::pins;
use core::cell::Cell;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use rp_pac::{IO_BANK0, Interrupt, interrupt};

/// The count, and both channels when it was taken.
static COUNT: Mutex<Cell<(i32, usize)>> = Mutex::new(Cell::new((0, 0)));

/// Change of the count for a change of the two channels; a change of both at once is a lost edge.
const STEPS: [[i32; 4]; 4] = [[0, 1, -1, 0], [-1, 0, 0, 1], [1, 0, 0, -1], [0, -1, 1, 0]];

/// Counts from now on.
pub fn start() {
    free(|section| COUNT.borrow(section).set((0, channels())));
    for pin in pins::ENCODER {
        IO_BANK0.int_proc(0).inte(pin / 8).modify(|edges| {
            edges.set_edge_low(pin % 8, true);
            edges.set_edge_high(pin % 8, true);
        });
    }
    // SAFETY: the handler below shares the count through a critical section only.
    unsafe { NVIC::unmask(Interrupt::IO_IRQ_BANK0) };
}

/// The count; it grows as the tip presses in, else the motor's leads are swapped.
pub fn count() -> i32 {
    free(|section| COUNT.borrow(section).get().0)
}

fn channels() -> usize {
    let [a, b] = pins::ENCODER.map(|pin| usize::from(pins::is_high(pin)));
    a | b << 1
}

#[interrupt]
fn IO_IRQ_BANK0() {
    for pin in pins::ENCODER {
        IO_BANK0.intr(pin / 8).write(|edges| {
            edges.set_edge_low(pin % 8, true);
            edges.set_edge_high(pin % 8, true);
        });
    }
    let now = channels();
    free(|section| {
        let count = COUNT.borrow(section);
        let (sum, before) = count.get();
        count.set((sum.wrapping_add(STEPS[before][now]), now));
    });
}
