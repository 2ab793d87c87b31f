//! Checks that end in a reset, one after another. Their state is in memory that start-up does not clear.

use core::mem::MaybeUninit;
use cortex_m::peripheral::{DWT, SCB};
use embassy_stm32::Peri;
use embassy_stm32::peripherals::{IWDG, WWDG};
use fingertip::link::snapshot::ResetCause;
use fingertip::scan::ScanTiming;

use crate::board::guard::Watchdogs;
use crate::{CYCLES_PER_US, passed, report};

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    Waits,
    /// Reset by the window watchdog.
    Window,
    /// Reset by the independent watchdog.
    Independent,
    /// Fault by a store below the stack.
    Foot,
    Rest,
}

const MAGIC: u32 = 0x4252_5550;
/// All stages, each at the place of its number.
const STAGES: [Stage; 5] = [Stage::Waits, Stage::Window, Stage::Independent, Stage::Foot, Stage::Rest];
/// Time after which a reset by a watchdog is no longer expected: twice the longest time of the independent one.
const BITES_BY: u32 = 50_000 * CYCLES_PER_US;
/// Time after which the independent watchdog has accepted its new period: 1 ms.
const TAKES_BY: u32 = 1_000 * CYCLES_PER_US;
const BELOW_RAM: *mut u32 = 0x1FFF_FFFC as *mut u32;

/// The magic number, the stage, the frames, and the cycles of both watchdogs.
type Words = [u32; 5];

#[unsafe(link_section = ".uninit.bringup")]
static mut KEPT: MaybeUninit<Words> = MaybeUninit::uninit();

/// State that is kept through a reset.
#[derive(Clone, Copy)]
pub struct Kept {
    pub stage: Stage,
    /// Number of frames for which the rows are read back.
    pub frames: u32,
    /// Times after which the watchdogs reset, window and independent: 0 without a reset.
    pub cycles: [u32; 2],
}

impl Kept {
    const NOTHING: Self = Self { stage: Stage::Waits, frames: 0, cycles: [0; 2] };

    /// Returns the kept state; `None` after a power-on.
    pub fn load(reset: ResetCause) -> Self {
        // SAFETY: any bit pattern is valid, and nothing else runs.
        let [magic, stage, frames, cycles @ ..] = unsafe { (&raw const KEPT).cast::<Words>().read_volatile() };
        let stage = STAGES.get(stage as usize).filter(|_| magic == MAGIC && reset != ResetCause::PowerOn);
        stage.map_or(Self::NOTHING, |stage| Self { stage: *stage, frames, cycles })
    }

    pub fn store(self) {
        let Self { stage, frames, cycles: [window, independent] } = self;
        // SAFETY: as for `load`.
        unsafe {
            (&raw mut KEPT).cast::<Words>().write_volatile([MAGIC, stage as u32, frames, window, independent]);
        }
    }
}

/// Waits for the host's word, then begins.
pub fn wait(kept: Kept) -> ! {
    let frames = report::wait_for_go();
    Kept { stage: Stage::Window, frames, ..kept }.store();
    SCB::sys_reset()
}

/// Records the time until a watchdog resets: the window watchdog, as it waits while frames are expected, or the
/// independent one, with the longest time for the other.
pub fn bite(mut kept: Kept, independent: Peri<'static, IWDG>, window: Peri<'static, WWDG>, timing: ScanTiming) -> ! {
    let mut dogs = Watchdogs::new(independent, window);
    dogs.start();
    dogs.expect_frames(timing);
    let dog = usize::from(kept.stage == Stage::Independent);
    kept.stage = [Stage::Independent, Stage::Foot][dog];
    if kept.stage == Stage::Foot {
        dogs.allow_long();
        cortex_m::asm::delay(TAKES_BY);
        dogs.pet();
    }
    let since = DWT::cycle_count();
    while !passed(since, BITES_BY) {
        kept.cycles[dog] = DWT::cycle_count().wrapping_sub(since);
        kept.store();
    }
    kept.cycles[dog] = 0;
    kept.store();
    SCB::sys_reset()
}

/// Stores below RAM, as a stack that runs over does: a hard fault, whose handler resets.
pub fn foot(kept: Kept) -> ! {
    Kept { stage: Stage::Rest, ..kept }.store();
    // SAFETY: nothing is stored there; the memory protection unit refuses the write, and without it nothing is lost.
    unsafe { BELOW_RAM.write_volatile(0) };
    SCB::sys_reset()
}
