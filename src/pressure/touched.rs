//! Whether something touched the tip during a tare.
//!
//! A contact is a patch: some taxels side by side that carry more than the rest. What taxels differ by without one, gains, preload and
//! amplifiers, is each taxel's own, so it averages out over a block of three by three, where a contact adds up. The block is held
//! against the row that carries least, because a contact that reaches all rows would be far above any of these limits anyway.
//!
//! Against a clean tare before, the block must carry more than that did by what begins a contact. Without one only the shape
//! is known, and preload may lie unevenly: then the block must carry half as much again as the rest, too.

use super::picture::force;
use super::{Array, CODE_BITS, TARE_BITS};
use crate::config::Config;
use crate::frame::{COLUMNS, ROWS};

/// Taxels along a block's side.
const SIDE: usize = 3;
/// A row tells what a taxel usually carries where at least so many of its taxels are good.
const ROW_LEAST: i32 = 5;

/// Whole corrected codes, taxel by taxel; none where the taxel is masked, dead or saturated.
type Codes = [[Option<i16>; COLUMNS]; ROWS];

/// What a tare says of a contact.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Touched {
    /// Something touched during the last tare.
    pub flag: bool,
    /// The last tare without a contact.
    clean: Option<Codes>,
}

impl Touched {
    /// Nothing known.
    pub const NONE: Self = Self { flag: false, clean: None };
}

impl Array {
    /// Whether something seems to have touched the tip during the last tare that was judged.
    pub fn tared_touching(&self) -> bool {
        self.touched.flag
    }

    /// Judges the tare that was just completed.
    #[cold]
    #[inline(never)]
    pub fn judge_tare(&mut self, config: &Config) {
        let now = self.tare_codes();
        let flag = match &self.touched.clean {
            Some(clean) => {
                let mut more = now;
                for (more, clean) in more.iter_mut().flatten().zip(clean.iter().flatten()) {
                    *more = more.zip(*clean).map(|(now, clean)| now.saturating_sub(clean));
                }
                patch(&more, 0, config)
            }
            None => patch(&now, 1, config),
        };
        self.touched.flag = flag;
        if !flag {
            self.touched.clean = Some(now);
        }
    }

    fn tare_codes(&self) -> Codes {
        let mut codes = [[None; COLUMNS]; ROWS];
        for ((codes, tares), bad) in codes.iter_mut().zip(self.rows.iter().map(|row| &row.tare)).zip(self.picture.bad) {
            for (column, (code, tare)) in codes.iter_mut().zip(tares).enumerate() {
                *code = (bad >> column & 1 == 0).then_some((tare >> TARE_BITS) as i16);
            }
        }
        codes
    }
}

/// Whether a block carries more than the rest, by what begins a contact and by this many halves of the rest.
fn patch(codes: &Codes, halves: i32, config: &Config) -> bool {
    let rest = codes.iter().filter_map(mean).min().unwrap_or(0);
    let (mut most, mut above) = (0, [[0; COLUMNS - SIDE + 1]; SIDE - 1]);
    for row in codes {
        let carried = row.map(|code| code.map_or(0, |code| i32::from(code) - rest));
        let mut sums = [0; COLUMNS - SIDE + 1];
        for (sum, side_by_side) in sums.iter_mut().zip(carried.windows(SIDE)) {
            *sum = side_by_side.iter().sum();
        }
        for ((first, second), third) in above[0].iter().zip(&above[1]).zip(&sums) {
            most = most.max(first + second + third);
        }
        above = [above[1], sums];
    }
    force(most << CODE_BITS, config) >= config.contact_on && 2 * most >= halves * rest * (SIDE * SIDE) as i32
}

/// The mean of a row's good taxels, where there are enough of them.
fn mean(row: &[Option<i16>; COLUMNS]) -> Option<i32> {
    let (sum, count) = row.iter().flatten().fold((0, 0), |(sum, count), code| (sum + i32::from(*code), count + 1));
    (count >= ROW_LEAST).then(|| sum / count.max(1))
}
