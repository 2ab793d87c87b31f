//! The work of a fit, spread over frames: begin and end of a refinement, and the force that it follows meanwhile.

use crate::common::*;
use fingertip::contact::{CONFIDENCE_LEAST, from_sums};
use images::single::{Refined, read};

/// Fit levels that use the model, and the frames of a refinement.
const BY_MODEL: [(FitLevel, usize); 4] =
    [(FitLevel::OneRow, 11), (FitLevel::TwoRows, 6), (FitLevel::FiveRows, 3), (FitLevel::AllRows, 1)];

/// A contact that reaches over the edge.
fn cut_off(d_mm: f64) -> Scene {
    plane(1.5, d_mm, 6.0, 1.0)
}

fn image(scene: &Scene) -> TactileImage {
    still(scene, [0; ROWS]).0
}

/// Number of the frame in which a refinement first gives a result, from 1.
fn first_refined(fit: &mut Fit, picture: &TactileImage, config: &Config) -> usize {
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
fn a_refinement_ends_in_its_frame_and_another_effort_begins_anew() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    for before in 0..11 {
        for (fit_level, frames) in BY_MODEL {
            let mut fit = Fit::new(if before == 0 { fit_level } else { FitLevel::OneRow });
            read_often(&mut fit, &picture, before, &config);
            fit.set_fit_level(fit_level);
            let expected = if fit_level == FitLevel::OneRow { 11 - before } else { frames };
            assert_eq!(first_refined(&mut fit, &picture, &config), expected, "{fit_level:?} after {before} frames");
        }
    }
}

#[test]
fn another_effort_keeps_what_was_found() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    let mut fit = Fit::new(FitLevel::AllRows);
    read_often(&mut fit, &picture, 20, &config);
    let found = fit.read(&picture, &config);
    assert!(found.force > from_sums(&picture, &config).force);
    fit.set_fit_level(FitLevel::OneRow);
    for _ in 0..10 {
        assert_eq!(fit.read(&picture, &config).force, found.force);
    }
}

#[test]
fn what_was_found_goes_with_the_contact() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    let mut fit = Fit::new(FitLevel::OneRow);
    read_often(&mut fit, &picture, 100, &config);
    assert!(fit.read(&picture, &config).force > from_sums(&picture, &config).force);
    fit.read(&TactileImage::EMPTY, &config);
    for _ in 0..10 {
        let contact = fit.read(&picture, &config);
        assert_eq!((contact.force, contact.confidence), (from_sums(&picture, &config).force, 255));
    }
}

#[test]
fn a_contact_that_comes_into_sight_is_its_sum() {
    let config = config();
    let seen = image(&Scene { x_mm: 0.5, ..cut_off(1.0) });
    let mut fit = Fit::new(FitLevel::AllRows);
    read_often(&mut fit, &image(&cut_off(1.0)), 40, &config);
    read_often(&mut fit, &seen, 40, &config);
    let (contact, sums) = (fit.read(&seen, &config), from_sums(&seen, &config));
    assert_eq!((contact.force, contact.centre_x, contact.centre_y), (sums.force, sums.centre_x, sums.centre_y));
}

#[test]
fn the_model_is_at_work_where_there_is_a_contact_and_an_effort_for_it() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    for fit_level in FitLevel::ALL {
        let mut fit = Fit::new(fit_level);
        assert!(!fit.at_work());
        for _ in 0..25 {
            fit.read(&picture, &config);
            assert_eq!(fit.at_work(), fit_level >= FitLevel::OneRow, "{fit_level:?}");
        }
        fit.read(&TactileImage::EMPTY, &config);
        assert!(!fit.at_work(), "{fit_level:?}");
    }
}

/// The indentation scales with the root of the force, so a change of force is not taken for another contact.
#[test]
fn a_force_that_changes_within_a_refinement_is_followed() {
    let config = config();
    for (from_mm, to_mm) in [(1.2, 2.0), (2.0, 1.2)] {
        let mut fit = Fit::new(FitLevel::OneRow);
        read_often(&mut fit, &image(&cut_off(from_mm)), 200, &config);
        let (frames, mut worst) = (120, 0.0_f64);
        for frame in 0..=frames {
            let scene = cut_off(from_mm + (to_mm - from_mm) * f64::from(frame) / f64::from(frames));
            let contact = fit.read(&image(&scene), &config);
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
        let reading = Reading { steps: Steps::Sixteenths, noise: Noise::OfReading(0.1), dead: 0 };
        let picture = reading.picture(&scene.pressures(), [0; ROWS], &mut rng).0;
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

// A contact that is there from one frame to the next is fitted, wherever on the array it lies.

/// The reference finger with another pitch and tip.
fn with(pitch_um: i32, tip_radius_um: i32) -> Config {
    allowed(Params { pitch_um, tip_radius_um, ..Params::DEFAULT })
}

#[test]
fn other_parameters_begin_the_fit_anew() {
    let last = with(4_000, 4_000);
    for (pitch_um, tip_radius_um) in [(500, 16_000), (1_500, 10_000), (500, 4_000)] {
        let mut setup = Setup::default();
        (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (5.0, 4.0);
        let mut pipelines = [&with(pitch_um, tip_radius_um), &last].map(Pipeline::new);
        let sense = Sense { supply_mv: 6_000, ..Sense::default() };
        let command = Command { tare_request: 1, ..Command::default() };
        let mut world = Plant::new(&setup);
        let mut frame = Frame::EMPTY;
        world.fill_frame(&mut frame);
        for count in 0..TARE_FRAMES + 500 {
            if count == TARE_FRAMES + 2 {
                world.place(setup.wall.distance_mm + 1.5);
                world.fill_frame(&mut frame);
            }
            // In the middle of a refinement, whichever.
            if count == TARE_FRAMES + 237 {
                pipelines.iter_mut().for_each(|pipeline| pipeline.configure(&last));
            }
            frame.sequence += 1;
            let [before, fresh] =
                pipelines.each_mut().map(|pipeline| pipeline.step(&frame, &sense, &command).1.contact);
            if count >= TARE_FRAMES + 237 {
                assert_eq!(before, fresh, "{pitch_um} um, {tip_radius_um} um, frame {count}");
            }
        }
    }
}

/// A fit that is given another geometry during a refinement begins again by itself: its sums would overflow.
#[test]
fn a_fit_that_is_handed_another_geometry_begins_anew() {
    let mut rng = fastrand::Rng::with_seed(7);
    let mut picture = TactileImage::EMPTY;
    let (mut fit, last) = (Fit::default(), with(4_000, 4_000));
    for (pitch_um, tip_radius_um) in [(500, 16_000), (1_500, 10_000), (500, 4_000)] {
        let first = with(pitch_um, tip_radius_um);
        for change in 1..200 {
            picture.taxels.as_flattened_mut().fill_with(|| rng.i32(0..60_000));
            picture.peak = *picture.taxels.as_flattened().iter().max().unwrap();
            picture.sum = picture.taxels.as_flattened().iter().sum();
            for _ in 0..=change % 37 {
                fit.read(&picture, &first);
            }
            let mut fresh = Fit::default();
            for _ in 0..20 {
                assert_eq!(fit.read(&picture, &last), fresh.read(&picture, &last), "{pitch_um} um, change {change}");
            }
        }
    }
}

#[test]
fn a_contact_elsewhere_is_found_again() {
    let config = config();
    for fit_level in [FitLevel::OneRow, FitLevel::AllRows] {
        let mut fit = Fit::new(fit_level);
        for (d_mm, x_mm) in [(1.0, -7.0), (0.5, 6.5), (2.5, -6.0), (0.6, 6.0), (0.4, -6.5)] {
            let picture = image(&Scene { x_mm, ..cut_off(d_mm) });
            let frames = if fit_level == FitLevel::AllRows { 60 } else { 660 };
            read_often(&mut fit, &picture, frames, &config);
            let contact = fit.read(&picture, &config);
            let fresh = read(&picture, Refined::Full, &config);
            let share = contact.force.0.to_num::<f64>() / fresh.force.0.to_num::<f64>();
            assert!((share - 1.0).abs() < 0.02, "{share} of {fresh:?} at {x_mm} mm, {fit_level:?}: {contact:?}");
            assert!(fresh.force > from_sums(&picture, &config).force);
        }
    }
}
