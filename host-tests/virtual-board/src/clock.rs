//! The clock that the ST-LINK feeds to PH0, and its loss.
//!
//! The crate's clock tree switches over as the clock security system does, and breaks TIM1, but it cannot raise the
//! exception that nothing masks. Its handler is entered as the frame guard's interrupt, which has the highest priority.
//! Nor does the tree know of an oscillator that never gets ready: its enable is taken back as soon as it is set. It takes
//! any divider of the PLL: those that the manual forbids are reported as a gap.

use crate::board::FingerBoard;
use rigless::device::{DeviceContext, RegisterFile};
use rigless::emulator::{Access, AccessKind, Host, InterruptLine, Stop};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::soc::stm32f427::generated::RCC;
use rigless::soc::stm32f427::generated::rcc::{Register, cr};
use rigless::soc::stm32f427::peripherals::rcc::Rcc;

/// The register with the PLL's dividers; the tree does not have the F446's divider R.
const PLLCFGR: u64 = 4;
const NMI_VECTOR: u64 = 0x0800_0008;
/// TIM5's.
const GUARD_VECTOR: u64 = 0x0800_0000 + 4 * (16 + 50);
const GUARD_LINE: InterruptLine = InterruptLine::new(50).expect("there are more lines");

/// State of the external clock.
#[derive(Clone, Debug, Default)]
pub struct ExternalClock {
    lost: bool,
    /// The last setting of the PLL with a divider Q or R below 2.
    pub wrong_pll: Option<u64>,
    /// The guard's own vector, while the NMI's replaces it.
    vector: Option<u64>,
}

impl ExternalClock {
    /// Stops the clock, or restores it for the next start.
    pub fn set_lost(&mut self, lost: bool, session: &mut Session<FingerBoard>, host: &mut dyn Host, stop: Stop) {
        self.lost = lost;
        let guarded = |clocks: &mut Rcc, registers: &mut RegisterFile, context: &mut DeviceContext<'_>| {
            let guarded = cr::CSSON.is_set(registers.get(Register::Cr));
            clocks.fail_hse(registers, context);
            guarded
        };
        if lost && session.board_mut().part.chip.drive_clocks(stop.at, guarded) {
            let [handler, guard] =
                [NMI_VECTOR, GUARD_VECTOR].map(|vector| host.read(vector, Width::W32).expect("the vectors are flash"));
            self.vector = Some(guard);
            host.program(GUARD_VECTOR, Width::W32, handler).expect("the flash can be programmed");
            session.pulse(GUARD_LINE, host);
        }
    }

    /// The core touched a register.
    pub fn accessed(&mut self, session: &mut Session<FingerBoard>, host: &mut dyn Host, access: &Access) {
        let pll = access.kind == AccessKind::Write && access.address == RCC.base + PLLCFGR;
        if pll && (access.value >> 24 & 0b1111 < 2 || access.value >> 28 & 0b111 < 2) {
            self.wrong_pll = Some(access.value);
        }
        let control = self.lost && access.kind == AccessKind::Write && access.address == RCC.base;
        if control && cr::HSEON.is_set(access.value) {
            let off = cr::HSEON.set(access.value, 0);
            let again = Access::new(AccessKind::Write, RCC.base, Width::W32, off);
            session.access(again.at(access.instruction_count, access.virtual_time), host);
        }
    }

    /// The part was reset.
    pub fn restarted(&mut self, host: &mut dyn Host) {
        if let Some(vector) = self.vector.take() {
            host.program(GUARD_VECTOR, Width::W32, vector).expect("the flash can be programmed");
        }
    }
}
