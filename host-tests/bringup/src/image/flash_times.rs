//! Times of the flash, in a blank parameter sector that is erased again afterwards: stored parameters are kept.

use cortex_m::peripheral::DWT;
use embassy_stm32::Peri;
use embassy_stm32::peripherals::FLASH;
use fingertip::store::{Flash as _, Sector};

use crate::board::flash::Chip;
use crate::{CYCLES_PER_US, report};

const WORDS: usize = 64;
const ERASED: u8 = 0xff;

/// Programs some words and erases the sector.
pub fn run(flash: Peri<'static, FLASH>) {
    let mut chip = Chip::new(flash);
    let blank = |chip: &Chip, sector| chip.bytes(sector).iter().all(|byte| *byte == ERASED);
    let Some(sector) = [Sector::A, Sector::B].into_iter().find(|sector| blank(&chip, *sector)) else {
        return report::say(format_args!("no parameter sector is blank: the flash's times are left out"));
    };
    report::say(format_args!("flash: some words and an erase, 1 to 2 s"));
    let (mut most, mut sound) = (0, true);
    for place in 0..WORDS {
        let word = (place as u32).wrapping_mul(0x9E37_79B9);
        let taken = cycles(|| sound &= chip.program(sector, 4 * place, word).is_ok());
        most = most.max(taken);
        sound &= chip.bytes(sector).get(4 * place..4 * place + 4) == Some(&word.to_le_bytes()[..]);
    }
    let erase = cycles(|| sound &= chip.erase(sector).is_ok());
    sound &= blank(&chip, sector);
    report::figure("flash_word_us", most as f32 / CYCLES_PER_US as f32);
    report::figure("flash_erase_ms", erase as f32 / CYCLES_PER_US as f32 * 1e-3);
    report::figure("flash_reads_back", f32::from(u8::from(sound)));
}

fn cycles(work: impl FnOnce()) -> u32 {
    let since = DWT::cycle_count();
    work();
    DWT::cycle_count().wrapping_sub(since)
}
