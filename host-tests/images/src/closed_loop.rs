//! The closed loop of the crate's example in integers, so that it is the same on every core: a finger touches a plate
//! and holds a force.
//!
//! The smallest array fits a microcontroller with 16 KB of RAM.

use crate::record::Digest;
use fingertip::arith::floor_sqrt;
use fingertip::command::Command;
use fingertip::config::{Shaped, newtons};
use fingertip::frame::{Frame, Sense};
use fingertip::params::Params;
use fingertip::pipeline::{Pipeline, Taring};
use fingertip::shipped::CLOCKS;
use fingertip::units::{Duty, Millimetres};

/// Frames of a run.
pub const FRAMES: u32 = 10_000;
/// Distance from the tip to the plate.
const PLATE_MM: i64 = 1;
/// Travel per millimetre. A speed in nm/s, kept for 100 us, is a travel in this unit.
const TRAVEL_PER_MM: i64 = 10_000_000_000;

/// Results of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Digest of every duty and status.
    pub digest: u64,
    /// Contact force at the end as the finger reports it, mN.
    pub force_mn: i32,
    /// True contact force at the end, mN.
    pub true_mn: i32,
}

/// Runs the loop with taxels `pitch_um` apart. `step` makes each step of the pipeline.
pub fn run<const ROWS: usize, const COLUMNS: usize>(
    pitch_um: u32,
    mut step: impl FnMut(&mut Pipeline<ROWS, COLUMNS>, &Frame<ROWS, COLUMNS>, &Sense, &Command) -> Duty,
) -> Result<Ended, &'static str> {
    let params = Params { pitch_um: pitch_um.cast_signed(), ..crate::CONFIRMED };
    let config = Shaped::<ROWS, COLUMNS>::new(&params, &CLOCKS).map_err(|_| "the parameters are refused")?;
    let mut finger = Pipeline::new(&config);
    let mut digest = Digest::new();
    let mut command = Command { tare_request: 1, ..Command::default() };
    let (mut travel, mut speed_nm_per_s, mut depth) = (0_i64, 0_i64, Millimetres::ZERO);
    let frame_ns = i64::from(config.timing.frame_ns);
    for sequence in 1..=FRAMES {
        depth = depth_q24((travel - PLATE_MM * TRAVEL_PER_MM).max(0));
        let mut frame = Frame { sequence, ..Frame::EMPTY };
        for (slot, column) in (0..=ROWS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
            let mut code = 372;
            if slot < ROWS {
                let half_pitches = |place: usize, count: usize| (2 * place as i32 + 1 - count as i32).unsigned_abs();
                let [x, y] = [half_pitches(column, COLUMNS), half_pitches(slot, ROWS)].map(|n| u64::from(n * pitch_um));
                // Twice the distance in um, with 8 bits of fraction.
                let twice_um_q8 = floor_sqrt((x * x + y * y) << 16);
                let distance = Millimetres::from_bits((i64::from(twice_um_q8) * (1 << 15) / 1_000) as i32);
                let pressure = i64::from(config.tip.pressure(distance, depth).to_bits());
                code += 40 + ((24 * pressure) >> 16) as u16;
            }
            frame.set_code(slot, column, code);
        }
        let encoder = (travel / 10_960_105) as i32; // 912.4 counts per mm
        let sense = Sense { encoder, supply_mv: 6_500, ..Sense::default() };
        let duty = step(&mut finger, &frame, &sense, &command);
        digest.add(duty, finger.status());
        // The motor: 43 mm/s per volt, so 8,530 nm/s per unit of the duty; a time constant of 7 ms.
        speed_nm_per_s += (8_530 * i64::from(duty.0) - speed_nm_per_s) * frame_ns / 7_000_000;
        travel += speed_nm_per_s * frame_ns / 100_000;
        command.torque = finger.status().tare == Taring::Done;
        command.goal = newtons(1_000);
    }
    let [force_mn, true_mn] = [finger.status().contact.force, config.tip.force(depth)]
        .map(|force| ((i64::from(force.to_bits()) * 1_000) >> 16) as i32);
    Ok(Ended { digest: digest.value(), force_mn, true_mn })
}

/// A travel in millimetres.
fn depth_q24(travel: i64) -> Millimetres {
    Millimetres::from_bits(((travel << 16) / (TRAVEL_PER_MM >> 8)) as i32)
}

#[cfg(test)]
mod tests {
    use super::run;

    #[test]
    fn it_holds_the_goal() {
        let ended = run::<6, 4>(1_900, |finger, frame, sense, command| finger.step(frame, sense, command).0).unwrap();
        assert!((980..1_020).contains(&ended.force_mn), "{ended:?}");
        let spoilt = run::<6, 4>(1_900, |finger, frame, sense, command| {
            let mut frame = *frame;
            frame.set_code(0, 0, frame.code(0, 0) + u16::from(frame.sequence == 9_000));
            finger.step(&frame, sense, command).0
        });
        assert_ne!(spoilt, Ok(ended), "the digest sees one bit");
    }
}
