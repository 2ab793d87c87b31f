//! The model in arbitrary precision, by the `dashu-float` crate: the judge of what has no exact form.
//!
//! Formulas are the textbook ones, not those of the core: with 96 bits nothing cancels that matters.

use super::exact::Progress;
use super::random::{Point, SEED, at, mm};
use super::tally::{Judged, Tally, parallel};
use crate::paper;
use dashu_float::round::mode::HalfEven;
use dashu_float::{DBig, FBig};
use fastrand::Rng;
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres};
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
}

impl Reference {
    pub fn new(tip: &Tip) -> Self {
        let y_kpa = real(tip.modulus().to_bits(), 16);
        Self { a: real(tip.radius().to_bits(), 24), pi_y: &*PI_OVER_1000 * &y_kpa, y_kpa }
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
}

// The points computed elsewhere: `oracle/park2003.csv`, 25 digits each.

pub fn path() -> std::path::PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/oracle/park2003.csv")
}

/// Every point of the oracle.
pub fn check() -> Result<[Tally; 5], Box<dyn Error>> {
    let mut tallies = ["r_c(d)", "theta_max(d)", "p(r, d)", "F(d)", "k(d)"].map(|name| Tally::new(name, 0.501));
    for record in csv::Reader::from_path(path())?.deserialize::<HashMap<String, String>>() {
        let record = record?;
        let read = |name: &str| parse(record.get(name).ok_or_else(|| format!("no column {name}"))?);
        let a = fixed(read("a_mm")?, 24);
        let y = fixed(read("Y_kPa")?, 16);
        let (d, r) = (fixed(read("d_mm")?, 24), fixed(read("r_mm")?, 24));
        let tip = Tip::new(Millimetres::from_bits(a), Kilopascals::from_bits(y))?;
        let number = |bits: i32| f64::from(bits) / f64::from(1 << 24);
        // As a fixed-point number, as the others are: nothing judged here needs more digits.
        let theta_max = (paper::touching_angle_max(number(a), number(d)) * f64::from(1 << 24)).round() as i32;
        let results = [
            (tip.contact_radius(mm(d)).to_bits(), 24, "rc_mm"),
            (theta_max, 24, "theta_max_rad"),
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
fn fixed(value: Real, fraction_bits: isize) -> i32 {
    (value << fraction_bits).to_f64().value().round() as i32
}

const CHUNK: u64 = 1_000;

/// Strain and column length at random points.
pub fn columns(range: Range<u64>, progress: Progress<'_>) -> [Tally; 2] {
    let tallies = [Tally::new("strain", 1.0), Tally::new("L(r)", 0.5)];
    parallel(range, CHUNK, tallies, progress, |range, [strain, length]| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for _ in range {
            let Point { tip, d, r, .. } = Point::random(&mut rng);
            let exact = Reference::new(&tip).strain(&real(r, 24), &real(d, 24));
            let error = error_ulp(tip.strain(mm(r), mm(d)).to_bits(), 30, &exact);
            strain.add(Judged::by_error(error, strain.bound_ulp), at(&tip, d, r));
            let inside = r.min(tip.contact_radius(mm(d)).to_bits());
            let exact = super::exact::particle_length(&tip, inside, tip.particle_length(mm(inside)).to_bits(), 1);
            length.add(Judged { within: exact.nearest == Some(true), ..exact }, at(&tip, d, inside));
        }
    })
}
