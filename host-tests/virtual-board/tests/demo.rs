//! The demonstration on the flash image: every bound holds, and the same run gives the same figures.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

use crate::common::{image, scratch};
use sim::demo::figures::{draw, missed, table};
use virtual_board::demo::{self, Plan};

#[test]
fn every_bound_holds_and_the_pictures_are_drawn() {
    let (figures, run) = demo::run(&Plan { image: image(), quick: true }).expect("the demonstration runs");
    assert_eq!(missed(&figures.checks), 0, "\n{}", table(&figures.checks, &figures.forces));
    assert_eq!(figures.forces.steps.len(), 4);
    assert_eq!(run.pictures.iter().map(|picture| picture.goal_n).collect::<Vec<_>>(), [1.0, 2.0, 5.0]);

    // What the board senses is what the world has, and the circle is that of the model: r_c^2 = d (2a - d).
    for picture in &run.pictures {
        assert!((picture.force_n - picture.goal_n).abs() < 0.01 * picture.goal_n, "{picture:?}");
        let d = (picture.goal_n / (std::f64::consts::PI * 0.25)).sqrt();
        assert!((picture.radius_mm - (d * (20.0 - d)).sqrt()).abs() < 0.05, "{picture:?}");
        let sum_n: f64 = picture.pressures_kpa.iter().flatten().sum::<f64>() * 1.5 * 1.5 * 1e-3;
        assert!((sum_n - picture.goal_n).abs() < 0.03 * picture.goal_n, "{sum_n} N in {picture:?}");
    }

    let folder = scratch("pictures");
    let drawn = draw(&run, &figures.forces, &folder).expect("the pictures are drawn");
    for path in &drawn {
        let svg = std::fs::read_to_string(path).expect("it was written");
        assert!(svg.starts_with("<svg") && !svg.contains("NaN"), "{}", path.display());
    }
    assert_eq!(drawn.len(), 3);
    std::fs::remove_dir_all(&folder).expect("it was there");
}
