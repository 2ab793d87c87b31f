//! The worst fingers, as scenes that can be run again.

use super::text::judged;
use super::{Population, Report};
use crate::part::cannot_write;
use crate::run::RunError;
use crate::scene::text::set;
use output::kept;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes the scenes of the `count` worst fingers into a folder, in the order of [`Report::worst`].
///
/// # Errors
/// A file cannot be written.
pub fn write(population: &Population, report: &Report, count: usize, out: &Path) -> Result<Vec<PathBuf>, RunError> {
    fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
    let mut paths = Vec::new();
    for ran in report.worst().into_iter().take(count) {
        let scene = population.finger(report.seed, ran.finger - 1)?.scene;
        let head = format!(
            "# Drawn from the population `{}`, seed {}; of {}.\n# {}\n",
            population.name,
            report.seed,
            report.of_fingers,
            judged(ran)
        );
        let mut text = set(&scene.text, "seed", &scene.seed.to_string())?;
        // What was drawn left empty lines behind.
        while text.contains("\n\n\n") {
            text = text.replace("\n\n\n", "\n\n");
        }
        let path = out.join(format!("{}-{}-{}.toml", population.name, report.seed, ran.finger));
        kept::write(&path, head + text.trim_start()).map_err(|error| cannot_write(&path, &error))?;
        paths.push(path);
    }
    Ok(paths)
}
