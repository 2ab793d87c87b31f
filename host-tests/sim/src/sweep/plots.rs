//! A sweep's pictures: a metric over each varied key, or how its values are spread over the seeds.

use super::summary::{points, spread, values};
use super::table::Table;
use crate::report::around;
use output::plot::{Curve, Curves, PlotError, curves};
use output::units::label;

const PANEL_PX: (u32, u32) = (560, 340);
/// Runs that are drawn each; of more, only the least, the median and the largest.
const DRAWN: usize = 2_000;

/// A picture for each metric that is bounded; where none is, for each that varies.
pub fn all(table: &Table) -> Result<Vec<(String, String)>, PlotError> {
    let bounded = table.metrics().any(|column| table.expected(&table.head[column]).is_some());
    let mut pictures = Vec::new();
    for column in table.metrics() {
        let name = &table.head[column];
        let Some([low, _, high]) = spread(values(table.rows.iter(), column)) else { continue };
        if if bounded { table.expected(name).is_some() } else { low < high } {
            let varied = table.varied();
            let (x, y) = (|key: usize| label(&table.head[key]), label(name));
            let labels: Vec<String> = varied.clone().map(x).collect();
            let panels: Vec<Curves> = match varied.is_empty() {
                true => vec![spread_over_seeds(table, column, &y)],
                false => varied.zip(&labels).map(|(key, x)| over(table, (key, x), (column, &y))).collect(),
            };
            pictures.push((name.clone(), curves(&panels, PANEL_PX)?));
        }
    }
    Ok(pictures)
}

/// A metric over a varied key: each run a circle, the medians a line, the least and the largest pale, the bounds
/// dashed.
fn over<'a>(table: &Table, (key, x): (usize, &'a str), (column, y): (usize, &'a str)) -> Curves<'a> {
    let number = |text: &String| text.parse::<f64>().unwrap_or(0.0);
    let at = |row: &Vec<String>| number(&row[key]);
    let mut places: Vec<f64> =
        points(table).iter().map(|(values, _)| number(&values[key - table.varied().start])).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let of = |x: f64| spread(values(table.rows.iter().filter(|row| at(row) == x), column)).map(|spread| (x, spread));
    let spreads: Vec<(f64, [f64; 3])> = places.iter().copied().filter_map(of).collect();
    let line = |which: usize| spreads.iter().map(|(x, spread)| (*x, spread[which])).collect::<Vec<_>>();
    let [left, right] = around_all(&places);
    let bounds = bounds(table, column).into_iter().map(|bound| Curve::Dashed(vec![(left, bound), (right, bound)]));
    let mut curves: Vec<Curve> =
        bounds.chain([Curve::Pale(line(0)), Curve::Pale(line(2)), Curve::Solid(line(1))]).collect();
    if table.rows.len() <= DRAWN {
        let runs = table.rows.iter().filter_map(|row| Some((at(row), row[column].parse().ok()?)));
        curves.push(Curve::Circles(runs.collect()));
    }
    let mut heights: Vec<f64> = spreads.iter().flat_map(|(_, spread)| *spread).collect();
    heights.extend(self::bounds(table, column));
    Curves {
        title: "Runs (circles), median (solid), least and largest (pale), bounds (dashed)".into(),
        x,
        y,
        x_range: [left, right],
        y_range: around_all(&heights),
        curves,
    }
}

/// The share of the runs at or below each value.
fn spread_over_seeds<'a>(table: &Table, column: usize, x: &'a str) -> Curves<'a> {
    let mut values = values(table.rows.iter(), column);
    values.sort_by(f64::total_cmp);
    let share = |rank: usize| 100.0 * rank as f64 / table.rows.len() as f64;
    let steps = values.iter().enumerate().flat_map(|(rank, value)| [(*value, share(rank)), (*value, share(rank + 1))]);
    let steps = Curve::Solid(steps.collect());
    let bounds = bounds(table, column);
    let upright = bounds.iter().map(|bound| Curve::Dashed(vec![(*bound, 0.0), (*bound, 100.0)]));
    let [left, right] = around_all(&[values, bounds.clone()].concat());
    Curves {
        title: "Share of the runs at or below a value, bounds (dashed)".into(),
        x,
        y: "share of the runs, %",
        x_range: [left, right],
        y_range: [0.0, 104.0],
        curves: upright.chain([steps]).collect(),
    }
}

fn bounds(table: &Table, column: usize) -> Vec<f64> {
    table.expected(&table.head[column]).into_iter().flatten().flatten().collect()
}

fn around_all(values: &[f64]) -> [f64; 2] {
    let fold = |of: fn(f64, f64) -> f64, start| values.iter().copied().fold(start, of);
    around(fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY))
}
