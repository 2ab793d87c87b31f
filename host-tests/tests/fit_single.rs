//! A single look at a picture: what it looks at, and what it leaves to the sums.

use fingertip::contact::{FitLevel, Refined, from_sums, read};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, Fit, Picture, ROWS};
use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps, picture};

const NONE: [u32; ROWS] = [0; ROWS];

fn config() -> Config {
    Config::shipped(&Params::DEFAULT).expect("the defaults are allowed")
}

/// A contact that reaches over the edge.
fn cut_off(d_mm: f64, x_mm: f64) -> Picture {
    let scene = Scene { pitch_mm: 1.5, d_mm, x_mm, y_mm: 1.0, object: Object::Plane };
    let reading = Reading { steps: Steps::Sixteenths, noise: Noise::None, dead: 0 };
    reading.picture(&scene.pressures(), NONE, &mut fastrand::Rng::with_seed(0)).0
}

/// Where the sum is more than 16 peaks, every other taxel is enough for a single refinement: like a chessboard's white
/// fields.
#[test]
fn a_single_refinement_of_a_large_contact_looks_at_every_other_taxel() {
    let config = config();
    let mut large = 0;
    for tenths in 3..35 {
        let whole = cut_off(f64::from(tenths) / 10.0, 5.0);
        // A black field with a part of the pressure shows a bit more.
        let mut taxels = whole.taxels;
        let part = whole.peak / 4..whole.peak * 3 / 4;
        let black = (0..ROWS * COLUMNS).map(|taxel| (taxel / COLUMNS, taxel % COLUMNS));
        let mut black = black.filter(|(row, column)| (row + column) % 2 == 1);
        let (row, column) =
            black.find(|(row, column)| part.contains(&taxels[*row][*column])).expect("one under the rim");
        taxels[row][column] += taxels[row][column] / 16;
        let other = picture(&taxels, NONE);
        assert_eq!(other.peak, whole.peak);
        let same = |refined| {
            let [a, b] = [&whole, &other].map(|picture| read(picture, refined, &config));
            (a.force, a.centre_x, a.centre_y, a.confidence) == (b.force, b.centre_x, b.centre_y, b.confidence)
        };
        let half = whole.sum / 16 > whole.peak;
        assert_eq!(same(Refined::One), half, "{tenths} tenths of a millimetre, {} peaks", whole.sum / whole.peak);
        assert!(!same(Refined::Two) && !same(Refined::Full), "the others look at all");
        large += usize::from(half);
    }
    assert!((5..27).contains(&large), "{large}");
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
