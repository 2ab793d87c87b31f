//! The study's kernels by the core's cycle counter: the same code and inputs as `cargo xtask study`'s image has under
//! the timing model.

#[path = "call.rs"]
mod call;
#[path = "inputs.rs"]
mod inputs;
#[path = "../../../images/src/study/kernels.rs"]
mod study;

use bringup::script::Bench;
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use fingertip::shipped::{Config, Pipeline};
use inputs::Inputs;

use crate::report;

/// Passes of a kernel that count for the median; all count for the most.
const PASSES: usize = 1_200;

static PASSED: Mutex<RefCell<Passed>> =
    Mutex::new(RefCell::new(Passed { kernel: heapless::String::new(), cycles: heapless::Vec::new(), most: 0 }));

/// Cycles of the passes of the present kernel.
struct Passed {
    kernel: heapless::String<64>,
    cycles: heapless::Vec<u32, PASSES>,
    most: u32,
}

/// Runs all of them.
pub fn run(config: &Config, bench: &mut Bench, pipeline: &mut Pipeline) {
    report::say(format_args!("kernels: a minute or less"));
    study::run(config, &mut Inputs::new(bench, pipeline));
    begin("");
}

/// Begins another kernel and reports the one before.
pub fn begin(kernel: &str) {
    free(|section| {
        let Passed { kernel: name, cycles, most } = &mut *PASSED.borrow(section).borrow_mut();
        cycles.sort_unstable();
        if let Some(median) = cycles.get(cycles.len() / 2) {
            report::cycles(name, *median, *most);
        }
        name.clear();
        // A name that is cut is that of no estimate.
        let _ = name.push_str(kernel);
        cycles.clear();
        *most = 0;
    });
}

/// Records the cycles of a pass.
fn note(cycles: u32) {
    free(|section| {
        let passed = &mut *PASSED.borrow(section).borrow_mut();
        passed.most = passed.most.max(cycles);
        // Beyond these only the most counts.
        let _ = passed.cycles.push(cycles);
    });
}
