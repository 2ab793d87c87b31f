//! A row in which a taxel may be dead or saturated.

use crate::frame::{BANK_COLUMNS, SATURATED};
use lanes::{Pairs, SIGNS};

/// What such a row shows.
#[derive(Default)]
pub(super) struct Suspect {
    /// A bit for each column that is dead or saturated.
    pub bad: u16,
    /// The bad taxels' net codes, zero where a taxel is sound.
    nets: Pairs,
}

impl Suspect {
    /// Looks at a row of any codes and levels.
    #[cold]
    #[inline(never)]
    pub fn look(&mut self, [codes, undriven]: [&Pairs; 2], dead_codes: u16) {
        let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
        let sound = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
        let mut bad = 0;
        for place in 0..BANK_COLUMNS {
            let net = lanes::sub(codes[place], undriven[place]);
            // The sign of each lane tells whether its taxel is bad; those of the first place are shifted most.
            let signs = (lanes::sub(net, dead) | lanes::sub(sound, codes[place])) & SIGNS;
            bad = bad >> 1 | signs;
            let bad_lanes = (signs << 1).wrapping_sub(signs >> 15);
            self.nets[place] = net & bad_lanes;
        }
        let first = bad >> (16 - BANK_COLUMNS) & ((1 << BANK_COLUMNS) - 1);
        let second = bad >> (32 - BANK_COLUMNS);
        self.bad = (first | second << BANK_COLUMNS) as u16;
    }

    /// The bad taxels' net codes times both weights.
    pub fn sums(&self, weights: &[Pairs; 2]) -> [i32; 2] {
        let [mut sum, mut moment] = [0; 2];
        for (place, net) in self.nets.iter().enumerate() {
            sum = lanes::dot(*net, weights[0][place], sum);
            moment = lanes::dot(*net, weights[1][place], moment);
        }
        [sum, moment]
    }
}
