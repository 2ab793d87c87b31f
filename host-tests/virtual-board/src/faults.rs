//! Faults that can be injected during a run, in addition to the defects of the world itself (`Plant::faults`).

use crate::Error;
use crate::part::Part;
use crate::rig::{Rig, Stand};
use rigless::device::{DeviceContext, RegisterFile};
use rigless::emulator::{Access, AccessKind, Host, InterruptLine, Stop};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::soc::stm32f427::generated::rcc::{Register, cr};
use rigless::soc::stm32f427::generated::{RCC, TIM5};
use rigless::soc::stm32f427::peripherals::rcc::Rcc;

/// DMA1's flags of streams 4 to 7, and the registers of stream 5, which receives the bus.
const DMA1_HIFCR: u64 = 0x4002_600c;
const DMA1_S5CR: u64 = 0x4002_6088;
const DMA1_S5M0AR: u64 = 0x4002_6094;
const STREAM_5_FLAGS: u64 = 0x3d << 6;
const ENABLE: u64 = 1;
/// DMA2 stream 1's vector, and flash that no image takes.
const HALFWAY_VECTOR: u64 = 0x0800_0000 + 4 * (16 + 57);
const FREE_FLASH: u64 = 0x0803_f000;
/// Address at which no device answers.
const NOWHERE: u64 = 0xd000_0000;

/// A defect of the board or the microcontroller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The timer's trigger no longer reaches the converters.
    ConvertersStall,
    /// The second bank's converter misses the next trigger, so its codes lag behind the rows by a slot.
    TriggerMissed,
    /// The bridge's driver pulls nFAULT low.
    BridgeFault,
    /// The scan's interrupt never reaches the core, as if its enable were lost.
    ScanInterruptLost,
    /// The core hangs, as in a loop with interrupts off. It runs again after the next reset.
    CoreHangs,
    /// The external clock stops, and is not there at a start. The emulated part has no exception that nothing masks:
    /// its handler is entered as the frame guard's interrupt, which has the highest priority.
    ClockLost,
    /// The scan's half-frame interrupt stores a word at this address.
    StoreAt(u32),
    /// The bus's receiving DMA stream points where nothing answers, so its next byte is a transfer error: a panic.
    BusMemoryLost,
    /// The core's next access to TIM5, which times the frame guard, is a bus error: a hard fault.
    BusError,
}

impl Fault {
    fn apply(self, defect: bool, stand: &mut Stand<'_>) {
        let Stand { session, host, stop, bench } = stand;
        match self {
            Self::ConvertersStall => bench.front_end.lock().trigger_cut = defect,
            Self::TriggerMissed => bench.front_end.lock().trigger_missed = defect,
            Self::ScanInterruptLost => bench.front_end.lock().scan_interrupt_lost = defect,
            Self::BridgeFault => {
                session.board_mut().set_bridge_well(stop.at, !defect);
                bench.watch_bridge(session.board_mut(), bench.next_ns);
            }
            Self::CoreHangs => {
                host.hold(defect);
                bench.core_held = defect;
            }
            Self::ClockLost => bench.clock.set_lost(defect, session, *host, *stop),
            Self::StoreAt(address) if defect => {
                for (place, halfword) in store_at(address.into()).into_iter().enumerate() {
                    program(*host, FREE_FLASH + 2 * place as u64, Width::W16, halfword);
                }
                program(*host, HALFWAY_VECTOR, Width::W32, FREE_FLASH | 1);
            }
            Self::BusMemoryLost if defect => {
                let mut access = |kind, address, value| {
                    let access = Access::new(kind, address, Width::W32, value).at(stop.instruction_count, stop.at);
                    session.access(access, *host).0
                };
                let control = access(AccessKind::Read, DMA1_S5CR, 0);
                access(AccessKind::Write, DMA1_S5CR, control & !ENABLE);
                access(AccessKind::Write, DMA1_HIFCR, STREAM_5_FLAGS);
                access(AccessKind::Write, DMA1_S5M0AR, NOWHERE);
                access(AccessKind::Write, DMA1_S5CR, control | ENABLE);
            }
            Self::BusError if defect => session.fail_next(TIM5.base, TIM5.base + 0x400),
            Self::StoreAt(_) | Self::BusMemoryLost | Self::BusError => {}
        }
    }
}

/// `movw r0, #low; movt r0, #high; str r0, [r0]; bx lr`.
fn store_at(address: u64) -> [u64; 6] {
    let moved = |opcode: u64, half: u64| {
        [opcode | (half >> 11 & 1) << 10 | half >> 12 & 15, (half >> 8 & 7) << 12 | half & 0xff]
    };
    let ([low, low_rest], [high, high_rest]) = (moved(0xf240, address), moved(0xf2c0, address >> 16));
    [low, low_rest, high, high_rest, 0x6000, 0x4770]
}

pub fn program(host: &mut dyn Host, address: u64, width: Width, value: u64) {
    host.program(address, width, value).expect("the flash can be programmed");
}

impl Rig {
    /// Breaks something from now on.
    pub fn inject(&mut self, fault: Fault) -> Result<(), Error> {
        self.with(move |stand| fault.apply(true, stand))
    }

    pub fn mend(&mut self, fault: Fault) -> Result<(), Error> {
        self.with(move |stand| fault.apply(false, stand))
    }
}

// The clock that the ST-LINK feeds to PH0, and its loss.
//
// The crate's clock tree switches over as the clock security system does, and breaks TIM1, but it cannot raise the
// exception that nothing masks. Its handler is entered as the frame guard's interrupt, which has the highest priority.
// Nor does the tree know of an oscillator that never gets ready: its enable is taken back as soon as it is set. It takes
// any divider of the PLL: those that the manual forbids are reported as a gap.

/// The register with the PLL's dividers; the tree does not have the F446's divider R.
const PLLCFGR: u64 = 4;
const NMI_VECTOR: u64 = 0x0800_0008;
/// TIM5's.
const GUARD_VECTOR: u64 = 0x0800_0000 + 4 * (16 + 50);
const GUARD_LINE: InterruptLine = InterruptLine::new(50).expect("there are more lines");

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
    pub fn set_lost(&mut self, lost: bool, session: &mut Session<Part>, host: &mut dyn Host, stop: Stop) {
        self.lost = lost;
        let guarded = |clocks: &mut Rcc, registers: &mut RegisterFile, context: &mut DeviceContext<'_>| {
            let guarded = cr::CSSON.is_set(registers.get(Register::Cr));
            clocks.fail_hse(registers, context);
            guarded
        };
        if lost && session.board_mut().chip.drive_clocks(stop.at, guarded) {
            let [handler, guard] =
                [NMI_VECTOR, GUARD_VECTOR].map(|vector| host.read(vector, Width::W32).expect("the vectors are flash"));
            self.vector = Some(guard);
            program(host, GUARD_VECTOR, Width::W32, handler);
            session.pulse(GUARD_LINE, host);
        }
    }

    /// The core touched a register.
    pub fn accessed(&mut self, session: &mut Session<Part>, host: &mut dyn Host, access: &Access) {
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

    pub fn restarted(&mut self, host: &mut dyn Host) {
        if let Some(vector) = self.vector.take() {
            program(host, GUARD_VECTOR, Width::W32, vector);
        }
    }
}
