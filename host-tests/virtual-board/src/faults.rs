//! Faults that can be injected during a run, in addition to the defects of the world itself (`Plant::faults`).

use crate::board::FingerBoard;
use crate::error::Error;
use crate::rig::Rig;
use rigless::emulator::{Access, AccessKind, Host, Stop};
use rigless::session::Session;
use rigless::soc::Width;

/// DMA1's flags of streams 4 to 7, and the registers of stream 5, which receives the bus.
const DMA1_HIFCR: u64 = 0x4002_600c;
const DMA1_S5CR: u64 = 0x4002_6088;
const DMA1_S5M0AR: u64 = 0x4002_6094;
const STREAM_5_FLAGS: u64 = 0x3d << 6;
const ENABLE: u64 = 1;
/// DMA2 stream 1's vector, and flash that no image takes.
const HALFWAY_VECTOR: u64 = 0x0800_0000 + 4 * (16 + 57);
const FREE_FLASH: u64 = 0x0803_f000;
/// `movw r0, #0xfffc; movt r0, #0x1fff; str r0, [r0]; bx lr`.
const STORE_BELOW_RAM: [u64; 6] = [0xf64f, 0x70fc, 0xf6c1, 0x70ff, 0x6000, 0x4770];
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
    /// The scan's half-frame interrupt stores a word just below RAM, as a stack that runs over does.
    StoreBelowRam,
    /// The bus's receiving DMA stream points where nothing answers, so its next byte is a transfer error: a panic.
    BusMemoryLost,
    /// The core's next access to these addresses is a bus error: a hard fault.
    BusError {
        /// The first address.
        from: u64,
        /// The first address after them.
        to: u64,
    },
}

impl Fault {
    fn apply(self, defect: bool, session: &mut Session<FingerBoard>, host: &mut dyn Host, stop: Stop) {
        match self {
            Self::ConvertersStall => session.board().part.front_end().lock().trigger_cut = defect,
            Self::TriggerMissed => session.board().part.front_end().lock().trigger_missed = defect,
            Self::ScanInterruptLost => session.board().part.front_end().lock().scan_interrupt_lost = defect,
            Self::BridgeFault => session.board_mut().part.set_bridge_well(stop.at, !defect),
            Self::CoreHangs => host.hold(defect),
            Self::ClockLost => {}
            Self::StoreBelowRam if defect => {
                for (place, halfword) in STORE_BELOW_RAM.into_iter().enumerate() {
                    host.program(FREE_FLASH + 2 * place as u64, Width::W16, halfword)
                        .expect("the flash can be programmed");
                }
                host.program(HALFWAY_VECTOR, Width::W32, FREE_FLASH | 1).expect("the flash can be programmed");
            }
            Self::StoreBelowRam => {}
            Self::BusMemoryLost if defect => {
                let mut access = |kind, address, value| {
                    let access = Access::new(kind, address, Width::W32, value).at(stop.instruction_count, stop.at);
                    session.access(access, host).0
                };
                let control = access(AccessKind::Read, DMA1_S5CR, 0);
                access(AccessKind::Write, DMA1_S5CR, control & !ENABLE);
                access(AccessKind::Write, DMA1_HIFCR, STREAM_5_FLAGS);
                access(AccessKind::Write, DMA1_S5M0AR, NOWHERE);
                access(AccessKind::Write, DMA1_S5CR, control | ENABLE);
            }
            Self::BusMemoryLost => {}
            Self::BusError { from, to } if defect => session.fail_next(from, to),
            Self::BusError { .. } => {}
        }
    }
}

impl Rig {
    /// Breaks something from now on.
    pub fn inject(&mut self, fault: Fault) -> Result<(), Error> {
        self.set(fault, true)
    }

    /// Mends it again.
    pub fn mend(&mut self, fault: Fault) -> Result<(), Error> {
        self.set(fault, false)
    }

    fn set(&mut self, fault: Fault, defect: bool) -> Result<(), Error> {
        self.with(move |stand| {
            fault.apply(defect, stand.session, stand.host, stand.stop);
            if fault == Fault::CoreHangs {
                stand.bench.core_held = defect;
            }
            if fault == Fault::ClockLost {
                stand.bench.clock.set_lost(defect, stand.session, stand.host, stand.stop);
            }
            if fault == Fault::BridgeFault {
                let at_ns = stand.bench.next_ns;
                stand.bench.watch_bridge(stand.session.board_mut(), at_ns);
            }
        })
    }
}
