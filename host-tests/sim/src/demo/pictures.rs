//! The demonstration's pictures.

use super::{DemoError, Forces, Picture, Run};
use crate::setup::Setup;
use output::plot::{self, Map, Panel};
use std::path::{Path, PathBuf};

/// How much of a step is shown before and after its goal.
const BEFORE_MS: f64 = 5.0;
const AFTER_MS: f64 = 60.0;

/// Draws the pictures into a folder and returns where they are.
pub fn draw(run: &Run, forces: &Forces, folder: &Path) -> Result<Vec<PathBuf>, DemoError> {
    let touched_s = run.goals.first().map_or(0.0, |asked| asked.at_s) + forces.touch.touched_after_ms * 1e-3;
    let window = |zero_s: f64| run.between(zero_s - 1e-3 * BEFORE_MS, zero_s + 1e-3 * AFTER_MS);
    let panel = |title, zero_s, time_optimal_ms| Panel {
        title,
        samples: window(zero_s),
        zero_s,
        shown_ms: [BEFORE_MS, AFTER_MS],
        time_optimal_ms,
    };
    let mut panels = vec![panel(format!("First touch, goal {} N", forces.touch.goal_n), touched_s, None)];
    for (step, asked) in forces.steps.iter().zip(run.goals.iter().skip(1)) {
        let title = format!("{:.1} to {:.1} N", step.from_n, step.to_n);
        panels.push(panel(title, asked.at_s, Some(step.time_optimal_ms)));
    }
    let map = |picture: &Picture| Map {
        title: format!("{} N", picture.goal_n),
        pressures_kpa: picture.pressures_kpa,
        centre_mm: picture.centre_mm,
        radius_mm: picture.radius_mm,
    };
    let mut maps: Vec<_> = run.pictures.iter().collect();
    maps.sort_by(|a, b| a.goal_n.total_cmp(&b.goal_n));
    let maps: Vec<_> = maps.into_iter().map(map).collect();
    let pictures = [
        ("run.svg", plot::overview(&run.trace)?),
        ("steps.svg", plot::steps(&panels)?),
        ("maps.svg", plot::maps(&maps, Setup::default().array.pitch_mm)?),
    ];

    std::fs::create_dir_all(folder).map_err(|source| DemoError::Write { path: folder.into(), source })?;
    let write = |(name, svg): (&str, String)| {
        let path = folder.join(name);
        std::fs::write(&path, svg).map_err(|source| DemoError::Write { path: path.clone(), source })?;
        Ok(path)
    };
    pictures.into_iter().map(write).collect()
}
