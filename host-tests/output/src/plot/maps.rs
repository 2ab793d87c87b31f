//! Pressure maps: one square for each taxel, the contact's circle dotted over them, one scale for all.

use super::{Area, FONT, INK, LABEL_PX, PlotError, TITLE_PX, failed, number, picture};
use crate::heatmap::Pressures;
use core::f64::consts::TAU;
use plotters::prelude::*;

/// One map.
#[derive(Clone, Debug)]
pub struct Map {
    /// What it shows.
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
