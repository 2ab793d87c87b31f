//! A contact that is there from one frame to the next is fitted, wherever on the array it lies.

use fingertip::command::Command;
use fingertip::contact::{CONFIDENCE_LEAST, FitLevel, from_sums};
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{Config, Fit, Frame, Picture, Pipeline, ROWS, TARE_FRAMES};
use host_tests::finger::config;
use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps};
use images::single::{Refined, read};
use sim::plant::{Plant, Setup};

/// The reference finger with another pitch and tip.
fn with(pitch_um: i32, tip_radius_um: i32) -> Config {
    Config::shipped(&Params { pitch_um, tip_radius_um, ..Params::DEFAULT }).unwrap()
}

/// The fit of one geometry says nothing of another.
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

/// A fit that is handed another geometry in the middle of a refinement takes it as a new one, by itself: its sums would
/// overflow.
#[test]
fn a_fit_that_is_handed_another_geometry_begins_anew() {
    let mut rng = fastrand::Rng::with_seed(7);
    let mut picture = Picture::EMPTY;
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

/// Pressed in at once after the tare, with the centre so far from the array's middle, and left there for 5,000 frames:
/// the true force and the last status.
fn pressed(fit_level: FitLevel, depth_mm: f64, [x, y]: [f64; 2]) -> (f64, Status) {
    let mut setup = Setup::default();
    (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (x, y);
    let mut world = Plant::new(&setup);
    let mut pipeline = Pipeline::new(&config());
    let sense = Sense { supply_mv: 6_000, ..Sense::default() };
    let command = Command { tare_request: 1, fit_level, ..Command::default() };
    let mut frame = Frame::EMPTY;
    let mut status = Status::default();
    world.fill_frame(&mut frame);
    for count in 0..TARE_FRAMES + 5_000 {
        if count == TARE_FRAMES + 2 {
            world.place(setup.wall.distance_mm + depth_mm);
            world.fill_frame(&mut frame);
        }
        frame.sequence += 1;
        status = *pipeline.step(&frame, &sense, &command).1;
    }
    (world.force_n(), status)
}

#[test]
fn a_contact_that_appears_is_fitted_wherever_it_lies() {
    for fit_level in [FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
        for (depth_mm, x, y) in [(1.5, 6.9, 0.0), (1.5, 0.0, 6.9), (1.5, -6.9, 1.0), (2.0, 5.0, 6.0), (1.5, 1.0, -7.2)]
        {
            let (force_n, status) = pressed(fit_level, depth_mm, [x, y]);
            let contact = status.contact;
            let sensed_n: f64 = contact.force.0.to_num();
            let name = format!("{fit_level:?}, {depth_mm} mm deep at {x}, {y}: {sensed_n} of {force_n} N");
            assert!((sensed_n - force_n).abs() <= 0.01 * force_n + 0.005, "{name}, {}", contact.confidence);
            assert!((CONFIDENCE_LEAST..255).contains(&contact.confidence), "{name}, {}", contact.confidence);
        }
    }
}

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
