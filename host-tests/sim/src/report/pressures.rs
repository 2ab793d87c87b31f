//! Pressure maps without a script: some of the run's, with the scale of their colours.

use super::trace::{Instant, Tracks};
use crate::metrics::shown;
use maud::{Markup, html};
use output::heatmap::Pressures;

/// How many are shown.
const MAPS: usize = 10;
/// Steps of the scale.
const STEPS: u32 = 20;

/// The maps of a finger.
pub fn pressures(tracks: &Tracks) -> Markup {
    let all = &tracks.instants;
    let full_kpa = all.iter().flat_map(|at| at.true_kpa.iter().flatten()).copied().fold(1.0, f64::max);
    let chosen = (0..MAPS.min(all.len())).map(|n| &all[(2 * n + 1) * all.len() / (2 * MAPS.min(all.len()))]);
    html! {
        div.still {
            p.note { "True mean pressure on each taxel." }
            (scale(full_kpa))
            div.maps { @for Instant { time_s, true_kpa, .. } in chosen { (map(*time_s, true_kpa, full_kpa)) } }
        }
    }
}

fn scale(full_kpa: f64) -> Markup {
    html! {
        div.scale {
            span { "0" }
            svg viewBox={ "0 0 " (STEPS) " 1" } preserveAspectRatio="none" role="img" aria-label="Colours of the maps" {
                @for n in 0..STEPS {
                    @let share = (f64::from(n) + 0.5) / f64::from(STEPS);
                    rect x=(n) y="0" width="1" height="1" fill-opacity=(format!("{share:.3}")) {}
                }
            }
            span { (format!("{full_kpa:.1}")) " kPa" }
        }
    }
}

fn map(time_s: f64, map: &Pressures, full_kpa: f64) -> Markup {
    let peak = format!("{:.1}", map.iter().flatten().copied().fold(0.0, f64::max));
    let time = shown(Some((time_s * 1e3).round() / 1e3));
    let about = format!("Pressure map at {time} s, at most {peak} kPa");
    // The last row on top, as everywhere.
    let cells =
        map.iter().rev().enumerate().flat_map(|(y, row)| row.iter().enumerate().map(move |(x, kpa)| (x, y, kpa)));
    html! {
        figure {
            svg viewBox="0 0 10 10" role="img" aria-label=(about) shape-rendering="crispEdges" {
                @for (x, y, kpa) in cells.filter(|(.., kpa)| **kpa > 0.0) {
                    rect x=(x) y=(y) width="1" height="1" fill-opacity=(format!("{:.3}", kpa / full_kpa)) {}
                }
            }
            figcaption { (time) " s, " (peak) " kPa" }
        }
    }
}
