//! The demonstration on the native board: its figures, its maps and its pictures.

use crate::folder;
use output::plot;
use sim::demo::{self, Forces, Run, Taxels, Trace, draw, missed, table};
use sim::simulate;
use sim::watch::{Step, Watch};

fn run() -> Run {
    let scene = demo::scene(true).unwrap();
    let mut trace = Trace::new(&scene);
    simulate(&scene, &mut trace).unwrap();
    trace.finish().unwrap()
}

fn drawn(run: &Run, name: &str) -> Vec<(String, String)> {
    let paths = draw(run, &Forces::of(run).unwrap(), &folder(name)).unwrap();
    let file = |path: &std::path::Path| path.file_name().unwrap().to_string_lossy().into_owned();
    paths.iter().map(|path| (file(path), std::fs::read_to_string(path).unwrap())).collect()
}

#[test]
fn every_bound_holds() {
    let forces = Forces::of(&run()).unwrap();
    let checks = forces.checks();
    assert_eq!((missed(&checks), checks.len()), (0, 26), "\n{}", table(&checks, &forces));
}

#[test]
fn the_same_run_gives_the_same_pictures() {
    let pictures = drawn(&run(), "demo/once");
    assert_eq!(pictures, drawn(&run(), "demo/again"));
    for (name, svg) in &pictures {
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
    }
}

#[test]
fn axes_have_units() {
    let [(_, overview), (_, steps), (_, maps)] = &drawn(&run(), "demo/axes")[..] else { panic!("three pictures") };
    for unit in ["time, s", "\nN\n", "\nmm\n", "\n%\n"] {
        assert!(overview.contains(unit), "{unit:?}");
    }
    assert!(steps.contains("time, ms") && steps.contains("the motor allows"), "the last panel is the key");
    assert_eq!(maps.matches("columns, mm").count(), 3);
    assert!(maps.contains("kPa"));
    // The taxels under pressure, the scale and the background.
    assert!((64 + 3 * 30..64 + 3 * 100).contains(&maps.matches("<rect").count()));
}

#[test]
fn nothing_to_draw_is_an_error() {
    assert!(plot::overview(&[]).unwrap_err().to_string().contains("empty"));
    assert!(plot::maps(&[], 1.5).is_err());
}

/// Holds the pressures by a frame's codes against the true ones.
struct Maps {
    array: Taxels,
    error_kpa: f64,
    peak_kpa: f64,
}

impl Watch for Maps {
    fn wants_pressures(&mut self, _: usize, time_s: f64) -> bool {
        time_s >= 0.0
    }

    fn step(&mut self, step: &Step) {
        let seen = self.array.kilopascals(step.frame);
        for (seen, is) in seen.as_flattened().iter().zip(step.truth.pressures_kpa.as_flattened()) {
            // While the force moves, each row is of another instant.
            if step.truth.speed_mm_per_s.abs() < 0.1 && step.time_s >= 0.0 {
                self.error_kpa = self.error_kpa.max((seen - is).abs());
                self.peak_kpa = self.peak_kpa.max(*is);
            }
        }
    }
}

#[test]
fn the_maps_are_of_the_pressures_on_the_taxels() {
    let scene = demo::scene(true).unwrap();
    let mut maps = Maps { array: Taxels::of(&scene), error_kpa: 0.0, peak_kpa: 0.0 };
    simulate(&scene, &mut maps).unwrap();
    assert!(maps.peak_kpa > 60.0, "{}", maps.peak_kpa);
    // A code is 1/24 kPa. With the rows' sag left in, it would be above 1 kPa.
    assert!(maps.error_kpa < 0.1, "{} kPa", maps.error_kpa);
}
