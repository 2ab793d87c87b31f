//! Pictures of a run as SVG: charts over time, curves over a quantity and pressure maps. Readable in grey, and the same
//! bytes for the same run.

mod charts;
mod curves;
mod fronts;
mod maps;

pub use charts::{Panel, Sample, overview, steps};
pub use curves::{Curve, Curves, curves};
pub use fronts::{Dot, Front, front};
pub use maps::{Map, maps};

use plotters::prelude::*;

/// A picture could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlotError(String);

impl core::fmt::Display for PlotError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "cannot draw: {}", self.0)
    }
}

impl core::error::Error for PlotError {}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Any failure of the library, as ours.
fn failed(error: impl core::fmt::Display) -> PlotError {
    PlotError(error.to_string())
}

const FONT: &str = "sans-serif";
const LABEL_PX: u32 = 13;
const TITLE_PX: u32 = 15;
/// Light to dark in equal steps of brightness.
const INK: RGBColor = RGBColor(20, 40, 90);
const PALE_INK: RGBColor = RGBColor(185, 195, 215);
const GOAL_INK: RGBColor = RGBColor(200, 110, 0);
const SECOND_INK: RGBColor = RGBColor(0, 130, 120);
const FAINT: RGBColor = RGBColor(225, 225, 225);

/// The library draws on whole pixels, on which a slow line looks like steps: charts are drawn larger by this, and shown smaller.
const FINE: u32 = 10;

/// A number on an axis, without needless digits.
fn number(value: &f64) -> String {
    // Adding 0 turns -0 into 0.
    format!("{}", (value * 1e3).round() / 1e3 + 0.0)
}

/// Draws on a white picture of a size.
fn picture(size_px: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        draw(&area)?;
        area.present().map_err(failed)?;
    }
    Ok(svg)
}

/// As [`picture`], drawn [`FINE`] times as large: what is drawn in it counts in these parts of a pixel.
fn fine_picture(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let (wide, high) = (FINE * width, FINE * height);
    let svg = picture((wide, high), draw)?;
    Ok(svg.replacen(
        &format!("width=\"{wide}\" height=\"{high}\""),
        &format!("width=\"{width}\" height=\"{height}\""),
        1,
    ))
}
