//! Reports of a run: resets, latency, stack use, pins, and gaps of the emulated part; a digest of all duties and bytes.
//!
//! The emulator joins peripherals whatever the pins say, so the report compares each pin with its wiring. The start-up
//! code paints the stack; words that are still painted were never used.

use crate::Error;
use crate::flash::SECTORS;
use crate::image::hex;
use crate::rig::Rig;
use rigless::device::ResetCause;
use rigless::soc::Width;
use rigless::soc::stm32f427::generated::gpioa::Register;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};

/// Required mode of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Output,
    Analog,
    Function(u8),
}

/// Port, pins and mode of each connection, from the table of `docs/board.md`.
const WIRED: [(usize, &[u8], Mode); 11] = [
    (1, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], Mode::Output),
    (0, &[0, 1, 4, 6, 7], Mode::Analog),
    (2, &[0, 1, 2, 3, 4, 5], Mode::Analog),
    (0, &[8, 9], Mode::Function(1)),
    (1, &[12], Mode::Function(1)),
    (1, &[10, 13, 15], Mode::Output),
    (1, &[14], Mode::Function(3)),
    (2, &[6, 7], Mode::Function(2)),
    (0, &[2, 3], Mode::Function(7)),
    (2, &[8, 9], Mode::Output),
    (0, &[5], Mode::Output),
];

/// Word that the start-up code fills the stack with.
const PAINT: u64 = 0xcccc_cccc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StackUse {
    pub size: u64,
    /// Largest number of bytes in use since the last reset.
    pub used: u64,
}

/// RCC_DCKCFGR2, which the emulated part lacks: clock choices of the F446 that the image does not use.
const DCKCFGR2: u64 = 0x4002_3894;

impl Rig {
    /// Time from the last conversion of each frame to its duty.
    pub fn latency(&mut self) -> Result<Latency, Error> {
        self.with(|stand| stand.bench.latency.clone())
    }

    /// Times at which the bridge was switched on or off.
    pub fn bridge_edges(&mut self) -> Result<Vec<Edge>, Error> {
        self.with(|stand| stand.bench.bridge_edges.clone())
    }

    /// Resets since power-on: cause and time, ns. The cause is `software`, or the name of a peripheral, for example `IWDG`.
    pub fn resets(&mut self) -> Result<Vec<(String, u64)>, Error> {
        let cause = |cause| match cause {
            ResetCause::Core => "software".to_owned(),
            ResetCause::Model(instance) => instance.to_owned(),
            other => format!("{other:?}"),
        };
        self.with(move |stand| stand.session.resets().iter().map(|reset| (cause(reset.cause), reset.at.0)).collect())
    }

    /// Pins whose mode does not fit the board's wiring.
    pub fn miswired_pins(&mut self) -> Result<Vec<String>, Error> {
        self.with(|stand| {
            let chip = &mut stand.session.board_mut().chip;
            let mut wrong = Vec::new();
            for (port, pins, wanted) in WIRED {
                let (_, registers) = chip.port(port);
                for number in pins {
                    let pin = Pin::new(*number).expect("ports have 16 pins");
                    let is = match registers.get(Register::Moder) >> (2 * number) & 0b11 {
                        1 => Some(Mode::Output),
                        3 => Some(Mode::Analog),
                        _ => Gpio::function(pin, registers).map(Mode::Function),
                    };
                    if is != Some(wanted) {
                        let port = ['A', 'B', 'C'][port];
                        wrong.push(format!("P{port}{number} must be {wanted:?} and is {is:?}"));
                    }
                }
            }
            wrong
        })
    }

    /// Stack use since the last reset, or `None` if the image has no symbols for its stack.
    pub fn stack_use(&mut self) -> Result<Option<StackUse>, Error> {
        let ends = self.image.symbol("_stack_end").zip(self.image.symbol("_stack_start"));
        let Some((low, high)) = ends.filter(|(low, high)| low < high) else { return Ok(None) };
        self.with(move |stand| {
            let painted = |address: &u64| stand.host.read(*address, Width::W32).is_ok_and(|word| word == PAINT);
            let untouched = (low..high).step_by(4).take_while(painted).count() as u64 * 4;
            Some(StackUse { size: high - low, used: high - low - untouched })
        })
    }

    /// Accesses of the run that the emulated part does not model, a line each. Two kinds are left out, as they are harmless:
    /// `DCKCFGR2`, and the sectors of the stored parameters, which [`Programmer`](crate::flash::Programmer) keeps.
    pub fn gaps(&mut self) -> Result<Vec<String>, Error> {
        self.with(|stand| {
            let session = &*stand.session;
            let mut gaps = Vec::new();
            for entry in session.unmapped() {
                if !SECTORS.contains(&entry.address) && entry.address != DCKCFGR2 {
                    gaps.push(format!("  unmapped {:#010x} (from {:#010x})", entry.address, entry.program_counter));
                }
            }
            for (address, fault) in session.refused() {
                gaps.push(format!("  refused {address:#010x} ({fault:?})"));
            }
            for entry in session.unimplemented().values() {
                let accesses = format!("{} reads, {} writes", entry.reads, entry.writes);
                gaps.push(format!("  unimplemented {} {} ({accesses})", entry.instance, entry.register));
            }
            for (instance, number) in session.unrouted() {
                gaps.push(format!("  unrouted {instance} {number}"));
            }
            for told in session.told() {
                gaps.push(format!("  told {} {} ({})", told.instance, told.register, told.reason));
            }
            if let Some(value) = stand.bench.clock.wrong_pll {
                gaps.push(format!("  refused RCC PLLCFGR (divider Q or R below 2: {value:#010x})"));
            }
            gaps
        })
    }

    /// Fails if the run has met a gap.
    pub fn check_gaps(&mut self) -> Result<(), Error> {
        let gaps = self.gaps()?;
        if gaps.is_empty() { Ok(()) } else { Err(Error::Gaps(gaps.join("\n"))) }
    }
}

/// Time from the last conversion of a frame to the new duty.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    /// Number of frames that got a duty.
    pub frames: u64,
    pub max_ns: u64,
    pub min_ns: u64,
    open: Option<(u64, u64)>,
}

impl Latency {
    /// Records a duty. The last write after the end of a frame counts.
    pub fn duty_written(&mut self, at_ns: u64, frame_end_ns: u64) {
        if frame_end_ns == 0 {
            return;
        }
        let before = self.open.replace((frame_end_ns, at_ns));
        if let Some((end_ns, at_ns)) = before.filter(|(end_ns, _)| *end_ns != frame_end_ns) {
            let latency_ns = at_ns - end_ns;
            self.max_ns = self.max_ns.max(latency_ns);
            self.min_ns = if self.frames == 0 { latency_ns } else { self.min_ns.min(latency_ns) };
            self.frames += 1;
        }
    }
}

/// Change of a pin's level, or of the bridge between on and off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    pub at_ns: u64,
    /// True if the pin is high, or the bridge drives, after the edge.
    pub on: bool,
}

/// A chained SHA-256 of every duty and every byte on the bus, with their times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    state: [u8; 32],
    pub records: u64,
}

#[derive(Clone, Copy, Debug)]
pub enum Record {
    /// A value written to a register of the bridge's timer: its offset and the value.
    Pwm(u16, u32),
    /// A byte from the image.
    Sent(u8),
    /// The bridge was switched off (false) or on.
    Bridge(bool),
}

impl Trace {
    pub fn add(&mut self, at_ns: u64, record: Record) {
        let (kind, value) = match record {
            Record::Pwm(offset, value) => (1_u64 << 56 | u64::from(offset) << 32, value),
            Record::Sent(byte) => (2 << 56, u32::from(byte)),
            Record::Bridge(on) => (3 << 56, u32::from(on)),
        };
        let mut block = [0; 48];
        block[..32].copy_from_slice(&self.state);
        block[32..40].copy_from_slice(&at_ns.to_le_bytes());
        block[40..].copy_from_slice(&(kind | u64::from(value)).to_le_bytes());
        self.state = rigless::snapshot::digest(&block);
        self.records += 1;
    }

    pub fn hash(&self) -> String {
        hex(&self.state)
    }
}
