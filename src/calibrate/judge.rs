//! Whether a press was one onto something hard and flat that stood still.

use super::Refusal;
use super::number::{BITS, ONE, div};
use super::pose::{Equations, Pose};
use super::series::{STEPS, Series};
use crate::config::Shaped;
use crate::frame::Shape;

/// Steps that a press must have: half a millimetre of a tip of 10.
pub const STEPS_LEAST: usize = 6;
/// Taxels whose lines must be seen to tell the pose.
const TAXELS_LEAST: u16 = 16;
/// What the lines' zeros may miss the pose by: 0.4 % of the radius.
const UNEVEN: i64 = ONE * 4 / 1_000;
/// How far the taxels' lines may be bent: a plate that yields by 0.04 mm/N under a tip of 250 kPa.
const BENT: i64 = ONE / 100;
/// How much rounder or flatter than the tip's radius says the gap between tip and plate may be.
const ROUND: i64 = ONE / 10;
/// A taxel that should read so much of Y is pressed,
const PRESSED: i64 = ONE / 40;
/// one that reads less than this of it is not,
const SILENT: i64 = ONE * 35 / 100;
/// and of sixteen that should be pressed more than one that is not stands beside the plate.
const BESIDE_PART: u16 = 16;

/// All taxels of a press together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Totals {
    /// Of the readings and of what was expected.
    sums: [i64; 2],
    /// Taxels that should read something, and those of them that read hardly any.
    pressed: [u16; 2],
    /// The highest expected pressure.
    pub highest: i64,
}

impl Totals {
    /// Of no taxel.
    pub const NONE: Self = Self { sums: [0; 2], pressed: [0; 2], highest: 0 };

    /// Takes a taxel, which reads a share of what it should.
    pub fn take(&mut self, reading: &Series, expected: &Series, travel: &[Option<i64>; STEPS], share: i64) {
        if expected.iter().any(|model| *model > PRESSED) {
            self.pressed[0] += 1;
            self.pressed[1] += u16::from(share < SILENT);
        }
        let steps = travel.iter().zip(reading.iter().zip(expected)).filter(|(travel, _)| travel.is_some());
        for (_, (u, model)) in steps {
            self.highest = self.highest.max(*model);
            self.sums[0] += *u >> 8;
            self.sums[1] += *model >> 8;
        }
    }
}

/// A ratio of sums of whatever size.
fn ratio(x: i64, y: i64) -> i64 {
    let drop = (64 - x.unsigned_abs().max(y.unsigned_abs()).max(1).leading_zeros()).saturating_sub(BITS + 1);
    div(x >> drop, y >> drop)
}

/// Why a press must not be taken.
pub fn refusal<const ROWS: usize, const COLUMNS: usize>(
    centre: [i64; 2],
    pose: &Pose,
    equations: &Equations,
    totals: &Totals,
    config: &Shaped<ROWS, COLUMNS>,
) -> Option<Refusal> {
    let pitch = i64::from(config.geometry.pitch) << 2;
    let beyond = |centre: i64, side: usize| centre.abs() > pitch * side as i64 * 3 / 8;
    // Of a contact that is cut off the sums' centre is too far in: the pose knows better, where there is one.
    let posed = [pose.axis[0] + pose.tilt[0], pose.axis[1] + pose.tilt[1]];
    let known = equations.taxels >= TAXELS_LEAST / 2;
    for [x, y] in [Some(centre), known.then_some(posed)].into_iter().flatten() {
        if beyond(x, COLUMNS) || beyond(y, ROWS) {
            return Some(Refusal::OffArray);
        }
    }
    if equations.taxels < TAXELS_LEAST.min(const { Shape::<ROWS, COLUMNS>::TAXELS as u16 / 2 }) {
        return Some(Refusal::TooLittle);
    }
    let (bend, leaning, misfit) = (equations.bend(), equations.leaning(), equations.misfit());
    if bend > leaning.max(BENT) {
        return Some(Refusal::Soft);
    }
    // Where nothing fits, lines are bent because they begin too early.
    if leaning > BENT && misfit < 2 * UNEVEN {
        return Some(Refusal::Moving);
    }
    let [pressed, silent] = totals.pressed;
    if silent > pressed / BESIDE_PART || misfit > UNEVEN || pose.roundness.abs() > ROUND {
        return Some(Refusal::NotFlat);
    }
    let whole = ratio(totals.sums[0], totals.sums[1]);
    if !(ONE / 2..2 * ONE).contains(&whole) {
        return Some(Refusal::Range);
    }
    None
}
