//! Pictures of a run as SVG: charts over time, curves over a quantity and pressure maps. Readable in grey, and the same
//! bytes for the same run.

mod charts;
mod fronts;

use crate::heatmap::Pressures;
use charts::Frame;
pub use charts::{Panel, Sample, overview, steps};
use core::f64::consts::TAU;
pub use fronts::{Dot, Front, front};
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

/// Like [`picture`], drawn [`FINE`] times as large: coordinates are in these fractions of a pixel.
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

// Curves and points over a quantity, one panel beside the other.

/// Content of a panel.
#[derive(Clone, Debug)]
pub enum Curve {
    /// A solid line through points.
    Solid(Vec<(f64, f64)>),
    /// A thin, pale line through points.
    Pale(Vec<(f64, f64)>),
    /// A thin line in a second colour through points.
    Second(Vec<(f64, f64)>),
    /// A dashed line through points.
    Dashed(Vec<(f64, f64)>),
    /// A circle at each point.
    Circles(Vec<(f64, f64)>),
}

impl Curve {
    /// Points of the curve.
    pub fn points_mut(&mut self) -> &mut Vec<(f64, f64)> {
        let (Self::Solid(points)
        | Self::Pale(points)
        | Self::Second(points)
        | Self::Dashed(points)
        | Self::Circles(points)) = self;
        points
    }
}

/// A panel.
#[derive(Clone, Debug)]
pub struct Curves<'a> {
    /// Title.
    pub title: String,
    /// The horizontal axis, with its unit.
    pub x: &'a str,
    /// The vertical axis, with its unit.
    pub y: &'a str,
    /// Left and right end.
    pub x_range: [f64; 2],
    /// Lower and upper end.
    pub y_range: [f64; 2],
    /// First to last, the last on top.
    pub curves: Vec<Curve>,
}

/// Panels side by side, each of a size.
pub fn curves(panels: &[Curves<'_>], panel_px: (u32, u32)) -> Result<String, PlotError> {
    if panels.is_empty() {
        return Err(PlotError("there is no panel".into()));
    }
    fine_picture((panel_px.0 * panels.len() as u32, panel_px.1), |area| {
        for (panel, area) in panels.iter().zip(area.split_evenly((1, panels.len()))) {
            let Curves { title, x, y, x_range, y_range, curves } = panel;
            let frame = Frame { title, x, unit: y, x_range: *x_range, range: *y_range };
            frame.draw(&area, |chart| {
                curves.iter().try_for_each(|curve| match curve {
                    Curve::Solid(points) => chart.solid(points, INK),
                    Curve::Pale(points) => chart.pale(points),
                    Curve::Second(points) => chart.second(points),
                    Curve::Dashed(points) => chart.dashed(points, GOAL_INK),
                    Curve::Circles(points) => chart.circles(points),
                })
            })?;
        }
        Ok(())
    })
}

// Pressure maps: one square for each taxel, the contact's circle dotted over them, one scale for all.

/// One map.
#[derive(Clone, Debug)]
pub struct Map {
    /// Title.
    pub title: String,
    /// Pressure on each taxel, kPa.
    pub pressures_kpa: Pressures,
    /// The contact's centre from the array's middle, along columns and rows.
    pub centre_mm: [f64; 2],
    /// The contact's radius; 0 draws no circle.
    pub radius_mm: f64,
}

const MAP_PX: u32 = 280;
/// Makes the taxels squares.
const HEIGHT_PX: u32 = 295;
const SCALE_PX: u32 = 90;
/// Steps of the scale beside the maps.
const SCALE_STEPS: u32 = 64;
const DOTS: u32 = 60;

/// Maps side by side, with the scale of their colours.
pub fn maps(maps: &[Map], pitch_mm: f64) -> Result<String, PlotError> {
    if maps.is_empty() {
        return Err(PlotError("there is no map".into()));
    }
    let peak_kpa = maps.iter().flat_map(|map| map.pressures_kpa.iter().flatten()).copied().fold(1.0, f64::max);
    let full_kpa = (peak_kpa / 10.0).ceil() * 10.0;
    let maps_px = MAP_PX * maps.len() as u32;
    picture((maps_px + SCALE_PX, HEIGHT_PX), |area| {
        let (left, right) = area.split_horizontally(maps_px);
        for (map, area) in maps.iter().zip(left.split_evenly((1, maps.len()))) {
            draw_map(map, pitch_mm, full_kpa, &area)?;
        }
        draw_scale(full_kpa, &right)
    })
}

fn draw_map(map: &Map, pitch_mm: f64, full_kpa: f64, area: &Area<'_>) -> Result<(), PlotError> {
    let half_mm = 0.5 * pitch_mm * map.pressures_kpa.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(&map.title, (FONT, TITLE_PX))
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(-half_mm..half_mm, -half_mm..half_mm)
        .map_err(failed)?;
    let squares = map.pressures_kpa.iter().enumerate().flat_map(|(row, line)| {
        line.iter().enumerate().map(move |(column, kpa)| {
            let corner = |place: usize| place as f64 * pitch_mm - half_mm;
            let corners = [(corner(column), corner(row)), (corner(column + 1), corner(row + 1))];
            Rectangle::new(corners, ink(kpa / full_kpa).filled())
        })
    });
    chart.draw_series(squares).map_err(failed)?;
    if map.radius_mm > 0.0 {
        let dot = |n: u32| {
            let angle = TAU * f64::from(n) / f64::from(DOTS);
            let [x, y] = map.centre_mm;
            (x + map.radius_mm * angle.cos(), y + map.radius_mm * angle.sin())
        };
        let inside = (0..DOTS).map(dot).filter(|(x, y)| x.abs() <= half_mm && y.abs() <= half_mm);
        chart.draw_series(inside.map(|at| Circle::new(at, 1, BLACK.filled()))).map_err(failed)?;
    }
    chart
        .configure_mesh()
        .disable_mesh()
        .label_style((FONT, LABEL_PX))
        .x_desc("columns, mm")
        .y_desc("rows, mm")
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_labels(5)
        .y_labels(5)
        .draw()
        .map_err(failed)
}

fn draw_scale(full_kpa: f64, area: &Area<'_>) -> Result<(), PlotError> {
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(14)
        .caption("kPa", (FONT, LABEL_PX))
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..1.0, 0.0..full_kpa)
        .map_err(failed)?;
    let step = |n: u32| {
        let share = |n: u32| f64::from(n) / f64::from(SCALE_STEPS);
        let corners = [(0.0, share(n) * full_kpa), (1.0, share(n + 1) * full_kpa)];
        Rectangle::new(corners, ink(share(n)).filled())
    };
    chart.draw_series((0..SCALE_STEPS).map(step)).map_err(failed)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .set_all_tick_mark_size(6)
        .label_style((FONT, LABEL_PX))
        .x_labels(0)
        .y_labels(6)
        .y_label_formatter(&number)
        .draw()
        .map_err(failed)
}

/// The ink for the largest pressure, more transparent for less.
fn ink(share: f64) -> RGBAColor {
    INK.mix(share.clamp(0.0, 1.0))
}
