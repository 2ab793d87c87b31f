//! Where the emulated part differs from the real one and the run noticed: only what stands here with a reason may be.

use crate::error::Error;
use crate::flash::SECTORS;
use crate::rig::Rig;

/// A gap that was touched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// What kind: `unmapped`, `refused`, `unimplemented`, `unrouted` or `told`.
    pub kind: &'static str,
    /// Where: an address in hexadecimal, or instance and register.
    pub place: String,
    /// What was asked for.
    pub detail: String,
}

impl Gap {
    /// Why it does no harm; none when it is not on the allow-list.
    pub fn reason(&self) -> Option<&'static str> {
        let address = self.place.strip_prefix("0x").and_then(|digits| u64::from_str_radix(digits, 16).ok());
        if self.kind == "unmapped" && address.is_some_and(|address| SECTORS.contains(&address)) {
            return Some("the flash interface keeps nothing that is programmed; this crate does, in `flash`");
        }
        ALLOWED.iter().find(|(kind, place, _)| *kind == self.kind && *place == self.place).map(|(_, _, why)| *why)
    }
}

/// Kind, place, and why it does no harm.
const ALLOWED: [(&str, &str, &str); 1] = [(
    "unmapped",
    "0x40023894",
    "RCC_DCKCFGR2 of the F446: clock choices of the CEC, I2C-FMP, USB, SDIO and SPDIF, which the image does not use",
)];

impl Rig {
    /// Every gap that the run has touched.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn gaps(&mut self) -> Result<Vec<Gap>, Error> {
        self.with(|stand| {
            let session = &*stand.session;
            let gap = |kind, place, detail| Gap { kind, place, detail };
            let hex = |address: u64| format!("{address:#010x}");
            let mut gaps = Vec::new();
            for entry in session.unmapped() {
                gaps.push(gap("unmapped", hex(entry.address), format!("from {:#010x}", entry.program_counter)));
            }
            for (address, fault) in session.refused() {
                gaps.push(gap("refused", hex(*address), format!("{fault:?}")));
            }
            for entry in session.unimplemented().values() {
                let place = format!("{} {}", entry.instance, entry.register);
                gaps.push(gap("unimplemented", place, format!("{} reads, {} writes", entry.reads, entry.writes)));
            }
            for (instance, number) in session.unrouted() {
                gaps.push(gap("unrouted", format!("{instance} {number}"), String::new()));
            }
            for told in session.told() {
                gaps.push(gap("told", format!("{} {}", told.instance, told.register), told.reason.to_owned()));
            }
            if let Some(value) = stand.bench.clock.wrong_pll {
                gaps.push(gap("refused", "RCC PLLCFGR".into(), format!("divider Q or R below 2: {value:#010x}")));
            }
            gaps
        })
    }

    /// That every gap touched so far is on the allow-list.
    ///
    /// # Errors
    /// Names those that are not.
    pub fn check_gaps(&mut self) -> Result<(), Error> {
        let unknown: Vec<String> = self
            .gaps()?
            .iter()
            .filter(|gap| gap.reason().is_none())
            .map(|gap| format!("  {} {} ({})", gap.kind, gap.place, gap.detail))
            .collect();
        if unknown.is_empty() { Ok(()) } else { Err(Error::Gaps(unknown.join("\n"))) }
    }
}
