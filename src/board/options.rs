//! The option bytes, as the last reset loaded them.

use embassy_stm32::pac;

/// The code of level 3 in the register: it resets before the supply is below 2.7 V, the least for 168 MHz with five wait
/// states (docs/board.md, Option bytes).
const LEVEL_3: u8 = 0b00;

/// All of them.
pub fn loaded() -> u32 {
    pac::FLASH.optcr().read().0
}

/// Whether a supply that is too low for the core's speed resets it. From the factory it does not.
pub fn brown_out_resets() -> bool {
    pac::FLASH.optcr().read().bor_lev() == LEVEL_3
}
