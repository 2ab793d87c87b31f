//! The points computed elsewhere: `oracle/park2003.csv`, 25 digits each.

use std::error::Error;
use std::path::Path;

use dashu_float::DBig;
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres};

use super::domain::mm;
use super::reference::{PRECISION, Real, error_ulp, real};
use super::tally::{Judged, Tally};

/// Where the points are.
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
