//! Every variant of every kernel of the study, over fixed inputs, for the timing model: reports all results.
//!
//! Not for a board: it talks to the emulator by semihosting. The command line names the file of inputs. A line
//! `region NUMBER KERNEL: VARIANT` begins a variant, a line for each input follows; `docs/study.md` has the results.
#![no_std]
#![no_main]

#[path = "../study/call.rs"]
mod call;
mod host;
#[path = "../study/inputs.rs"]
mod inputs;
#[path = "../study/kernels.rs"]
mod kernels;

use cortex_m_semihosting::debug;
use fingertip::shipped::Config;
use host::fail;
use inputs::Inputs;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut inputs = Inputs::open();
    let Ok(config) = Config::shipped(&images::CONFIRMED) else { fail("the default parameters are refused") };
    kernels::run(&config, &mut inputs);
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail("panic")
}
