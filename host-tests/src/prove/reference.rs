//! The model in arbitrary precision, by the `dashu-float` crate: the judge of what has no exact form.
//!
//! Formulas are the textbook ones, not those of the core: with 96 bits nothing cancels that matters.

use super::random::mm;
use super::tally::{Judged, Tally};
use dashu_float::round::mode::HalfEven;
use dashu_float::{DBig, FBig};
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres};
use std::error::Error;
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

/// A tip.
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
    /// The same tip.
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

/// Path of the file of points.
pub fn path() -> std::path::PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/oracle/park2003.csv")
}

/// Every point of the oracle.
///
/// # Errors
/// The file is missing or not what it should be.
pub fn check() -> Result<[Tally; 5], Box<dyn Error>> {
    let mut tallies = [
        Tally::new("r_c(d)", 0.501),
        Tally::new("theta_max(d)", 1.0),
        Tally::new("p(r, d)", 0.501),
        Tally::new("F(d)", 0.501),
        Tally::new("k(d)", 0.501),
    ];
    let mut reader = csv::Reader::from_path(path())?;
    let columns: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
    for record in reader.records() {
        let record = record?;
        let read = |name: &str| -> Result<Real, Box<dyn Error>> {
            let place = columns.iter().position(|column| column == name).ok_or_else(|| format!("no column {name}"))?;
            parse(record.get(place).unwrap_or_default())
        };
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
