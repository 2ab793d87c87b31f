//! The control step, linked alone: an image that cannot link if the step can panic.
//!
//! Never run. Its panic handler calls an undefined function; the linker drops the handler where no panic is
//! reachable, and refuses the image where one is. The controls show that both this and the search for floating-point
//! calls can fail.
#![no_std]
#![no_main]

use core::hint::black_box;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::shipped::{Frame, Pipeline};
use fingertip::units::Duty;

/// The step, with a pipeline and arguments of which the compiler knows nothing.
#[unsafe(no_mangle)]
#[inline(never)]
fn control_step(pipeline: &mut Pipeline, frame: &Frame, sense: &Sense, command: &Command) -> Duty {
    if cfg!(feature = "proof-control-panic") {
        let codes = frame.codes.rows.as_flattened();
        return Duty(codes[command.goal.to_bits() as usize] as i16);
    }
    if cfg!(feature = "proof-control-float") {
        return Duty((f64::from(sense.supply_mv) * 0.1) as i16);
    }
    pipeline.step(frame, sense, command).0
}

#[cortex_m_rt::entry]
fn main() -> ! {
    black_box(control_step as *const ());
    loop {
        core::hint::spin_loop();
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn fingertip_step_can_panic() -> !;
    }
    // SAFETY: cannot be reached, because it cannot be linked.
    unsafe { fingertip_step_can_panic() }
}
