//! The stopwatch: takes the executed instructions one after the other and measures what lies between the markers.

use crate::core::{Core, Cycles, Executed, Flash, Next, Touched};
use crate::decode::Unknown;
use crate::instruction::{IfThen, Instruction, Kind, holds};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A place in the guest's code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site {
    pub address: u32,
    pub code: Result<Instruction, Unknown>,
}

impl Site {
    /// True if a region begins or ends here.
    pub const fn is_marker(&self) -> bool {
        matches!(self.code, Ok(Instruction { kind: Kind::Begin | Kind::End, .. }))
    }
}

/// State of the guest that the meter reads before an instruction executes.
pub trait Registers {
    fn core(&mut self, number: u8) -> u32;
    fn xpsr(&mut self) -> u32;
}

/// Reason why a measurement was aborted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeterError {
    Unknown(u32, Unknown),
    Untimed(u32),
    /// Execution went elsewhere without a branch: an exception or a fault.
    Interrupted {
        after: u32,
        to: u32,
    },
    Nested(u32),
    NotBegun(u32),
    NotEnded(u32),
}

impl fmt::Display for MeterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(at, code) => write!(f, "unknown instruction {code} at {at:#010x}"),
            Self::Untimed(at) => write!(f, "the instruction at {at:#010x} waits, traps or calls the debugger"),
            Self::Interrupted { after, to } => write!(f, "an exception after {after:#010x} went to {to:#010x}"),
            Self::Nested(at) => write!(f, "a region begins within a region at {at:#010x}"),
            Self::NotBegun(at) => write!(f, "a region ends that did not begin at {at:#010x}"),
            Self::NotEnded(number) => write!(f, "the guest ended within region {number}"),
        }
    }
}

impl std::error::Error for MeterError {}

/// A pass under way.
#[derive(Clone, Debug, Default)]
struct Pass {
    number: u32,
    core: Core,
    block: IfThen,
    last: Option<Executed>,
    instructions: u64,
    cycles: Cycles,
    flash_start: u64,
}

/// The stopwatch.
#[derive(Clone, Debug, Default)]
pub struct Meter {
    pass: Option<Pass>,
    flash: Flash,
    regions: Regions,
}

impl Meter {
    /// True if a region is being measured: outside of one, only markers matter.
    pub fn running(&self) -> bool {
        self.pass.is_some()
    }

    /// The core is about to execute what lies at a place.
    pub fn execute(&mut self, site: &Site, registers: &mut impl Registers) -> Result<(), MeterError> {
        let address = site.address;
        let Some(pass) = &mut self.pass else {
            match &site.code {
                Ok(Instruction { kind: Kind::Begin, .. }) => {
                    let (number, flash_start) = (registers.core(0), self.flash.now());
                    self.pass = Some(Pass { number, flash_start, ..Pass::default() });
                }
                Ok(Instruction { kind: Kind::End, .. }) => return Err(MeterError::NotBegun(address)),
                _ => {}
            }
            return Ok(());
        };

        let instruction = site.code.as_ref().map_err(|unknown| MeterError::Unknown(address, *unknown))?;
        pass.retire(Next { address, wide: instruction.wide && !site.is_marker() }, &mut self.flash)?;
        match instruction.kind {
            Kind::Begin => return Err(MeterError::Nested(address)),
            Kind::Untimed => return Err(MeterError::Untimed(address)),
            Kind::End => {
                self.end();
                return Ok(());
            }
            _ => {}
        }
        self.flash.fetch(address, instruction.size());
        pass.start(instruction, address, registers);
        Ok(())
    }

    /// The instruction that was last executed reads or writes memory.
    pub fn access(&mut self, touched: Touched, store: bool) {
        let Some(pass) = &mut self.pass else { return };
        if let Some(last) = &mut pass.last {
            last.touched.get_or_insert(touched);
        }
        if !store {
            self.flash.read(touched.address);
        }
    }

    /// Returns the measurements.
    pub fn finish(&self) -> Result<&Regions, MeterError> {
        self.pass.as_ref().map_or(Ok(&self.regions), |pass| Err(MeterError::NotEnded(pass.number)))
    }

    fn end(&mut self) {
        let Some(mut pass) = self.pass.take() else { return };
        let rest = pass.core.finish();
        pass.cycles = pass.cycles + rest;
        self.flash.pass(rest.estimate);
        let (Cycles { low, estimate, high }, flash) = (pass.cycles, self.flash.now() - pass.flash_start);
        self.regions.entry(pass.number).or_default().push([pass.instructions, low, estimate, high, flash]);
    }
}

impl Pass {
    /// Counts the instruction before, now that it is known where it led.
    fn retire(&mut self, next: Next, flash: &mut Flash) -> Result<(), MeterError> {
        let Some(last) = &self.last else { return Ok(()) };
        let follows = last.address.wrapping_add(last.instruction.size()) == next.address;
        if !follows && (last.skipped || !last.instruction.branches()) {
            return Err(MeterError::Interrupted { after: last.address, to: next.address });
        }
        let cycles = self.core.retire(last, next);
        self.cycles = self.cycles + cycles;
        self.instructions += 1;
        flash.pass(cycles.estimate);
        Ok(())
    }

    fn start(&mut self, instruction: &Instruction, address: u32, registers: &mut impl Registers) {
        let instruction = *instruction;
        let executed =
            self.last.insert(Executed { instruction, address, skipped: false, quotient_bits: 0, touched: None });
        if let Some(condition) = self.block.advance() {
            executed.skipped = !holds(condition, registers.xpsr());
        }
        if !executed.skipped {
            match instruction.kind {
                Kind::IfThen { state } => self.block = IfThen(state),
                Kind::Divide { signed, numerator, denominator } => {
                    executed.quotient_bits =
                        quotient_bits(signed, registers.core(numerator), registers.core(denominator));
                }
                _ => {}
            }
        }
    }
}

/// Significant bits of a quotient; dividing by zero gives zero.
fn quotient_bits(signed: bool, numerator: u32, denominator: u32) -> u32 {
    let (numerator, denominator) = if signed {
        ((numerator as i32).unsigned_abs(), (denominator as i32).unsigned_abs())
    } else {
        (numerator, denominator)
    };
    u32::BITS - numerator.checked_div(denominator).unwrap_or(0).leading_zeros()
}

// Measurements: the passes of each region, and their statistics.

/// Passes through each region, by its number: the figures of [`Measured`], in its order.
pub type Regions = BTreeMap<u32, Vec<[u64; 5]>>;

/// A figure over the passes of a region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct Summary {
    pub total: u64,
    pub min: u64,
    /// The one in the middle; of an even number the lower of the two.
    pub median: u64,
    pub max: u64,
}

impl Summary {
    fn of(mut values: Vec<u64>) -> Self {
        values.sort_unstable();
        let at = |place: usize| values.get(place).copied().unwrap_or(0);
        let last = values.len().saturating_sub(1);
        Self { total: values.iter().sum(), min: at(0), median: at(last / 2), max: at(last) }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct Measured {
    /// Name of the region; empty where it is not known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    pub region: u32,
    pub passes: u64,
    /// Instructions executed, those whose condition did not hold too.
    pub instructions: Summary,
    /// The fewest cycles, without wait states.
    pub low: Summary,
    /// The estimate, without wait states.
    pub estimate: Summary,
    /// The most cycles, without wait states.
    pub high: Summary,
    /// The estimate with the flash's wait states.
    pub flash: Summary,
}

/// Each figure over the passes of a region.
pub fn summaries(passes: &[[u64; 5]]) -> [Summary; 5] {
    std::array::from_fn(|figure| Summary::of(passes.iter().map(|pass| pass[figure]).collect()))
}

/// Figures of the regions, in order of their numbers.
pub fn measured(regions: &Regions) -> Vec<Measured> {
    let of = |(region, passes): (&u32, &Vec<[u64; 5]>)| {
        let ([instructions, low, estimate, high, flash], passes) = (summaries(passes), passes.len() as u64);
        Measured { name: String::new(), region: *region, passes, instructions, low, estimate, high, flash }
    };
    regions.iter().map(of).collect()
}

/// Writes an object a line.
pub fn json_lines(measured: &[Measured]) -> String {
    measured.iter().map(|measured| serde_json::to_string(measured).unwrap_or_default() + "\n").collect()
}

/// Reads what [`json_lines`] wrote. `None` where it is anything else.
pub fn parse(text: &str) -> Option<Vec<Measured>> {
    text.lines().map(|line| serde_json::from_str(line).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_lies_in_the_middle_of_the_passes() {
        let of = |values: &[u64]| Summary::of(values.to_vec());
        assert_eq!(of(&[5, 1, 9]), Summary { total: 15, min: 1, median: 5, max: 9 });
        assert_eq!(of(&[4, 1, 9, 2]), Summary { total: 16, min: 1, median: 2, max: 9 });
        assert_eq!(of(&[]), Summary::default());
    }

    #[test]
    fn a_report_is_a_line_of_json_for_each_region_and_is_read_as_written() {
        let passes = |estimates: &[u64]| estimates.iter().map(|estimate| [4, 3, *estimate, 9, estimate + 1]).collect();
        let regions = measured(&BTreeMap::from([(7, passes(&[6, 5, 8])), (2, passes(&[5]))]));
        assert_eq!((regions[1].region, regions[1].passes, regions[1].flash.max), (7, 3, 9));
        let text = json_lines(&regions);
        assert_eq!(parse(&text), Some(regions));
        assert_eq!(
            text.lines().next(),
            Some(concat!(
                r#"{"region":2,"passes":1,"instructions":{"total":4,"min":4,"median":4,"max":4},"#,
                r#""low":{"total":3,"min":3,"median":3,"max":3},"estimate":{"total":5,"min":5,"median":5,"max":5},"#,
                r#""high":{"total":9,"min":9,"median":9,"max":9},"flash":{"total":6,"min":6,"median":6,"max":6}}"#
            ))
        );
        let named = [Measured { name: "a \"call\"".into(), ..Measured::default() }];
        assert_eq!(parse(&json_lines(&named)).as_deref(), Some(&named[..]));
        assert_eq!(parse("{\"region\":1}"), None);
    }
}
