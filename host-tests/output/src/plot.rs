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

/// Every colour that a picture may have, and what a dark page has in its place.
const DARK: [(&str, &str); 7] = [
    ("#FFFFFF", "#0E1116"),
    ("#000000", "#E6EDF3"),
    ("#E1E1E1", "#30363D"),
    ("#14285A", "#8FB4FF"),
    ("#B9C3D7", "#4A5F8A"),
    ("#C86E00", "#F0A04B"),
    ("#008278", "#3FD0BF"),
];

/// A picture that follows the light or dark scheme of the page it is shown on.
///
/// # Panics
/// A colour of the picture has none for dark pages.
pub fn with_dark_scheme(svg: &str) -> String {
    let drawn = svg.split(['"', '\'']).filter(|part| part.len() == 7 && part.starts_with('#'));
    for colour in drawn {
        assert!(DARK.iter().any(|(light, _)| *light == colour), "dark pages have no colour for {colour}");
    }
    let rules =
        DARK.map(|(light, dark)| format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}"));
    let style = format!("<style>@media(prefers-color-scheme:dark){{{}}}</style>", rules.concat());
    svg.replacen('>', &format!(">\n{style}"), 1)
}

/// The library draws on whole pixels, on which a slow line looks like steps: charts are drawn larger by this, and shown smaller.
const FINE: u32 = 10;

/// A number on an axis, without needless digits.
fn number(value: &f64) -> String {
    // Adding 0 turns -0 into 0.
    format!("{}", (value * 1e3).round() / 1e3 + 0.0)
}

/// Draws on an empty picture of a size.
fn picture(size_px: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        draw(&area)?;
        area.present().map_err(failed)?;
    }
    Ok(with_dark_scheme(&svg))
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
