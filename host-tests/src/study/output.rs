//! Output of the image, and cycles by the timing model.

use crate::prove::reference::{PRECISION, Real};
use std::collections::BTreeMap;

/// A number as a variant returned it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer over 2 to some power.
    Fixed(i64, u32),
    /// Single or double precision.
    Float(f64),
}

impl Number {
    /// Its exact value; `None` if it is not a number.
    pub fn real(self) -> Option<Real> {
        let exact = match self {
            Self::Fixed(bits, fraction_bits) => Real::from_parts(bits.into(), -(fraction_bits as isize)),
            Self::Float(value) => Real::try_from(value).ok()?,
        };
        // Infinity has no value either.
        exact.repr().is_finite().then(|| exact.with_precision(PRECISION).value())
    }

    /// The nearest double.
    pub fn to_f64(self) -> f64 {
        match self {
            Self::Fixed(bits, fraction_bits) => bits as f64 / 2_f64.powi(fraction_bits as i32),
            Self::Float(value) => value,
        }
    }
}

/// Smallest, middle and largest of the passes are not all needed: these two are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passes {
    /// Half of the passes take no more.
    pub median: i64,
    /// No pass takes more.
    pub max: i64,
}

/// The cost of a call: instructions and cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Executed, exact.
    pub instructions: Passes,
    /// The fewest cycles, without wait states.
    pub low: Passes,
    /// The estimate, without wait states.
    pub estimate: Passes,
    /// The most cycles, without wait states.
    pub high: Passes,
    /// The estimate with the flash's wait states.
    pub flash: Passes,
}

impl Cost {
    /// Heads of the columns of [`Self::cells`].
    pub const HEADS: &str = "instructions | max | cycles: low | estimate | high | max | with flash | max";

    /// Cost by the figures of the image's run, a median and a largest of each, less the medians of an empty call.
    fn new(figures: &[i64; 10], empty: &[i64; 10]) -> Self {
        let passes = |at: usize| Passes { median: figures[at] - empty[at], max: figures[at + 1] - empty[at] };
        let [instructions, low, estimate, high, flash] = [0, 2, 4, 6, 8].map(passes);
        Self { instructions, low, estimate, high, flash }
    }

    pub fn cells(&self) -> String {
        let Self { instructions, low, estimate, high, flash } = self;
        let cells = [instructions.median, instructions.max, low.median, estimate.median, high.median, estimate.max];
        let cells = cells.into_iter().chain([flash.median, flash.max]).map(|figure| figure.to_string());
        cells.collect::<Vec<_>>().join(" | ")
    }
}

/// A variant's run.
#[derive(Clone, Debug, Default)]
pub struct Ran {
    pub kernel: String,
    pub name: String,
    pub firmware: bool,
    /// Results for each input.
    pub returned: Vec<Vec<Number>>,
    /// Cost of a call, less that of an empty one.
    pub cost: Cost,
}

/// Reads a report: the image's output, then a line `cost REGION` with ten figures for each region.
pub fn parse(text: &str) -> Result<Vec<Ran>, String> {
    let mut runs: BTreeMap<u32, Ran> = BTreeMap::new();
    let (mut current, mut costs) = (None, BTreeMap::new());
    for line in text.lines() {
        let failed = || format!("the study's run says: {line}");
        let (word, rest) = line.split_once(' ').ok_or_else(failed)?;
        match word {
            "region" => {
                let (region, name) = rest.split_once(' ').ok_or_else(failed)?;
                let (kernel, name) = name.split_once(": ").ok_or_else(failed)?;
                let region = region.parse().map_err(|_| failed())?;
                let plain = name.replace("**", "");
                let ran = Ran { kernel: kernel.into(), firmware: plain != name, name: plain, ..Ran::default() };
                runs.insert(region, ran);
                current = Some(region);
            }
            "cost" => {
                let numbers: Result<Vec<i64>, _> = rest.split(' ').map(str::parse).collect();
                let numbers = <[i64; 11]>::try_from(numbers.map_err(|_| failed())?);
                let [region, figures @ ..] = numbers.map_err(|_| failed())?;
                costs.insert(u32::try_from(region).map_err(|_| failed())?, figures);
            }
            _ => {
                let ran = current.and_then(|region| runs.get_mut(&region)).ok_or_else(failed)?;
                ran.returned.push(numbers(line).ok_or_else(failed)?);
            }
        }
    }
    let empty = costs.get(&0).ok_or("the empty call was not measured")?;
    let with_cost = |(region, ran): (u32, Ran)| {
        let figures = costs.get(&region).ok_or_else(|| format!("{}: {} was not measured", ran.kernel, ran.name))?;
        Ok(Ran { cost: Cost::new(figures, empty), ..ran })
    };
    runs.into_iter().filter(|(region, _)| *region != 0).map(with_cost).collect()
}

/// The firmware's variants as shipped, all other variants at the compiler's highest speed.
pub fn merged(shipped: Vec<Ran>, quick: Vec<Ran>) -> Result<Vec<Ran>, String> {
    if shipped.len() != quick.len() {
        return Err("the two images have not the same variants".into());
    }
    let pick = |(shipped, quick): (Ran, Ran)| {
        if (&shipped.kernel, &shipped.name, &shipped.returned) != (&quick.kernel, &quick.name, &quick.returned) {
            return Err(format!("{}: {} returns something else when built for speed", shipped.kernel, shipped.name));
        }
        Ok(if shipped.firmware { shipped } else { quick })
    };
    shipped.into_iter().zip(quick).map(pick).collect()
}

/// Pairs of a format and a number: `i16 -5`, `f 3f800000`, `d 3ff0000000000000`.
fn numbers(line: &str) -> Option<Vec<Number>> {
    let words: Vec<_> = line.split(' ').collect();
    words.chunks(2).map(|pair| number(pair.first()?, pair.get(1)?)).collect()
}

fn number(format: &str, digits: &str) -> Option<Number> {
    Some(match format {
        "f" => Number::Float(f32::from_bits(u32::from_str_radix(digits, 16).ok()?).into()),
        "d" => Number::Float(f64::from_bits(u64::from_str_radix(digits, 16).ok()?)),
        _ => Number::Fixed(digits.parse().ok()?, format.strip_prefix('i')?.parse().ok()?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: &str = "region 0 nothing: an empty call\nregion 1 root: **ours**\ni16 -32768\nf 3fc00000\n\
        cost 0 2 2 3 3 4 4 5 5 4 9\ncost 1 12 13 23 23 34 34 45 45 54 59\n";

    #[test]
    fn what_is_no_run_or_another_one_is_refused() {
        assert!(parse(&RUN.replace("cost 1", "cost 2")).is_err(), "a variant was not measured");
        assert!(parse(&RUN.replace("i16 -32768", "i16 x")).is_err(), "no number");
        // Both builds must return the same.
        let runs = || parse(RUN).expect("a run");
        assert!(merged(runs(), runs()).is_ok());
        let other = parse(&RUN.replace("-32768", "-32767")).expect("a run");
        assert!(merged(runs(), other).is_err());
    }
}
