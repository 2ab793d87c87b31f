//! Uncertainty of a force of which only a lower bound is known: by the sums, by a fit, and from frame to frame.

use crate::common::*;
use core::f64::consts::PI;

const NONE: [u32; ROWS] = [0; ROWS];
/// The reference array's.
const PITCH_MM: f64 = 1.5;

fn mm(length: Millimetres) -> f64 {
    length.0.to_num()
}

/// Tactile image of a plane contact with a spread of the taxel gains.
fn plane(d_mm: f64, [x_mm, y_mm]: [f64; 2], spread: f64, bad: [u32; ROWS], rng: &mut Rng) -> TactileImage {
    seen(&crate::common::plane(PITCH_MM, d_mm, x_mm, y_mm), spread, bad, rng).0
}

/// 0 up to `from`, 255 from `to` on.
fn ramp(value: f64, from: f64, to: f64) -> f64 {
    255.0 * ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// The least and the largest share of a contact's force that bad taxels hide, where the pressure is a parabola over the
/// contact's radius, and every length may be off by the core's resolution.
fn hidden_shares(contact: &Contact, bad: &[u32; ROWS]) -> [f64; 2] {
    const UNIT_MM: f64 = 1.0 / 64.0;
    let place = |index: usize| (index as f64 - 4.5) * PITCH_MM;
    let share = |farther_mm: f64, radius_mm: f64| {
        let square = radius_mm.powi(2);
        let bad = (0..ROWS * 10).filter(|taxel| bad[taxel / 10] >> (taxel % 10) & 1 != 0);
        let shares = bad.map(|taxel| {
            let away = |place_mm: f64, centre: Millimetres| ((place_mm - mm(centre)).abs() + farther_mm).max(0.0);
            let (x, y) = (away(place(taxel % 10), contact.centre_x), away(place(taxel / 10), contact.centre_y));
            2.0 * PITCH_MM * PITCH_MM * (1.0 - (x * x + y * y) / square).max(0.0) / (PI * square)
        });
        shares.sum::<f64>()
    };
    let radii = [mm(contact.radius) - UNIT_MM, mm(contact.radius) + UNIT_MM];
    let least = radii.map(|radius_mm| share(UNIT_MM, radius_mm));
    let most = radii.map(|radius_mm| share(-UNIT_MM, radius_mm));
    [least[0].min(least[1]), most[0].max(most[1])]
}

/// Uncertainty of the sums, by a fit level without the model.
fn doubt_of_sums(picture: &TactileImage) -> u8 {
    Fit::new(FitLevel::Moments).read(picture, &config()).doubt
}

/// None while the sums' rim is within half a pitch beyond the edge, all from a pitch and a half on; none while bad
/// taxels hide an eighth of the force, all from half of it on. The larger of the two counts.
#[test]
fn sums_are_doubted_by_what_reaches_over_the_edge_or_is_hidden() {
    let config = config();
    let mut rng = Rng::with_seed(1);
    let mut kinds = [[0; 3]; 3];
    for _ in 0..8_000 {
        let mut bad = NONE;
        let most = if rng.bool() { 4 } else { 60 };
        for _ in 0..rng.usize(..most) {
            bad[rng.usize(..ROWS)] |= 1 << rng.u32(..10);
        }
        let centre = [rng.f64() * 14.0 - 7.0, rng.f64() * 14.0 - 7.0];
        let picture = plane(0.1 + 2.0 * rng.f64().powi(2), centre, 0.0, bad, &mut rng);
        let contact = Fit::new(FitLevel::Moments).read(&picture, &config);
        assert_eq!(Contact { doubt: 0, ..contact }, from_sums(&picture, &config));
        let sum = Fit::new(FitLevel::Sum).read(&picture, &config);
        assert_eq!((sum.doubt, sum.centre_x, sum.centre_y), (contact.doubt, Millimetres::ZERO, Millimetres::ZERO));
        if contact.force < config.contact_off {
            assert_eq!(contact.doubt, 0);
            continue;
        }
        let reach_mm = mm(contact.centre_x).abs().max(mm(contact.centre_y).abs()) + mm(contact.radius);
        let over = ramp(reach_mm - 5.0 * PITCH_MM, 0.5 * PITCH_MM, 1.5 * PITCH_MM);
        let [least_hidden, hidden] = hidden_shares(&contact, &bad).map(|share| ramp(share, 0.125, 0.5));
        let doubt = f64::from(contact.doubt);
        // The share and its factors are rounded down to 1/256, so it may be too small: by 2/256 of 96/256.
        let least = over.max(least_hidden - 2.0 * 255.0 / 96.0);
        let allowed = least - 1.01..=over.max(hidden) + 1.01;
        assert!(allowed.contains(&doubt), "{doubt}, {allowed:?} expected: {contact:?}");
        let kind = |doubt: f64| usize::from(doubt > 0.0) + usize::from(doubt == 255.0);
        kinds[kind(over)][kind(hidden)] += 1;
    }
    // Each of the two alone: none, a part, all; and parts of both.
    let [[none, part_hidden, all_hidden], [part_over, both, _], [all_over, ..]] = kinds;
    assert!([none, part_hidden, all_hidden, part_over, all_over].iter().all(|kind| *kind > 100), "{kinds:?}");
    assert!(both > 10, "{kinds:?}");
}

/// A flickering taxel hides at most a twentieth of a contact of 2 mm: the uncertainty stays 0 at every fit level.
#[test]
fn a_taxel_that_flickers_under_a_contact_makes_no_doubt() {
    let config = config();
    let mut rng = Rng::with_seed(6);
    for fit_level in FitLevel::ALL {
        for _ in 0..100 {
            let centre = [rng.f64() * 3.0 - 1.5, rng.f64() * 3.0 - 1.5];
            let mut bad = NONE;
            bad[rng.usize(1..9)] = 1 << rng.u32(1..9);
            let pictures = [NONE, bad].map(|bad| plane(2.0, centre, 0.005, bad, &mut rng));
            let mut fit = Fit::new(fit_level);
            let share = rng.f64();
            for frame in 0..200 {
                let contact = fit.read(&pictures[usize::from(rng.f64() < share)], &config);
                assert_eq!(contact.doubt, 0, "{fit_level:?}, frame {frame}: {contact:?}");
            }
        }
    }
}

/// The uncertainty of a fit at rest is the product of two terms: the hidden share of the force, from a ratio of 5/4 to
/// 7/4, and the misfit, from a confidence of 160 down to 96. It then stays constant to the last bit.
#[test]
fn a_fit_is_doubted_by_what_is_hidden_and_how_unlike_it_is() {
    let config = config();
    let mut rng = Rng::with_seed(2);
    let mut kinds = [0; 4];
    for _ in 0..300 {
        let along = 4.0 + 5.0 * rng.f64();
        let spread = 0.06 * rng.f64();
        let picture = plane(1.0 + 2.0 * rng.f64(), [along, rng.f64() * 2.0], spread, NONE, &mut rng);
        let mut fit = Fit::new(FitLevel::AllRows);
        let contact = read_often(&mut fit, &picture, 700, &config);
        let force = |contact: &Contact| contact.force.0.to_num::<f64>();
        let ratio = force(&contact) / force(&from_sums(&picture, &config));
        if ratio < 1.000_1 {
            // By the sums, perhaps.
            continue;
        }
        let hidden = ramp(ratio, 1.25, 1.75);
        let unlike = 255.0 - ramp(contact.confidence.into(), 96.0, 160.0);
        let (doubt, expected) = (f64::from(contact.doubt), hidden * unlike / 255.0);
        // A confidence that goes to and fro by 1 makes 4 of it.
        assert!((doubt - expected).abs() <= 6.0, "{doubt}, {expected} expected: ratio {ratio}, {contact:?}");
        kinds[usize::from(expected > 0.0) + 2 * usize::from((1.0..254.0).contains(&unlike))] += 1;
    }
    assert!(kinds[0] > 50 && kinds[1] > 10 && kinds[3] > 10, "{kinds:?}");
}

/// In each frame the uncertainty rises by an eighth of its distance to the target, or falls by a 64th of it.
#[test]
fn doubt_comes_in_some_eight_frames_and_goes_in_some_sixty() {
    let config = config();
    let mut rng = Rng::with_seed(3);
    // Before the first refinement the sums give the uncertainty. Bad taxels hide a part of the contact, or nearly all.
    let (mut part, mut hidden) = (NONE, NONE);
    part[4..6].fill(0b11_1111);
    hidden[3..7].fill(0b111_1000);
    let pictures = [part, hidden].map(|bad| plane(1.5, [0.0, 0.0], 0.0, bad, &mut rng));
    let [target, all] = pictures.each_ref().map(|picture| f64::from(doubt_of_sums(picture)));
    assert!((100.0..200.0).contains(&target) && all == 255.0, "{target}, {all}");
    let mut fit = Fit::new(FitLevel::OneRow);
    for (picture, target) in pictures.iter().zip([target, all]) {
        fit = Fit::new(FitLevel::OneRow);
        let mut doubt = 0.0;
        for frame in 0..10 {
            doubt += (target - doubt) / 8.0;
            let found = f64::from(fit.read(picture, &config).doubt);
            assert!((found - doubt).abs() <= 1.0, "{found}, {doubt} expected in frame {frame}");
        }
    }
    let [_, doubtful] = pictures;
    // The same contact without bad taxels: after the present refinement the uncertainty is 0.
    let seen = plane(1.5, [0.0, 0.0], 0.0, NONE, &mut rng);
    let before: Vec<_> = (0..30).map(|_| fit.read(&seen, &config).doubt).collect();
    let mut doubt = f64::from(before[29]);
    assert!(doubt > 100.0, "{before:?}");
    for frame in 0..300 {
        doubt -= doubt / 64.0;
        let found = f64::from(fit.read(&seen, &config).doubt);
        assert!((found - doubt).abs() <= 1.5, "{found}, {doubt} expected in frame {frame}");
    }
    read_often(&mut fit, &seen, 400, &config);
    assert_eq!(fit.read(&seen, &config).doubt, 0, "it goes to the last bit");
    // Without a contact the uncertainty is 0 from the first frame on.
    read_often(&mut fit, &doubtful, 10, &config);
    assert_eq!(fit.read(&TactileImage::EMPTY, &config).doubt, 0);
}
