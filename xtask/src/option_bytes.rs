//! The option bytes: brown-out level 3, written so that nothing can interrupt.
//!
//! A write erases and programs the sector of the option bytes. If a reset or a power loss cuts it short, the device can come up
//! with read protection level 1, and leaving level 1 erases the whole flash. The image's window watchdog resets a halted
//! core too, after 1 ms. So the write begins behind a reset that halts the core before its first instruction: no code has
//! started a watchdog, and none can request a reset.
//!
//! Sources:
//!
//! - Order of the write (BSY = 0, OPTCR, OPTSTRT, BSY = 0): RM0390 3.6.2. RM0383 has the same words, quoted in an answer by
//!   ST: [STM32F411](https://community.st.com/t5/stm32-mcus-products/question-regarding-stm32f411re-option-bytes-0xff-issue/td-p/833681).
//! - An interrupted write reads as level 1: reports of other parts. Reset: [STM32F7, "normal behavior" for
//!   ST](https://github.com/STMicroelectronics/STM32CubeF7/issues/96), where resets within 1 s of the start cause trouble
//!   and later ones do not. Lost power:
//!   [STM32F429](https://community.st.com/t5/stm32-mcus-products/stm32f429zit6-reset-values-for-flash-option-bytes-when-power/td-p/394565),
//!   [STM32F427](https://community.st.com/thread/32256-stm32f4xx-question-about-option-bytes-setting-the-write-protection).
//! - Level 1 to 0 erases the flash: RM0390 3.6.3, as [RM0090 table 13 and figure
//!   5](https://www.manualslib.com/manual/2767128/St-Stm32f40-Series.html?page=73).
//! - DBGMCU_IDCODE at 0xE0042000 is 0x421: RM0390 33.6.1,
//!   [stlink](https://github.com/stlink-org/stlink/blob/115f7c846adf612c1ee818713530dbf17287ed9b/config/chips/F446.chip).
//! - Flash below 2.7 V: [micropython 4387](https://github.com/micropython/micropython/issues/4387). The falling edge of
//!   V_BOR3 is from DS10693, not checked against a public text.

use anyhow::{Result, anyhow, bail};
use std::fmt;

/// Device identifier in its lowest twelve bits (RM0390 33.6.1).
const DBGMCU_IDCODE: u32 = 0xe004_2000;
/// Halting control and status of the core (ARMv7-M C1.6.2).
const DHCSR: u32 = 0xe000_edf0;
const S_HALT: u32 = 1 << 17;
/// Registers of the flash interface (RM0390 3.8).
const OPTKEYR: u32 = 0x4002_3c08;
const SR: u32 = 0x4002_3c0c;
const OPTCR: u32 = 0x4002_3c14;
const KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];
const BSY: u32 = 1 << 16;
const OPTLOCK: u32 = 1 << 0;
const OPTSTRT: u32 = 1 << 1;
/// Zero is level 3, the highest threshold. The factory leaves brown-out reset off.
const BOR_LEV: u32 = 0b11 << 2;
const RDP: u32 = 0xff << 8;
/// Read protection level 0. Any other byte but 0xCC is level 1; 0xCC is level 2, for ever.
const RDP_LEVEL_0: u32 = 0xaa << 8;
/// One while only software starts the independent watchdog; zero starts it at reset, and 0.5 s later it resets.
const WDG_SW: u32 = 1 << 5;
/// All bits of the register that are option bytes.
const OPTIONS: u32 = 0x80ff_ffec;

/// Reads of a word that has not its expected value yet: 2 s, a pause of 10 ms before each.
const READS: usize = 200;
pub const PAUSE_MS: u64 = 10;

/// A debug probe that keeps the core halted from one access to the next.
pub trait Probe {
    /// Reads a word, also while the core runs.
    fn read(&mut self, address: u32) -> Result<u32>;
    /// Writes a word while the core is halted.
    fn write(&mut self, address: u32, value: u32) -> Result<()>;
    /// Resets the device, and halts the core before its first instruction.
    fn reset_and_halt(&mut self) -> Result<()>;
    /// Waits for [`PAUSE_MS`].
    fn pause(&mut self);
}

#[derive(Clone, Copy)]
enum Step {
    ResetAndHalt,
    /// Expected condition: address, mask, and value of the masked word within 2 s.
    Expect(&'static str, u32, u32, u32),
    Write(u32, u32),
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::ResetAndHalt => write!(f, "reset that halts the core"),
            Self::Expect(what, address, mask, value) => {
                write!(f, "expected {what}: {value:#x} in the bits {mask:#x} of {address:#010x}")
            }
            Self::Write(address, value) => write!(f, "write of {value:#010x} to {address:#010x}"),
        }
    }
}

const IDLE: Step = Step::Expect("an idle flash", SR, BSY, 0);
const HALTED: Step = Step::Expect("a halted core", DHCSR, S_HALT, S_HALT);
/// Writes nothing, and resets nothing while the flash is busy.
const PREPARE: [Step; 5] =
    [Step::Expect("an STM32F446", DBGMCU_IDCODE, 0xfff, 0x421), IDLE, Step::ResetAndHalt, HALTED, IDLE];

/// Unlocks the option bytes and puts the wanted ones into the register (RM0390 3.6.1, 3.6.2). The flash keeps the old ones.
fn unlock(wanted: u32) -> [Step; 7] {
    [
        Step::Expect(
            "read protection level 0 and a software watchdog (STM32CubeProgrammer sets both)",
            OPTCR,
            RDP | WDG_SW,
            RDP_LEVEL_0 | WDG_SW,
        ),
        Step::Write(OPTKEYR, KEYS[0]),
        Step::Write(OPTKEYR, KEYS[1]),
        Step::Expect("unlocked option bytes", OPTCR, OPTLOCK, 0),
        Step::Write(OPTCR, wanted),
        HALTED,
        IDLE,
    ]
}

/// Starts the write, and waits for its end.
fn start(wanted: u32) -> [Step; 2] {
    [Step::Write(OPTCR, wanted | OPTSTRT), IDLE]
}

/// Reads back the register, then, behind a reset, what the device loaded from its flash.
fn confirm(wanted: u32) -> [Step; 4] {
    let same = Step::Expect("the option bytes that were written", OPTCR, OPTIONS, wanted & OPTIONS);
    [same, Step::ResetAndHalt, HALTED, same]
}

const UNCHANGED: &str = "No option byte was changed. Check cable, probe and supply, reset the board, and try again.";

/// The option bytes, where [`program`] has to change them. Refuses another device, and leaves the core halted.
pub fn check(probe: &mut impl Probe) -> Result<Option<u32>> {
    run(probe, &PREPARE, UNCHANGED)?;
    let options = probe.read(OPTCR).map_err(|error| anyhow!("option bytes: {error:#}\n{UNCHANGED}"))?;
    Ok((options & BOR_LEV != 0).then_some(options))
}

/// Programs brown-out level 3: the image refuses torque without it. All other option bytes stay, and the core halted.
pub fn program(probe: &mut impl Probe, options: u32) -> Result<()> {
    let wanted = options & !(OPTLOCK | OPTSTRT | BOR_LEV);
    run(probe, &unlock(wanted), UNCHANGED)?;
    run(
        probe,
        &start(wanted),
        "The flash may still be writing, and an interrupted write can lock the device (read protection level 1).\n\
         Do not press reset, and leave the board powered for 2 s more. Then try again.",
    )?;
    run(
        probe,
        &confirm(wanted),
        "The write has ended, but its result is not confirmed: without level 3 the image refuses torque (fault 18).\n\
         Read the option bytes with STM32CubeProgrammer, set BOR level 3 there if it is missing, and try again.",
    )
}

/// Takes the steps until one fails; `next` is the advice for that case.
fn run(probe: &mut impl Probe, steps: &[Step], next: &str) -> Result<()> {
    for step in steps {
        let taken = match *step {
            Step::ResetAndHalt => probe.reset_and_halt(),
            Step::Write(address, value) => probe.write(address, value),
            Step::Expect(_, address, mask, value) => expect(probe, address, mask, value),
        };
        taken.map_err(|error| anyhow!("option bytes: {step}: {error:#}\n{next}"))?;
    }
    Ok(())
}

fn expect(probe: &mut impl Probe, address: u32, mask: u32, value: u32) -> Result<()> {
    let mut word = probe.read(address)?;
    for _ in 0..READS {
        if word & mask == value {
            return Ok(());
        }
        probe.pause();
        word = probe.read(address)?;
    }
    bail!("it reads {word:#010x} after 2 s")
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::ensure;

    /// Factory setting: brown-out reset off, read protection off, no sector protected, software watchdog.
    const FACTORY: u32 = 0x0fff_aaed;
    const LEVEL_3: u32 = FACTORY & !BOR_LEV;
    /// Pauses that a write takes: 350 ms.
    const WRITE_PAUSES: usize = 35;

    /// A device with a probe. Panics where an access could interrupt a write, or starts one that must not be.
    #[derive(Default)]
    struct Mock {
        idcode: u32,
        halts: bool,
        /// Bits that a write stores wrong.
        weak: u32,
        write_pauses: usize,
        /// Accesses before the cable comes off, and before the core runs again.
        cut: usize,
        slip: usize,
        accesses: usize,
        halted: bool,
        keys: usize,
        register: u32,
        stored: u32,
        /// Pauses until the flash is idle.
        busy: usize,
        started: bool,
    }

    impl Mock {
        fn new(stored: u32) -> Self {
            Self {
                idcode: 0x1000_6421,
                halts: true,
                write_pauses: WRITE_PAUSES,
                cut: usize::MAX,
                slip: usize::MAX,
                register: stored,
                stored,
                ..Self::default()
            }
        }

        fn access(&mut self) -> Result<()> {
            ensure!(self.accesses < self.cut, "the probe is gone");
            self.halted &= self.accesses != self.slip;
            self.accesses += 1;
            Ok(())
        }

        fn whole(&mut self) -> Result<()> {
            check(self)?.map_or(Ok(()), |options| program(self, options))
        }

        /// The message of the failure, and whether a write was started.
        fn failure(mut self) -> (String, bool) {
            (self.whole().expect_err("a failure").to_string(), self.started)
        }
    }

    impl Probe for Mock {
        fn read(&mut self, address: u32) -> Result<u32> {
            self.access()?;
            Ok(match address {
                DBGMCU_IDCODE => self.idcode,
                DHCSR => u32::from(self.halted) * S_HALT,
                SR => u32::from(self.busy > 0) * BSY,
                OPTCR => self.register & !OPTLOCK | u32::from(self.keys < KEYS.len()),
                _ => panic!("a read of {address:#x}"),
            })
        }

        fn write(&mut self, address: u32, value: u32) -> Result<()> {
            self.access()?;
            ensure!(self.halted, "the core runs");
            assert_eq!((self.busy, self.idcode & 0xfff), (0, 0x421), "a busy flash, or another device");
            match address {
                OPTKEYR if value == KEYS[self.keys] => self.keys += 1,
                OPTCR if self.keys == KEYS.len() => self.register = value,
                _ => panic!("a write of {value:#x} to {address:#x}"),
            }
            if address == OPTCR && value & OPTSTRT != 0 {
                (self.stored, self.busy, self.started) = (value & !OPTSTRT ^ self.weak, self.write_pauses, true);
            }
            Ok(())
        }

        fn reset_and_halt(&mut self) -> Result<()> {
            self.access()?;
            assert_eq!(self.busy, 0, "a reset of a busy flash");
            (self.halted, self.keys, self.register) = (self.halts, 0, self.stored);
            Ok(())
        }

        fn pause(&mut self) {
            self.busy = self.busy.saturating_sub(1);
        }
    }

    /// Numbers of the access that starts a write, of the one that sees its end, and of all.
    fn accesses() -> [usize; 3] {
        let mut mock = Mock::new(FACTORY);
        mock.whole().expect("level 3");
        let end = mock.accesses - confirm(0).len();
        [end - WRITE_PAUSES - 1, end, mock.accesses]
    }

    #[test]
    fn only_the_brown_out_level_changes_and_where_it_is_right_nothing_is_written() {
        for (before, writes) in [(FACTORY, true), (LEVEL_3, false)] {
            let mut mock = Mock::new(before);
            mock.whole().expect("level 3");
            assert_eq!((mock.stored & OPTIONS, mock.halted, mock.started), (LEVEL_3 & OPTIONS, true, writes));
        }
    }

    #[test]
    fn what_goes_wrong_is_told_and_starts_no_write_where_it_is_known_before() {
        let [start, ..] = accesses();
        let busy = ["an idle flash", "0x00010000 after 2 s", "Do not press reset"];
        for (mock, words, starts) in [
            (Mock { idcode: 0x1000_6433, ..Mock::new(FACTORY) }, &["an STM32F446", UNCHANGED][..], false),
            (Mock { halts: false, ..Mock::new(FACTORY) }, &["a halted core", UNCHANGED], false),
            (Mock { slip: start - 3, ..Mock::new(FACTORY) }, &["a halted core", UNCHANGED], false),
            (Mock { busy: usize::MAX, ..Mock::new(FACTORY) }, &["an idle flash", UNCHANGED], false),
            (Mock::new(FACTORY & !RDP), &["read protection level 0", UNCHANGED], false),
            (Mock::new(FACTORY & !WDG_SW), &["a software watchdog", UNCHANGED], false),
            // A write that does not end is not reset.
            (Mock { write_pauses: usize::MAX, ..Mock::new(FACTORY) }, &busy, true),
            (Mock { weak: BOR_LEV, ..Mock::new(FACTORY) }, &["the option bytes that were written", "fault 18"], true),
        ] {
            let (message, started) = mock.failure();
            assert!(words.iter().all(|word| message.contains(word)) && started == starts, "{message}");
        }
    }

    #[test]
    fn a_cable_that_comes_off_at_any_access_is_told_with_what_to_do() {
        let [start, end, all] = accesses();
        for cut in 0..all {
            let (message, started) = Mock { cut, ..Mock::new(FACTORY) }.failure();
            let next = match cut {
                cut if cut < start - 1 => UNCHANGED,
                cut if cut < end => "Do not press reset",
                _ => "The write has ended",
            };
            assert!(message.contains("the probe is gone") && message.contains(next), "{cut}: {message}");
            assert_eq!(started, cut >= start, "{cut}: {message}");
        }
    }
}
