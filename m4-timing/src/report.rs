//! The measurements as text to read and as JSON lines.

use crate::meter::{Figures, Region, Summary};
use std::collections::BTreeMap;
use std::fmt::Write;

/// A table: a line for each region and figure.
pub fn text(regions: &BTreeMap<u32, Region>) -> String {
    let mut text = format!(
        "{:>8} {:>8}  {:<12} {:>14} {:>10} {:>10} {:>10}\n",
        "region", "passes", "", "total", "min", "median", "max"
    );
    for (number, region) in regions {
        let passes = region.passes();
        for (name, Summary { total, min, median, max }) in Figures::NAMES.iter().zip(region.summaries()) {
            // A string takes every write.
            let _ = writeln!(text, "{number:>8} {passes:>8}  {name:<12} {total:>14} {min:>10} {median:>10} {max:>10}");
        }
    }
    for (name, total) in Figures::NAMES.iter().zip(totals(regions)) {
        let _ = writeln!(text, "{:>8} {:>8}  {name:<12} {total:>14}", "all", "");
    }
    text
}

/// An object a line: the regions in order of their numbers, then the sums over all of them.
pub fn json_lines(regions: &BTreeMap<u32, Region>) -> String {
    let mut text = String::new();
    for (number, region) in regions {
        let _ = write!(text, "{{\"region\":{number},\"passes\":{}", region.passes());
        for (name, Summary { total, min, median, max }) in Figures::NAMES.iter().zip(region.summaries()) {
            let _ = write!(text, ",\"{name}\":{{\"total\":{total},\"min\":{min},\"median\":{median},\"max\":{max}}}");
        }
        text.push_str("}\n");
    }
    let sums = Figures::NAMES.iter().zip(totals(regions)).map(|(name, total)| format!("\"{name}\":{total}"));
    let _ = writeln!(text, "{{\"total\":{{{}}}}}", sums.collect::<Vec<_>>().join(","));
    text
}

fn totals(regions: &BTreeMap<u32, Region>) -> [u64; 5] {
    let mut totals = [0; 5];
    for region in regions.values() {
        for (total, summary) in totals.iter_mut().zip(region.summaries()) {
            *total += summary.total;
        }
    }
    totals
}

/// A region of a report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Measured {
    /// Number of the region.
    pub region: u32,
    /// Passes through it.
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

/// Reads what [`json_lines`] wrote: the regions, in order of their numbers. `None` where it is anything else.
pub fn parse(text: &str) -> Option<Vec<Measured>> {
    let (regions, total) = text.trim_end().rsplit_once('\n').unwrap_or(("", text.trim_end()));
    total.starts_with("{\"total\":").then(|| regions.lines().map(parse_line).collect())?
}

fn parse_line(line: &str) -> Option<Measured> {
    // The writer puts every number behind a key of its own, in a fixed order: the numbers tell all.
    let mut numbers = line.split(|letter: char| !letter.is_ascii_digit()).filter(|word| !word.is_empty());
    let mut number = || numbers.next()?.parse::<u64>().ok();
    let (region, passes) = (number()?.try_into().ok()?, number()?);
    let mut summary = || Some(Summary { total: number()?, min: number()?, median: number()?, max: number()? });
    let (instructions, low, estimate, high, flash) = (summary()?, summary()?, summary()?, summary()?, summary()?);
    numbers.next().is_none().then_some(Measured { region, passes, instructions, low, estimate, high, flash })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Cycles;

    fn regions() -> BTreeMap<u32, Region> {
        let figures = |estimate| Figures { instructions: 4, cycles: Cycles::new(3, estimate, 9), flash: estimate + 1 };
        let mut regions = BTreeMap::<u32, Region>::new();
        for (number, estimate) in [(7, 6), (7, 5), (7, 8), (2, 5)] {
            regions.entry(number).or_default().push(&figures(estimate));
        }
        regions
    }

    #[test]
    fn a_report_is_a_line_of_json_for_each_region_and_one_for_all() {
        let text = json_lines(&regions());
        assert_eq!(
            text.lines().next(),
            Some(concat!(
                r#"{"region":2,"passes":1,"instructions":{"total":4,"min":4,"median":4,"max":4},"#,
                r#""low":{"total":3,"min":3,"median":3,"max":3},"estimate":{"total":5,"min":5,"median":5,"max":5},"#,
                r#""high":{"total":9,"min":9,"median":9,"max":9},"flash":{"total":6,"min":6,"median":6,"max":6}}"#
            ))
        );
        assert!(
            text.ends_with("{\"total\":{\"instructions\":16,\"low\":12,\"estimate\":24,\"high\":36,\"flash\":28}}\n")
        );
    }

    #[test]
    fn a_report_is_read_as_it_was_written() {
        let measured = parse(&json_lines(&regions())).expect("a report");
        assert_eq!(
            measured.iter().map(|measured| (measured.region, measured.passes)).collect::<Vec<_>>(),
            [(2, 1), (7, 3)]
        );
        assert_eq!(measured[1].estimate, Summary { total: 19, min: 5, median: 6, max: 8 });
        assert_eq!(measured[1].flash.max, 9);
        assert_eq!(parse(&json_lines(&BTreeMap::new())), Some(vec![]));
        assert_eq!(parse("{\"region\":1}\n{\"total\":{}}"), None);
        assert_eq!(parse(""), None);
    }

    #[test]
    fn the_table_has_a_line_for_each_figure() {
        let text = text(&regions());
        assert_eq!(text.lines().count(), 1 + 2 * Figures::NAMES.len() + Figures::NAMES.len());
        assert!(
            text.contains("       7        3  estimate                 19          5          6          8\n"),
            "{text}"
        );
    }
}
