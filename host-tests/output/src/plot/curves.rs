//! Curves and points over a quantity, one panel beside the other.

use super::charts::Frame;
use super::{GOAL_INK, INK, PlotError, fine_picture};

/// What is drawn in a panel.
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
    /// Its points.
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
    /// What it shows.
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
