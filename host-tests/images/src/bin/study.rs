//! Every variant of every kernel of the study, over fixed inputs, for the timing model: says what each returned.
//!
//! Not for a board: it talks to the emulator by semihosting. The command line names the file of inputs. A line
//! `region NUMBER KERNEL: VARIANT` begins a variant, a line for each input follows; `docs/study.md` has the results.
#![no_std]
#![no_main]

#[path = "../study/call.rs"]
mod call;
#[path = "../study/control.rs"]
mod control;
#[path = "../study/fit.rs"]
mod fit;
#[path = "../study/force.rs"]
mod force;
#[path = "../study/formats.rs"]
mod formats;
#[path = "../study/frame.rs"]
mod frame;
mod host;
#[path = "../study/inputs.rs"]
mod inputs;
#[path = "../study/number.rs"]
mod number;
#[path = "../study/packed.rs"]
mod packed;
#[path = "../study/pressure.rs"]
mod pressure;
#[path = "../study/rings.rs"]
mod rings;
#[path = "../study/root.rs"]
mod root;
#[path = "../study/scalar.rs"]
mod scalar;
#[path = "../study/sparse.rs"]
mod sparse;
#[path = "../study/step.rs"]
mod step;

use cortex_m_semihosting::debug;
use fingertip::params::Params;
use fingertip::shipped::Config;
use host::{fail, say};
use inputs::Inputs;
use scalar::Tools;

/// Only returns.
#[unsafe(naked)]
extern "C" fn nothing(_: &mut ()) {
    core::arch::naked_asm!("bx lr")
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut inputs = Inputs::open();
    let Ok(config) = Config::shipped(&Params::DEFAULT) else { fail("the default parameters are refused") };
    let tools = Tools::new(&config);
    say(format_args!("region 0 nothing: an empty call"));
    for _ in 0..256 {
        call::pass_on(0, nothing, &mut ());
    }
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
    frame::run(region, &config, &mut inputs);
    fit::run("fit-clean", region, &mut inputs);
    fit::run("fit-noise", region, &mut inputs);
    control::run(region, &mut inputs);
    step::run(region, &config, &mut inputs);
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail("panic")
}
