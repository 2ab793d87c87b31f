//! Every representable input of a tip, judged by integers.

use super::exact;
use super::random::{at, boundary_distances, in_reach, mm, newtons};
use super::tally::{Judged, Tally, parallel};
use fingertip::model::Tip;
use fingertip::units::Kilopascals;
use std::ops::Range;

/// Told how much of how much is done.
pub type Progress<'a> = &'a (dyn Fn(u64, u64) + Sync);

const CHUNK: u64 = 1 << 16;

/// Every depth from one unit to the deepest: force, radius, stiffness, peak and mean pressure; that the force never
/// falls and never jumps; and the inverse from the force.
pub fn depths(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 7] {
    let round_trip_max = (tip.indentation(newtons(1)).to_bits() + 1).into();
    let tallies = [
        Tally::new("F(d)", 0.5),
        Tally::new("r_c(d)", 0.5),
        Tally::new("k(d)", 0.5),
        Tally::new("p(0)", 0.5),
        Tally::new("mean p", 0.5),
        Tally::new("F(d + 1 ulp) - F(d)", 1.0),
        Tally::new("d(F(d)) - d", round_trip_max),
    ];
    // Four times half a unit of force as a squared length, in Q48, rounded up: what F(d) may have lost.
    let four_lost = round_trip_slack(tip);
    parallel(range, CHUNK, tallies, progress, |range, [force, radius, stiffness, peak, mean, step, back]| {
        let results = |d: i32| (tip.force(mm(d)), tip.stiffness(mm(d)));
        let mut next = results(range.start as i32);
        let mut inverse = (next.0, tip.indentation(next.0));
        for d in range.map(|d| d as i32) {
            let at = at(tip, d, 0);
            let (f, k) = next;
            next = results(d + 1);
            force.add(exact::force(tip, d, f.to_bits(), 1), at);
            radius.add(exact::contact_radius(tip, d, tip.contact_radius(mm(d)).to_bits(), 1), at);
            stiffness.add(exact::stiffness(tip, d, k.to_bits(), 1), at);
            peak.add(exact::peak_pressure(tip, d, tip.peak_pressure(mm(d)).to_bits(), 1), at);
            mean.add(exact::mean_pressure(tip, d, tip.mean_pressure(mm(d)).to_bits(), 1), at);
            let rise = next.0.to_bits() - f.to_bits();
            // The slope at the larger depth, in units of force for a unit of depth.
            let slope_ulp = f64::from(next.1.to_bits() + 1) / f64::from(1 << 24);
            let within = rise >= 0 && f64::from(rise) <= 1.0 + slope_ulp;
            step.add(Judged { error_ulp: rise.into(), nearest: None, within }, at);
            // Some thirty depths have the same force.
            if f != inverse.0 {
                inverse = (f, tip.indentation(f));
            }
            back.add(round_trip(d.into(), inverse.1.to_bits().into(), four_lost), at);
        }
    })
}

/// Every force up to that of the deepest indentation: indentation and stiffness; and that a unit of force never moves
/// the indentation back, nor by more than the first unit does.
pub fn forces(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 3] {
    let first = tip.indentation(newtons(1)).to_bits();
    let tallies = [Tally::new("d(F)", 0.5), Tally::new("k(F)", 0.5), Tally::new("d(F + 1 ulp) - d(F)", first.into())];
    parallel(range, CHUNK, tallies, progress, |range, [indentation, stiffness, step]| {
        let mut next = tip.indentation(newtons(range.start as i32)).to_bits();
        for f in range.map(|f| f as i32) {
            let (at, d) = (at(tip, f, 0), next);
            next = tip.indentation(newtons(f + 1)).to_bits();
            if !in_reach(tip, f) {
                continue;
            }
            indentation.add(exact::indentation(tip, f, d, 1), at);
            let k = tip.stiffness_at_force(newtons(f)).to_bits();
            stiffness.add(exact::stiffness_at_force(tip, f, k, 1), at);
            let rise = next - d;
            step.add(Judged { error_ulp: rise.into(), nearest: None, within: (0..=first).contains(&rise) }, at);
        }
    })
}

/// Every contact radius up to that of the deepest indentation.
pub fn radii(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 1] {
    parallel(range, CHUNK, [Tally::new("d(r_c)", 0.5)], progress, |range, [indentation]| {
        for radius in range.map(|radius| radius as i32).filter(|&radius| exact::radius_in_reach(tip, radius)) {
            let d = tip.indentation_from_radius(mm(radius)).to_bits();
            indentation.add(exact::indentation_from_radius(tip, radius, d, 1), at(tip, radius, 0));
        }
    })
}

/// Every peak pressure up to that of the deepest indentation.
pub fn peaks(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 1] {
    parallel(range, CHUNK, [Tally::new("d(p(0))", 0.5)], progress, |range, [indentation]| {
        for peak in range.map(|peak| peak as i32) {
            let d = tip.indentation_from_peak(Kilopascals::from_bits(peak)).to_bits();
            indentation.add(exact::indentation_from_peak(tip, peak, d, 1), at(tip, peak, 0));
        }
    })
}

/// A grid of `depths` by `distances` from the centre to past the rim, denser at small depths and towards the rim: the
/// pressure, and that it never rises with the distance.
pub fn pressures(tip: &Tip, depths: u64, distances: u64, progress: Progress<'_>) -> [Tally; 2] {
    let tallies = [Tally::new("p(r, d)", 0.5), Tally::new("p(r) rise with r", 0.0)];
    parallel(1..depths + 1, 16, tallies, progress, |range, [pressure, rise]| {
        for step in range {
            let share = step as f64 / depths as f64;
            let d = ((share * share * f64::from(tip.depth_max().to_bits())) as i32).max(1);
            let rim = f64::from(tip.contact_radius(mm(d)).to_bits());
            let mut before = i32::MAX;
            let grid = (0..distances).map(|place| {
                let from_rim = 1.0 - place as f64 / (distances - 1) as f64;
                ((1.01 - from_rim * from_rim * 1.01) * rim) as i32
            });
            let mut places: Vec<i32> = grid.chain(boundary_distances(tip, d)).collect();
            places.sort_unstable();
            for r in places {
                let p = tip.pressure(mm(r), mm(d)).to_bits();
                let at = at(tip, d, r);
                // Past the radius a every distance is the same.
                pressure.add(exact::pressure(tip, r.min(tip.radius().to_bits()), d, p, 2), at);
                let error_ulp = f64::from((p - before).max(0));
                rise.add(Judged { error_ulp, nearest: None, within: p <= before }, at);
                before = p;
            }
        }
    })
}

fn round_trip_slack(tip: &Tip) -> i128 {
    // 1 ulp of F is d^2 = 2^-16 N / (pi Y); by the exact indentation at one unit, rounded up.
    let first = i128::from(tip.indentation(newtons(1)).to_bits()) + 1;
    2 * first * first
}

/// `|d' - d|` is at most what half a unit of force is worth at `d`, and half a unit of depth.
fn round_trip(d: i64, again: i64, four_lost: i128) -> Judged {
    let (d, again) = (i128::from(d), i128::from(again));
    let above = again == 0 || (2 * again - 1).pow(2) <= 4 * d * d + four_lost;
    let below = (2 * again + 1).pow(2) >= 4 * d * d - four_lost;
    Judged { error_ulp: (again - d) as f64, nearest: None, within: above && below }
}
