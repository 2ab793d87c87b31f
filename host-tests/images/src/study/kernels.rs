//! Every kernel of the study, one after the other. Whoever runs them brings the inputs, and how to call a kernel.

mod fit;
mod force;
mod frame;
mod scalar;
mod step;

use super::Inputs;
use super::call;
use crate::host::say;
use fingertip::shipped::Config;
use scalar::Tools;

/// Empty function: only returns.
#[unsafe(naked)]
extern "C" fn nothing(_: &mut ()) {
    core::arch::naked_asm!("bx lr")
}

/// Runs all kernels. A line `region NUMBER KERNEL: VARIANT` begins each.
pub fn run(config: &Config, inputs: &mut Inputs) {
    say(format_args!("region 0 nothing: an empty call"));
    for _ in 0..256 {
        call::pass_on(0, nothing, &mut ());
    }
    let tools = Tools::new(config);
    let region = &mut 1;
    for (kernel, variants) in [
        ("root", scalar::ROOT),
        ("force", force::FORCE),
        ("indentation", force::INDENTATION),
        ("pressure", force::PRESSURE),
    ] {
        scalar::run(kernel, variants, region, &tools, inputs);
    }
    frame::run(region, config, inputs);
    fit::run("fit-clean", region, inputs);
    fit::run("fit-noise", region, inputs);
    step::run(region, config, inputs);
}
