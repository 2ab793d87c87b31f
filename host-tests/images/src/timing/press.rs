//! What a calibration's press is worked out to, piece by piece.

use super::Bench;
use fingertip::calibrate::parts::{Equations, Line, Pose, Readings, STEPS, Series, Sums, add_part};
use fingertip::shipped::{COLUMNS, Proposal, ROWS};

/// What a press left, as it is evaluated.
pub struct Press {
    readings: Readings<ROWS, COLUMNS>,
    travel: [Option<i64>; STEPS],
    reading: Series,
    expected: Series,
    pose: Pose,
    equations: Equations,
    proposal: Proposal,
}

impl Press {
    /// A taxel a third of the radius off the axis, in Q30.
    const PLACE: [i64; 2] = [1 << 28, 1 << 28];
    const PITCH: i64 = (1 << 30) * 15 / 100;
    const STEP: i64 = 12_500_000;

    /// A press of made up readings.
    pub fn new() -> Self {
        let mut travel = [None; STEPS];
        let mut reading = [0; STEPS];
        for (step, (x, u)) in (1..).zip(travel.iter_mut().zip(&mut reading)) {
            (*x, *u) = (Some(step * Self::STEP), (step * Self::STEP - (1 << 26)).max(0));
        }
        let (readings, proposal) = (Readings::NONE, Proposal::NONE);
        let (pose, equations) = (Pose::default(), Equations::NONE);
        Self { readings, travel, reading, expected: [0; STEPS], pose, equations, proposal }
    }
}

pub extern "C" fn gather(bench: &mut Bench) {
    bench.press.readings.take(1 << 24, 3 << 24, &bench.picture);
}

pub extern "C" fn find_pose(bench: &mut Bench) {
    let Press { pose, travel, reading, equations, .. } = &mut *bench.press;
    let Some(zero) = pose.zero(Press::PLACE, Press::PITCH) else { return };
    if let Some(line) = Line::of(&zero, travel, reading) {
        equations.take(&zero, &line);
    }
}

pub extern "C" fn expect(bench: &mut Bench) {
    let Press { pose, travel, expected, .. } = &mut *bench.press;
    *expected = [0; STEPS];
    add_part(expected, pose, Press::PLACE, Press::PITCH, 1, travel, Press::STEP);
}

pub extern "C" fn propose(bench: &mut Bench) {
    let Press { travel, reading, expected, proposal, .. } = &mut *bench.press;
    let sums = Sums::of(reading, expected, travel);
    proposal.set(44, &sums, 16_384, bench.config);
}
