//! The study's kernels by the core's cycle counter: the same code and inputs as `cargo xtask study`'s image has under
//! the timing model.

#[path = "call.rs"]
mod call;
#[path = "../../../images/src/study/control.rs"]
mod control;
#[path = "../../../images/src/study/fit.rs"]
mod fit;
#[path = "../../../images/src/study/force.rs"]
mod force;
#[path = "../../../images/src/study/formats.rs"]
mod formats;
#[path = "../../../images/src/study/frame.rs"]
mod frame;
#[path = "inputs.rs"]
mod inputs;
#[path = "../../../images/src/study/number.rs"]
mod number;
#[path = "../../../images/src/study/packed.rs"]
mod packed;
#[path = "../../../images/src/study/pressure.rs"]
mod pressure;
#[path = "../../../images/src/study/rings.rs"]
mod rings;
#[path = "../../../images/src/study/root.rs"]
mod root;
#[path = "../../../images/src/study/scalar.rs"]
mod scalar;
#[path = "../../../images/src/study/sparse.rs"]
mod sparse;
#[path = "../../../images/src/study/step.rs"]
mod step;

use bringup::script::Bench;
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use fingertip::shipped::{Config, Pipeline};
use inputs::Inputs;
use scalar::Tools;

use crate::report;

/// Passes of a kernel whose median is told; all count for the most.
const PASSES: usize = 1_200;

static PASSED: Mutex<RefCell<Passed>> =
    Mutex::new(RefCell::new(Passed { kernel: heapless::String::new(), cycles: heapless::Vec::new(), most: 0 }));

/// What the passes of the present kernel took.
struct Passed {
    kernel: heapless::String<64>,
    cycles: heapless::Vec<u32, PASSES>,
    most: u32,
}

/// Only returns.
#[unsafe(naked)]
extern "C" fn nothing(_: &mut ()) {
    core::arch::naked_asm!("bx lr")
}

/// Runs all of them.
pub fn run(config: &'static Config, bench: &mut Bench, pipeline: &mut Pipeline) {
    report::say(format_args!("kernels: a minute or less"));
    begin("nothing: an empty call");
    for _ in 0..256 {
        call::pass_on(0, nothing, &mut ());
    }
    let tools = Tools::new(config);
    let mut inputs = Inputs::new(config, bench, pipeline);
    let region = &mut 1;
    for (kernel, variants) in [
        ("root", root::VARIANTS),
        ("force", force::FORCE),
        ("indentation", force::INDENTATION),
        ("pressure", pressure::VARIANTS),
        ("rings", rings::VARIANTS),
    ] {
        scalar::run(kernel, variants, region, &tools, &mut inputs);
    }
    frame::run(region, config, &mut inputs);
    fit::run("fit-clean", region, &mut inputs);
    fit::run("fit-noise", region, &mut inputs);
    control::run(region, &mut inputs);
    step::run(region, config, &mut inputs);
    begin("");
}

/// Another kernel begins: tells of the one before.
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

/// A pass took so long.
fn note(cycles: u32) {
    free(|section| {
        let passed = &mut *PASSED.borrow(section).borrow_mut();
        passed.most = passed.most.max(cycles);
        // Beyond these only the most counts.
        let _ = passed.cycles.push(cycles);
    });
}
