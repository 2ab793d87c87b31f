//! The table of saves in `docs/firmware.md`, from the bytes of a record.

use crate::page::Page;
use fingertip::shipped::Record;
use fingertip::store::words;

/// The page with the table.
pub const PAGE: Page = Page { name: "docs/firmware.md", tables: "saves", command: "cargo xtask docs" };
/// Size of flash sectors 6 and 7, bytes (RM0390 table 4).
const SECTOR_BYTES: usize = 128 * 1024;
/// Time in which the flash programs a word, us: typical, and longest (DS10693, flash memory programming, x32).
const WORD_US: [usize; 2] = [16, 100];

/// The table: a record without gains, and one with them.
pub fn table() -> String {
    let mut gains = Record::DEFAULT;
    gains.gains.set(0, 1 + gains.gains.get(0));
    let mut text =
        "| record | words to program | time, typical | time, longest | bytes of the sector | records in a sector |\n\
        | --- | --- | --- | --- | --- | --- |\n"
            .to_owned();
    for (name, record) in [("without gains", Record::DEFAULT), ("with gains", gains)] {
        let slot: Vec<u32> = words(&record, 1).collect();
        // Blank words up to the next record are not programmed.
        let count = slot.iter().rposition(|word| *word != u32::MAX).map_or(0, |last| last + 1);
        let [typical_ms, longest_ms] = WORD_US.map(|us| (count * us) as f64 / 1e3);
        let bytes = 4 * slot.len();
        text += &format!(
            "| {name} | {count} | {typical_ms:.1} ms | {longest_ms:.1} ms | {bytes} | {} |\n",
            SECTOR_BYTES / bytes
        );
    }
    text
}
