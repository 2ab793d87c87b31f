//! A fit whose contact is suddenly elsewhere.

use fingertip::contact::{FitLevel, from_sums};
use fingertip::shipped::{Fit, Picture, ROWS};
use host_tests::finger::config;
use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps};
use images::single::{Refined, read};

const NONE: [u32; ROWS] = [0; ROWS];

/// A contact that reaches over the edge.
fn cut_off(d_mm: f64, x_mm: f64) -> Picture {
    let scene = Scene { pitch_mm: 1.5, d_mm, x_mm, y_mm: 1.0, object: Object::Plane };
    let reading = Reading { steps: Steps::Sixteenths, noise: Noise::None, dead: 0 };
    reading.picture(&scene.pressures(), NONE, &mut fastrand::Rng::with_seed(0)).0
}

/// A contact that jumps from place to place, farther than a refinement goes, is found anew: a guess that leads nowhere
/// is given up.
#[test]
fn a_contact_elsewhere_is_found_again() {
    let config = config();
    for fit_level in [FitLevel::OneRow, FitLevel::AllRows] {
        let mut fit = Fit::new(fit_level);
        for (d_mm, x_mm) in [(1.0, -7.0), (0.5, 6.5), (2.5, -6.0), (0.6, 6.0), (0.4, -6.5)] {
            let picture = cut_off(d_mm, x_mm);
            let frames = if fit_level == FitLevel::AllRows { 60 } else { 660 };
            for _ in 0..frames {
                fit.read(&picture, &config);
            }
            let contact = fit.read(&picture, &config);
            let fresh = read(&picture, Refined::Full, &config);
            let share = contact.force.0.to_num::<f64>() / fresh.force.0.to_num::<f64>();
            assert!(
                (share - 1.0).abs() < 0.02,
                "{share} of {:?} at {x_mm} mm, {fit_level:?}: {contact:?}",
                fresh.force
            );
            assert!(fresh.force > from_sums(&picture, &config).force);
        }
    }
}
