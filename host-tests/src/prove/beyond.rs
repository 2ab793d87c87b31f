//! The rest of the model: angles, columns, tilt, friction, relaxation; random points in arbitrary precision.

use super::exhaustive::Progress;
use super::random::{Point, SEED, at, mm, newtons};
use super::reference::{Real, Reference, error_ulp, real};
use super::tally::{Judged, Tally, parallel};
use fastrand::Rng;
use paper::units::{Radians, Ratio};
use paper::{Displacement, PERIODS_MAX, Relaxation, RelaxationState, RelaxationTerm};
use std::ops::Range;

const CHUNK: u64 = 1_000;

/// Geometry by the touching angle (eq. 2 to 8), strain and the correctly rounded lengths.
pub fn geometry(range: Range<u64>, progress: Progress<'_>) -> [Tally; 6] {
    let tallies = [
        Tally::new("theta(r)", 1.0),
        Tally::new("strain", 1.0),
        Tally::new("r(theta)", 1.0),
        Tally::new("dr/dtheta", 1.0),
        Tally::new("dS", 1.0),
        Tally::new("L(r)", 0.5),
    ];
    parallel(range, CHUNK, tallies, progress, |range, [angle, strain, distance, slope, area, length]| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for _ in range {
            let Point { tip, d, r, .. } = Point::random(&mut rng);
            let (reference, exact_d) = (Reference::new(&tip), real(d, 24));
            let inside = r.min(tip.contact_radius(mm(d)).to_bits());
            let theta_bits = paper::touching_angle(&tip, mm(inside), mm(d)).to_bits();
            let exact = reference.touching_angle(&real(inside, 24), &exact_d);
            judge(angle, theta_bits, 24, &exact, at(&tip, d, inside));
            let exact = reference.strain(&real(r, 24), &exact_d);
            judge(strain, tip.strain(mm(r), mm(d)).to_bits(), 30, &exact, at(&tip, d, r));
            let theta = rng.i32(0..=paper::touching_angle_max(&tip, mm(d)).to_bits());
            let [exact_distance, exact_slope, exact_area] = reference.at_angle(&real(theta, 24), &exact_d);
            let (at, theta) = (at(&tip, d, theta), Radians::from_bits(theta));
            judge(distance, paper::distance_at(&tip, theta, mm(d)).to_bits(), 24, &exact_distance, at);
            judge(slope, paper::distance_slope(&tip, theta, mm(d)).to_bits(), 16, &exact_slope, at);
            judge(area, paper::area_density(&tip, theta, mm(d)).to_bits(), 16, &exact_area, at);
            let exact_length =
                super::exact::particle_length(&tip, inside, tip.particle_length(mm(inside)).to_bits(), 1);
            length.add(Judged { within: exact_length.nearest == Some(true), ..exact_length }, at);
        }
    })
}

/// Tilt and shift: normal force, tangential force, moment and energy.
pub fn tilt(range: Range<u64>, progress: Progress<'_>) -> [Tally; 4] {
    let tallies = [Tally::new("F_n", 1.0), Tally::new("F_t", 1.0), Tally::new("M", 1.0), Tally::new("energy", 1.0)];
    parallel(range, CHUNK, tallies, progress, |range, [normal, tangential, moment, energy]| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for _ in range {
            let Point { tip, d, .. } = Point::random(&mut rng);
            let reach = tip.radius().to_bits() / 2;
            let shift = rng.i32(-reach..=reach);
            let angle = rng.i32(-(1 << 24)..=1 << 24);
            let displacement = Displacement { normal: mm(d), shift: mm(shift), tilt: Radians::from_bits(angle) };
            let load = paper::load(&tip, displacement);
            let exact = Reference::new(&tip).load(&real(d, 24), &real(shift, 24), &real(angle, 24));
            let at = [tip.modulus().to_bits().into(), d.into(), shift.into(), angle.into()];
            judge(normal, load.normal.to_bits(), 16, &exact[0], at);
            judge(tangential, load.tangential.to_bits(), 16, &exact[1], at);
            judge(moment, load.moment.to_bits(), 14, &exact[2], at);
            judge(energy, paper::energy(&tip, displacement).to_bits(), 14, &exact[3], at);
        }
    })
}

/// The limit surface of friction: its shape factor, force and moment.
pub fn friction(range: Range<u64>, progress: Progress<'_>) -> [Tally; 3] {
    let tallies = [Tally::new("friction shape g", 1.0), Tally::new("mu N", 1.0), Tally::new("m_max", 1.0)];
    parallel(range, CHUNK, tallies, progress, |range, [shape, force, moment]| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for _ in range {
            let Point { tip, d, .. } = Point::random(&mut rng);
            // Below this the reference's own formula cancels beyond its precision.
            let d = d.max(1 << 12);
            let mu = rng.i32(0..=4 << 16);
            let reference = Reference::new(&tip);
            let exact_d = real(d, 24);
            let (exact_shape, exact_mu) = (reference.friction_shape(&exact_d), real(mu, 16));
            let limit = paper::limit_surface(&tip, mm(d), Ratio::from_bits(mu));
            let at = at(&tip, d, mu);
            let exact_force = reference.force(&exact_d) * exact_mu;
            let exact_moment = &exact_force * reference.contact_radius(&exact_d) * &exact_shape;
            judge(shape, paper::friction_shape(&tip, mm(d)).to_bits(), 16, &exact_shape, at);
            judge(force, limit.force.to_bits(), 16, &exact_force, at);
            judge(moment, limit.moment.to_bits(), 14, &exact_moment, at);
        }
    })
}

/// Runs of 1000 steps of the relaxation filter from rest, with random terms and random or extreme elastic forces.
pub fn relaxation(runs: Range<u64>, progress: Progress<'_>) -> [Tally; 1] {
    parallel(runs, 1, [Tally::new("relaxed force", 1.0)], progress, |range, [tally]| {
        for run in range {
            relaxation_run(&mut Rng::with_seed(SEED ^ run), run, tally);
        }
    })
}

fn relaxation_run(rng: &mut Rng, run: u64, tally: &mut Tally) {
    let period_us = rng.u32(10..=2_000);
    let terms = [(); 3].map(|()| RelaxationTerm {
        share: Ratio::from_bits(rng.i32(0..=65_536 / 3)),
        time_constant_us: period_us.saturating_mul(1 << rng.u32(0..=PERIODS_MAX.ilog2())),
    });
    let filter = Relaxation::new(period_us, &terms).expect("inside the domain");
    let one = real(1, 0);
    // Straight between samples: m' = m E + F (A - B) + F' B with E = exp(-x), A = 1 - E and B = 1 - A/x.
    let coefficients = terms.map(|term| {
        let x = real(period_us as i32, 0) / real_u32(term.time_constant_us);
        let decay = (-&x).exp();
        let lead = &one - (&one - &decay) / &x;
        (decay, lead)
    });
    let mut memories = [(); 3].map(|()| real(0, 0));
    let (mut state, mut before) = (RelaxationState::REST, 0);
    for step in 0..1_000_i64 {
        let now = match run % 3 {
            0 => rng.i32(0..=i32::MAX),
            1 => (before + rng.i32(-1_000..=1_500)).max(0),
            _ => {
                if step % 2 == 0 {
                    i32::MAX
                } else {
                    0
                }
            }
        };
        let relaxed = filter.step(&mut state, newtons(now)).to_bits();
        let mut exact = real(now, 16);
        for ((memory, (decay, lead)), term) in memories.iter_mut().zip(&coefficients).zip(&terms) {
            let follow = &one - decay;
            *memory = &*memory * decay + real(before, 16) * (&follow - lead) + real(now, 16) * lead;
            exact -= &*memory * real(term.share.to_bits(), 16);
        }
        before = now;
        judge(tally, relaxed, 16, &exact, [run as i64, step, now.into(), 0]);
    }
}

fn judge(tally: &mut Tally, bits: i32, fraction_bits: isize, exact: &Real, at: [i64; 4]) {
    tally.add(Judged::by_error(error_ulp(bits, fraction_bits, exact), tally.bound_ulp), at);
}

fn real_u32(number: u32) -> Real {
    real((number >> 1) as i32, -1) + real((number & 1) as i32, 0)
}

/// End state of a filter after repeating inputs.
#[derive(Clone, Copy, Debug)]
pub struct LongRun {
    /// Steps until its state came back to one it had had: from there on everything repeats, however long it runs.
    pub steps: u64,
    /// The least output in the repeating part, N.
    pub low: f64,
    /// The largest output in the repeating part, N.
    pub high: f64,
}

/// Feeds the relaxation filter a repeating pattern until its state repeats, with time constants from one period to the
/// longest of `periods_max`.
///
/// # Panics
/// The state does not repeat within 10^9 steps.
pub fn long_run(pattern: &[i32], periods_max: u32) -> LongRun {
    let share = Ratio::from_bits(65_536 / 3);
    let terms =
        [1, periods_max.isqrt(), periods_max].map(|periods| RelaxationTerm { share, time_constant_us: 100 * periods });
    let filter = Relaxation::new(100, &terms).expect("inside the domain");
    let mut state = RelaxationState::REST;
    let mut steps = 0;
    while steps < 1_000_000_000 {
        let before = state;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &elastic in pattern {
            let relaxed = f64::from(filter.step(&mut state, newtons(elastic)).to_bits()) / 65_536.0;
            (low, high) = (low.min(relaxed), high.max(relaxed));
            steps += 1;
        }
        if state == before {
            return LongRun { steps, low, high };
        }
    }
    panic!("no repetition in {steps} steps");
}
