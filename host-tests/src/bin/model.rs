//! The model as a filter: CSV in, CSV out, computed by the fixed-point core.
//!
//! Standard input has a header line with the columns `a_mm`, `Y_kPa`, `d_mm` and `r_mm` in any order; further columns
//! are ignored. Standard output repeats the four as they were written and adds what the model says. Decimals are read
//! exactly and rounded once to the nearest value that the core can hold; results have the digits that tell them from
//! their neighbours. A row outside the domain keeps its place with empty cells, is named on standard error, and makes
//! the exit code 1.

use std::error::Error;
use std::io;
use std::process::ExitCode;

use csv::StringRecord;
use dashu_float::DBig;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip};
use fingertip::units::{Kilopascals, Millimetres};

const INPUTS: [&str; 4] = ["a_mm", "Y_kPa", "d_mm", "r_mm"];
const RESULTS: [&str; 6] = ["rc_mm", "theta_max_rad", "p_kPa", "F_N", "k_N_per_mm", "d_from_F_mm"];

/// Decimal exponents beyond this are far outside the domain and are not worth expanding.
const EXPONENT_MAX: isize = 200;

fn main() -> ExitCode {
    match run() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("model: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Answers every row and returns how many were refused.
fn run() -> Result<u64, Box<dyn Error>> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(io::stdin().lock());
    let places = places(reader.headers()?)?;
    let mut writer = csv::Writer::from_writer(io::stdout().lock());
    writer.write_record(INPUTS.iter().chain(&RESULTS))?;
    let mut refused = 0;
    for (row, record) in (1_u64..).zip(reader.records()) {
        let record = record?;
        let cells = places.map(|place| record.get(place).unwrap_or_default());
        let results = answer(cells).unwrap_or_else(|reason| {
            eprintln!("row {row}: {reason}");
            refused += 1;
            [const { String::new() }; RESULTS.len()]
        });
        writer.write_record(cells.iter().copied().chain(results.iter().map(String::as_str)))?;
    }
    writer.flush()?;
    Ok(refused)
}

fn places(header: &StringRecord) -> Result<[usize; 4], String> {
    let mut places = [0; 4];
    for (place, name) in places.iter_mut().zip(INPUTS) {
        *place = header
            .iter()
            .position(|column| column == name)
            .ok_or_else(|| format!("the header has no column {name}; a_mm, Y_kPa, d_mm and r_mm are needed"))?;
    }
    Ok(places)
}

/// Results of a row, or why it has none.
fn answer(cells: [&str; 4]) -> Result<[String; 6], String> {
    let [a, y, d, r] = [0, 1, 2, 3].map(|place| Cell { column: INPUTS[place], text: cells[place] });
    let (radius, modulus) = (a.read()?, y.read()?);
    let (depth, distance) = (d.read()?, r.read()?);
    let radius_bits = a.within(&radius, (RADIUS_MIN.to_bits(), RADIUS_MAX.to_bits()), 24)?;
    let modulus_bits = y.within(&modulus, (MODULUS_MIN.to_bits(), MODULUS_MAX.to_bits()), 16)?;
    let depth_max = exact(&radius) * exact(&DBig::from_parts(95.into(), -2));
    let depth_bits = round(&depth, 24).filter(|&bits| bits >= 1 && depth <= depth_max);
    let depth_bits = depth_bits.ok_or_else(|| d.refuse("2^-24 mm to 0.95 a_mm"))?;
    let distance_bits = round(&distance, 24).filter(|&bits| bits >= 0 && distance >= DBig::ZERO);
    let distance_bits = distance_bits.ok_or_else(|| r.refuse("0 to below 128 mm"))?;

    let tip = Tip::new(Millimetres::from_bits(radius_bits), Kilopascals::from_bits(modulus_bits))
        .map_err(|error| a.refuse(error))?;
    let (depth, distance) = (Millimetres::from_bits(depth_bits), Millimetres::from_bits(distance_bits));
    let force = tip.force(depth);
    Ok([
        tip.contact_radius(depth).0.to_string(),
        paper::touching_angle_max(&tip, depth).0.to_string(),
        tip.pressure(distance, depth).0.to_string(),
        force.0.to_string(),
        tip.stiffness(depth).0.to_string(),
        tip.indentation(force).0.to_string(),
    ])
}

/// A cell under its column's name.
struct Cell<'a> {
    column: &'static str,
    text: &'a str,
}

impl Cell<'_> {
    /// The cell's exact value.
    fn read(&self) -> Result<DBig, String> {
        let refusal = || format!("{} is {:?}: a decimal number is needed", self.column, self.text);
        // The parser also takes separators and other notations; a CSV cell has digits, a point, a sign, an exponent.
        if !self.text.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E')) {
            return Err(refusal());
        }
        let value: DBig = self.text.parse().map_err(|_| refusal())?;
        let range = || self.refuse(format_args!("a number below 1e{EXPONENT_MAX} with fewer digits"));
        if value.repr().exponent().abs() > EXPONENT_MAX { Err(range()) } else { Ok(value) }
    }

    /// The nearest fixed-point value, where the exact one is inside the range.
    fn within(&self, value: &DBig, (min, max): (i32, i32), fraction_bits: u32) -> Result<i32, String> {
        let (least, most) = (min >> fraction_bits, max >> fraction_bits);
        let inside = *value >= DBig::from(least) && *value <= DBig::from(most);
        let bits = round(value, fraction_bits).filter(|_| inside);
        bits.ok_or_else(|| self.refuse(format_args!("{least} to {most}")))
    }

    fn refuse(&self, range: impl std::fmt::Display) -> String {
        format!("{} is {}: {range} is covered", self.column, self.text)
    }
}

/// The same number, in arithmetic that never rounds.
fn exact(value: &DBig) -> DBig {
    value.clone().with_precision(0).value()
}

/// The nearest fixed-point number, if there is one.
fn round(value: &DBig, fraction_bits: u32) -> Option<i32> {
    let scaled = exact(value) * exact(&DBig::from(1_u32 << fraction_bits));
    let whole = scaled.round().to_int().value();
    i32::try_from(whole).ok()
}
