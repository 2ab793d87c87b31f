//! The model in arbitrary precision, by the `dashu-float` crate: the judge of what has no exact form.
//!
//! Formulas are the textbook ones, not those of the core: with 96 bits nothing cancels that matters.

use super::exact::Progress;
use super::random::{Point, SEED, at, mm, newtons};
use super::tally::{Judged, Tally, parallel};
use dashu_float::round::mode::HalfEven;
use dashu_float::{DBig, FBig};
use fastrand::Rng;
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres};
use paper::units::{Radians, Ratio};
use paper::{Displacement, PERIODS_MAX, Relaxation, RelaxationState, RelaxationTerm};
use std::collections::HashMap;
use std::error::Error;
use std::ops::Range;
use std::path::Path;
use std::sync::LazyLock;

/// A number with [`PRECISION`] significant bits.
pub type Real = FBig<HalfEven, 2>;

/// Significant bits; the results judged have at most 31.
pub const PRECISION: usize = 96;

static PI: LazyLock<Real> = LazyLock::new(|| Real::pi(PRECISION));
static PI_OVER_1000: LazyLock<Real> = LazyLock::new(|| &*PI / real(1000, 0));

/// Steps of the table of arc tangents from 0 to 1.
const ATAN_STEPS: i32 = 1 << 10;
static ATANS: LazyLock<Vec<Real>> = LazyLock::new(|| (0..=ATAN_STEPS).map(|step| real(step, 10).atan()).collect());

/// The arc tangent of a number that is not negative.
///
/// The crate's own takes 50 times as long, so it makes a table once: `atan x = atan t + atan((x - t)/(1 + x t))`, where the
/// second is below 2^-11 and its series ends at 2^-120.
pub fn atan(x: &Real) -> Real {
    let one = real(1, 0);
    if *x > one {
        return &*PI / real(2, 0) - atan(&(one / x));
    }
    let step = (x.to_f64().value() * f64::from(ATAN_STEPS)).round() as i32;
    let t = real(step, 10);
    let rest = (x - &t) / (&one + x * &t);
    let square = &rest * &rest;
    let series = [9, 7, 5, 3, 1].into_iter().fold(real(0, 0), |sum, n| &one / real(n, 0) - &square * sum);
    &ATANS[step as usize] + rest * series
}

/// The value of a fixed-point number.
pub fn real(bits: i32, fraction_bits: isize) -> Real {
    Real::from_parts(bits.into(), -fraction_bits).with_precision(PRECISION).value()
}

/// A result less its exact value, in units of the result's last place.
pub fn error_ulp(bits: i32, fraction_bits: isize, exact: &Real) -> f64 {
    let difference = real(bits, fraction_bits) - exact;
    difference.to_f64().value() * 2_f64.powi(fraction_bits as i32)
}

pub struct Reference {
    /// Its radius, mm.
    a: Real,
    /// Its modulus, kPa.
    y_kpa: Real,
    /// pi times its modulus, N/mm^2.
    pi_y: Real,
    one: Real,
}

impl Reference {
    pub fn new(tip: &Tip) -> Self {
        let y_kpa = real(tip.modulus().to_bits(), 16);
        Self { a: real(tip.radius().to_bits(), 24), pi_y: &*PI_OVER_1000 * &y_kpa, y_kpa, one: real(1, 0) }
    }

    /// `F = pi Y d^2` (eq. 14).
    pub fn force(&self, d: &Real) -> Real {
        &self.pi_y * d * d
    }

    /// `d = sqrt(F / (pi Y))`.
    pub fn indentation(&self, force: &Real) -> Real {
        (force / &self.pi_y).sqrt()
    }

    /// `r_c = sqrt(a^2 - (a - d)^2)` (eq. 5, 6).
    pub fn contact_radius(&self, d: &Real) -> Real {
        let rest = &self.a - d;
        (&self.a * &self.a - &rest * &rest).sqrt()
    }

    /// `k = 2 pi Y d`.
    pub fn stiffness(&self, d: &Real) -> Real {
        (&self.pi_y * d) << 1
    }

    /// `p = Y (L - (a - d)) / L` in kPa, 0 from the rim on (eq. 13, 15, 16).
    pub fn pressure(&self, r: &Real, d: &Real) -> Real {
        self.strain(r, d) * &self.y_kpa
    }

    /// `dL/L`, 0 from the rim on (eq. 10).
    pub fn strain(&self, r: &Real, d: &Real) -> Real {
        if r >= &self.a {
            return real(0, 0);
        }
        let length = (&self.a * &self.a - r * r).sqrt();
        let compression = &length - (&self.a - d);
        if compression > real(0, 0) { compression / length } else { real(0, 0) }
    }

    /// `theta_max = atan(r_c / (a - d))` (eq. 5).
    pub fn touching_angle_max(&self, d: &Real) -> Real {
        atan(&(self.contact_radius(d) / (&self.a - d)))
    }

    /// `theta = atan(r / (a - d))` (eq. 6).
    pub fn touching_angle(&self, r: &Real, d: &Real) -> Real {
        atan(&(r / (&self.a - d)))
    }

    /// `r = (a - d) tan(theta)`, `dr/dtheta = (a - d) / cos^2(theta)` and their product (eq. 6 to 8).
    pub fn at_angle(&self, theta: &Real, d: &Real) -> [Real; 3] {
        let (sine, cosine) = theta.sin_cos();
        let scaled = (&self.a - d) / &cosine;
        let (distance, slope) = (&scaled * sine, scaled / cosine);
        let area = &distance * &slope;
        [distance, slope, area]
    }

    /// Normal force, tangential force, moment and energy at a displacement.
    pub fn load(&self, d: &Real, s: &Real, t: &Real) -> [Real; 4] {
        let (sine, cosine) = t.sin_cos();
        let tangent = sine / &cosine;
        let stretch = &self.one / (&cosine * &cosine);
        let pi_y = &self.pi_y;
        let (two, three) = (real(2, 0), real(3, 0));
        [
            pi_y * (d * d * &stretch + &two * d * s * &tangent + s * s),
            pi_y * (d * d * &tangent + &two * d * s),
            pi_y * (&two * d * d * d * &tangent * &stretch / &three + d * d * s * &stretch),
            pi_y * (d * d * d * &stretch / &three + d * d * s * &tangent + d * s * s),
        ]
    }

    /// `m_max / (mu N r_c)` for this pressure profile.
    pub fn friction_shape(&self, d: &Real) -> Real {
        let c = (&self.a - d) / &self.a;
        let s = self.contact_radius(d) / &self.a;
        let angle = self.touching_angle_max(d);
        let two = real(2, 0);
        let bracket = &s * &s * &s / real(3, 0) - &c * (angle - &s * &c) / &two;
        let versine = &self.one - &c;
        two * bracket / (&versine * &versine * s)
    }
}

// The points computed elsewhere: `oracle/park2003.csv`, 25 digits each.

pub fn path() -> std::path::PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/oracle/park2003.csv")
}

/// Every point of the oracle.
pub fn check() -> Result<[Tally; 5], Box<dyn Error>> {
    let mut tallies = [
        Tally::new("r_c(d)", 0.501),
        Tally::new("theta_max(d)", 1.0),
        Tally::new("p(r, d)", 0.501),
        Tally::new("F(d)", 0.501),
        Tally::new("k(d)", 0.501),
    ];
    for record in csv::Reader::from_path(path())?.deserialize::<HashMap<String, String>>() {
        let record = record?;
        let read = |name: &str| parse(record.get(name).ok_or_else(|| format!("no column {name}"))?);
        let a = fixed(&read("a_mm")?, 24);
        let y = fixed(&read("Y_kPa")?, 16);
        let (d, r) = (fixed(&read("d_mm")?, 24), fixed(&read("r_mm")?, 24));
        let tip = Tip::new(Millimetres::from_bits(a), Kilopascals::from_bits(y))?;
        let results = [
            (tip.contact_radius(mm(d)).to_bits(), 24, "rc_mm"),
            (paper::touching_angle_max(&tip, mm(d)).to_bits(), 24, "theta_max_rad"),
            (tip.pressure(mm(r), mm(d)).to_bits(), 16, "p_kPa"),
            (tip.force(mm(d)).to_bits(), 16, "F_N"),
            (tip.stiffness(mm(d)).to_bits(), 16, "k_N_per_mm"),
        ];
        for (tally, (bits, fraction_bits, column)) in tallies.iter_mut().zip(results) {
            let error = error_ulp(bits, fraction_bits, &read(column)?);
            tally.add(Judged::by_error(error, tally.bound_ulp), [a.into(), y.into(), d.into(), r.into()]);
        }
    }
    Ok(tallies)
}

fn parse(text: &str) -> Result<Real, Box<dyn Error>> {
    let decimal: DBig = text.parse()?;
    Ok(decimal.with_precision(40).value().with_base_and_precision::<2>(PRECISION).value().with_rounding())
}

/// The nearest fixed-point number.
fn fixed(value: &Real, fraction_bits: i32) -> i32 {
    (value * real(1 << (fraction_bits / 2), 0) * real(1 << (fraction_bits - fraction_bits / 2), 0))
        .to_f64()
        .value()
        .round() as i32
}

// The rest of the model: angles, columns, tilt, friction, relaxation; random points in arbitrary precision.

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
