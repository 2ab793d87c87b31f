//! The loop closed over a finger: it approaches, holds 1 N and 2 N, and lets go.

use super::finger::Finger;
use fingertip::contact::FitLevel;
use fingertip::pipeline::Status;
use fingertip::state::Mode;

/// Presses for so long: the true force stays within a share of the goal, and the centre within a way of where it is.
/// Gives the share of the force that the array does not see, and the last status.
fn presses<const ROWS: usize, const COLUMNS: usize>(
    finger: &mut Finger<ROWS, COLUMNS>,
    goal_mn: i32,
    seconds: f64,
    [share, off_mm]: [f64; 2],
) -> (f64, Status) {
    let ([least, most], status) = finger.hold(goal_mn, seconds);
    let goal = f64::from(goal_mn) * 1e-3;
    let seen = finger.pipeline.array().picture().force(finger.pipeline.config()).0.to_num::<f64>();
    let hidden = 1.0 - seen / finger.force_n();
    let centre = [status.contact.centre_x, status.contact.centre_y].map(|place| place.0.to_num::<f64>());
    println!(
        "{ROWS} x {COLUMNS}, {:?}: {goal} N held to {least:.4} .. {most:.4} N with {hidden:.3} hidden, centre \
         {centre:.2?} mm, confidence {}",
        finger.command.fit_level, status.contact.confidence
    );
    assert!(goal * (1.0 - share) < least && most < goal * (1.0 + share), "{least} .. {most} N");
    let is = [finger.setup.wall.centre_x_mm, finger.setup.wall.centre_y_mm];
    assert!(centre.iter().zip(is).all(|(found, place)| (found - place).abs() < off_mm), "{centre:?}");
    (hidden, status)
}

/// The whole run; the digest of every step.
fn run<const ROWS: usize, const COLUMNS: usize>(pitch_um: i32, fit_level: FitLevel) -> u64 {
    let mut finger = Finger::<ROWS, COLUMNS>::new(pitch_um, [0.0, 0.0], fit_level);
    finger.start();
    for goal_mn in [1_000, 2_000] {
        let (_, status) = presses(&mut finger, goal_mn, 0.6, [0.01, 0.05]);
        assert_eq!((status.contact.bad_taxels, status.contact.doubt), (0, 0));
    }
    finger.command.goal = fingertip::units::Newtons::ZERO;
    let status = finger.run(0.4);
    assert_eq!((status.mode, finger.force_n()), (Mode::Release, 0.0));
    finger.digest.value()
}

fn holds<const ROWS: usize, const COLUMNS: usize>(pitch_um: i32) {
    let digests = [(); 2].map(|()| run::<ROWS, COLUMNS>(pitch_um, FitLevel::OneRow));
    assert_eq!(digests[0], digests[1], "the same run twice");
    assert_ne!(run::<ROWS, COLUMNS>(pitch_um, FitLevel::AllRows), digests[0]);
}

#[test]
fn three_by_three() {
    holds::<3, 3>(4_000);
}

#[test]
fn three_by_five() {
    holds::<3, 5>(4_000);
}

#[test]
fn four_by_four() {
    holds::<4, 4>(3_500);
}

#[test]
fn eight_by_eight() {
    holds::<8, 8>(1_750);
}

#[test]
fn ten_by_ten() {
    holds::<10, 10>(1_500);
}

#[test]
fn sixteen_by_sixteen() {
    holds::<16, 16>(900);
}

#[test]
fn sixteen_by_thirty_two() {
    holds::<16, 32>(900);
}

/// A contact that reaches over the array's edge: what the array sees is too little, and the fit has to find the rest.
/// Gives the share of the force that the array does not see.
fn over_the_edge<const ROWS: usize, const COLUMNS: usize>(
    pitch_um: i32,
    centre_mm: [f64; 2],
    fit_level: FitLevel,
) -> f64 {
    let mut finger = Finger::<ROWS, COLUMNS>::new(pitch_um, centre_mm, fit_level);
    finger.start();
    let hidden = [1_000, 2_000].map(|goal_mn| {
        let (hidden, status) = presses(&mut finger, goal_mn, 0.8, [0.03, 0.15]);
        assert!(status.contact.confidence > 200, "{}", status.contact.confidence);
        hidden
    });
    hidden[1]
}

#[test]
fn the_fit_finds_what_an_edge_hides() {
    for fit_level in [FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
        let hidden = [
            over_the_edge::<8, 8>(1_500, [4.5, 0.0], fit_level),
            over_the_edge::<8, 8>(1_500, [-2.0, -4.0], fit_level),
            over_the_edge::<16, 16>(750, [4.5, 1.0], fit_level),
            over_the_edge::<16, 32>(700, [9.0, -4.0], fit_level),
            over_the_edge::<9, 7>(1_500, [-3.5, 4.5], fit_level),
        ];
        assert!(hidden.iter().all(|hidden| (0.1..0.6).contains(hidden)), "{hidden:?}");
    }
}
