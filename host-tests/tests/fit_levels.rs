//! The fit's work, spread over frames: when a refinement begins and ends, and what it follows meanwhile.

use fastrand::Rng;
use fingertip::contact::Contact;
use fingertip::contact::{CONFIDENCE_LEAST, FitLevel, from_sums};
use fingertip::shipped::{Config, Fit, Picture, ROWS};
use host_tests::finger::config;
use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps};

const NONE: [u32; ROWS] = [0; ROWS];
/// FitLevels that take the model, and the frames of a refinement.
const BY_MODEL: [(FitLevel, usize); 4] =
    [(FitLevel::OneRow, 11), (FitLevel::TwoRows, 6), (FitLevel::FiveRows, 3), (FitLevel::AllRows, 1)];

fn picture(scene: &Scene, noise: Noise, rng: &mut Rng) -> Picture {
    Reading { steps: Steps::Sixteenths, noise, dead: 0 }.picture(&scene.pressures(), NONE, rng).0
}

/// A contact that reaches over the edge.
fn cut_off(d_mm: f64) -> Scene {
    Scene { pitch_mm: 1.5, d_mm, x_mm: 6.0, y_mm: 1.0, object: Object::Plane }
}

fn still(d_mm: f64) -> Picture {
    picture(&cut_off(d_mm), Noise::None, &mut Rng::with_seed(0))
}

/// The frame of a fit in which a refinement says something for the first time, from 1 on.
fn first_refined(fit: &mut Fit, picture: &Picture, config: &Config) -> usize {
    (1..100).find(|_| fit.read(picture, config).confidence < 255).expect("a refinement")
}

#[test]
fn efforts_are_counted_without_a_gap() {
    for (number, fit_level) in FitLevel::ALL.into_iter().enumerate() {
        assert_eq!(FitLevel::from_number(number as u8), fit_level);
        assert_eq!(fit_level.higher(), FitLevel::ALL[(number + 1).min(5)]);
        assert_eq!(fit_level.lower(), FitLevel::ALL[number.saturating_sub(1)]);
    }
    assert_eq!([6, 255].map(FitLevel::from_number), [FitLevel::AllRows; 2]);
}

#[test]
fn a_refinement_ends_in_the_frame_that_the_effort_says() {
    let (config, picture) = (config(), still(1.5));
    for (fit_level, frames) in BY_MODEL {
        assert_eq!(first_refined(&mut Fit::new(fit_level), &picture, &config), frames, "{fit_level:?}");
    }
}

#[test]
fn another_effort_begins_anew_and_the_same_does_not() {
    let (config, picture) = (config(), still(1.5));
    for before in 1..11 {
        for (fit_level, frames) in BY_MODEL {
            let mut fit = Fit::new(FitLevel::OneRow);
            for _ in 0..before {
                fit.read(&picture, &config);
            }
            fit.set_fit_level(fit_level);
            let expected = if fit_level == FitLevel::OneRow { 11 - before } else { frames };
            assert_eq!(first_refined(&mut fit, &picture, &config), expected, "{fit_level:?} after {before} frames");
        }
    }
}

/// What was found stays: the force does not fall back to the sums.
#[test]
fn another_effort_keeps_what_was_found() {
    let (config, picture) = (config(), still(1.5));
    let mut fit = Fit::new(FitLevel::AllRows);
    for _ in 0..20 {
        fit.read(&picture, &config);
    }
    let found = fit.read(&picture, &config);
    assert!(found.force > from_sums(&picture, &config).force);
    fit.set_fit_level(FitLevel::OneRow);
    for _ in 0..10 {
        assert_eq!(fit.read(&picture, &config).force, found.force);
    }
}

/// The next contact is no part of the last one: until a refinement of its own it is its sum.
#[test]
fn what_was_found_goes_with_the_contact() {
    let (config, picture) = (config(), still(1.5));
    let mut fit = Fit::new(FitLevel::OneRow);
    for _ in 0..100 {
        fit.read(&picture, &config);
    }
    assert!(fit.read(&picture, &config).force > from_sums(&picture, &config).force);
    fit.read(&Picture::EMPTY, &config);
    for _ in 0..10 {
        let contact = fit.read(&picture, &config);
        assert_eq!((contact.force, contact.confidence), (from_sums(&picture, &config).force, 255));
    }
}

/// Where the array comes to see all of the contact, its sum counts again, to the last bit.
#[test]
fn a_contact_that_comes_into_sight_is_its_sum() {
    let config = config();
    let scene = Scene { x_mm: 0.5, ..cut_off(1.0) };
    let seen = picture(&scene, Noise::None, &mut Rng::with_seed(0));
    let mut fit = Fit::new(FitLevel::AllRows);
    for _ in 0..40 {
        fit.read(&still(1.0), &config);
    }
    for _ in 0..40 {
        fit.read(&seen, &config);
    }
    let (contact, sums) = (fit.read(&seen, &config), from_sums(&seen, &config));
    assert_eq!((contact.force, contact.centre_x, contact.centre_y), (sums.force, sums.centre_x, sums.centre_y));
}

#[test]
fn the_model_is_at_work_where_there_is_a_contact_and_an_effort_for_it() {
    let (config, picture) = (config(), still(1.5));
    for fit_level in FitLevel::ALL {
        let mut fit = Fit::new(fit_level);
        assert!(!fit.at_work());
        for _ in 0..25 {
            fit.read(&picture, &config);
            assert_eq!(fit.at_work(), fit_level >= FitLevel::OneRow, "{fit_level:?}");
        }
        fit.read(&Picture::EMPTY, &config);
        assert!(!fit.at_work(), "{fit_level:?}");
    }
}

/// Within a refinement the indentation goes with the root of the force, so what changes meanwhile is not taken for
/// another contact.
#[test]
fn a_force_that_changes_within_a_refinement_is_followed() {
    let config = config();
    for (from_mm, to_mm) in [(1.2, 2.0), (2.0, 1.2)] {
        let mut fit = Fit::new(FitLevel::OneRow);
        for _ in 0..200 {
            fit.read(&still(from_mm), &config);
        }
        let (frames, mut worst) = (120, 0.0_f64);
        for frame in 0..=frames {
            let scene = cut_off(from_mm + (to_mm - from_mm) * f64::from(frame) / f64::from(frames));
            let contact = fit.read(&picture(&scene, Noise::None, &mut Rng::with_seed(0)), &config);
            worst = worst.max((contact.force.0.to_num::<f64>() / scene.force_n() - 1.0).abs());
            assert!(contact.confidence >= CONFIDENCE_LEAST, "{contact:?}");
        }
        println!("{from_mm} to {to_mm} mm: {worst}");
        assert!(worst < 0.02, "{from_mm} to {to_mm} mm: {worst}");
    }
}

/// A fit that was never a good likeness may press for more than the taxels show, never for less.
#[test]
fn a_fit_without_confidence_never_says_less_than_the_taxels() {
    let config = config();
    let mut rng = Rng::with_seed(4);
    let (mut doubtful, mut more) = (0, 0);
    for case in 0..600 {
        let mut scene = [Scene::edge, Scene::two, Scene::bent][case % 3](&mut rng);
        scene.pitch_mm = 1.5;
        let picture = picture(&scene, Noise::OfReading(0.1), &mut rng);
        let sums = from_sums(&picture, &config);
        let mut fit = Fit::new(FitLevel::AllRows);
        for _ in 0..40 {
            let Contact { confidence, force, .. } = fit.read(&picture, &config);
            if confidence >= CONFIDENCE_LEAST {
                break;
            }
            assert!(force >= sums.force, "{force:?} of {:?}: {scene:?}", sums.force);
            doubtful += 1;
            more += usize::from(force > sums.force);
        }
    }
    assert!(doubtful > 2_000 && more > 500, "{doubtful}, {more}");
}
