//! How far a force is known only from below: by the sums, by a fit, and from frame to frame.

use fastrand::Rng;
use fingertip::contact::Contact;
use fingertip::contact::{FitLevel, from_sums};
use fingertip::shipped::{Fit, Picture, ROWS};
use fingertip::units::Millimetres;
use host_tests::finger::config;
use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps};

const NONE: [u32; ROWS] = [0; ROWS];
/// The reference array's.
const PITCH_MM: f64 = 1.5;

fn mm(length: Millimetres) -> f64 {
    length.0.to_num()
}

/// A plane contact, with what its taxels differ by.
fn plane(d_mm: f64, [x_mm, y_mm]: [f64; 2], spread: f64, bad: [u32; ROWS], rng: &mut Rng) -> Picture {
    let scene = Scene { pitch_mm: PITCH_MM, d_mm, x_mm, y_mm, object: Object::Plane };
    let noise = if spread > 0.0 { Noise::OfReading(spread) } else { Noise::None };
    Reading { steps: Steps::Sixteenths, noise, dead: 0 }.picture(&scene.pressures(), bad, rng).0
}

/// 0 up to `from`, 255 from `to` on.
fn ramp(value: f64, from: f64, to: f64) -> f64 {
    255.0 * ((value - from) / (to - from)).clamp(0.0, 1.0)
}

/// How near the nearest bad taxel is to a contact's centre.
fn nearest_bad_mm(contact: &Contact, bad: &[u32; ROWS]) -> f64 {
    let place = |index: usize| (index as f64 - 4.5) * PITCH_MM;
    let bad = (0..ROWS * 10).filter(|taxel| bad[taxel / 10] >> (taxel % 10) & 1 != 0);
    let apart =
        bad.map(|taxel| (place(taxel % 10) - mm(contact.centre_x)).hypot(place(taxel / 10) - mm(contact.centre_y)));
    apart.fold(f64::INFINITY, f64::min)
}

/// None while the sums' rim is within half a pitch beyond the edge, all from a pitch and a half on; and where a bad
/// taxel lies nearer to the centre than the rim and three quarters of a pitch.
#[test]
fn sums_are_doubted_by_what_reaches_over_the_edge_or_is_hidden() {
    let config = config();
    let mut rng = Rng::with_seed(1);
    let mut kinds = [0; 4];
    for _ in 0..4_000 {
        let mut bad = NONE;
        for _ in 0..rng.usize(..3) {
            bad[rng.usize(..ROWS)] |= 1 << rng.u32(..10);
        }
        let centre = [rng.f64() * 14.0 - 7.0, rng.f64() * 14.0 - 7.0];
        let picture = plane(0.1 + 2.0 * rng.f64(), centre, 0.0, bad, &mut rng);
        let contact = Fit::new(FitLevel::Moments).read(&picture, &config);
        assert_eq!(Contact { doubt: 0, ..contact }, from_sums(&picture, &config));
        let sum = Fit::new(FitLevel::Sum).read(&picture, &config);
        assert_eq!((sum.doubt, sum.centre_x, sum.centre_y), (contact.doubt, Millimetres::ZERO, Millimetres::ZERO));
        let reach_mm = mm(contact.centre_x).abs().max(mm(contact.centre_y).abs()) + mm(contact.radius);
        let doubt = f64::from(contact.doubt);
        let hides_by_mm = mm(contact.radius) + 0.75 * PITCH_MM - nearest_bad_mm(&contact, &bad);
        if contact.force < config.contact_off {
            assert_eq!(contact.doubt, 0);
        } else if hides_by_mm > 1e-4 {
            kinds[0] += 1;
            assert_eq!(contact.doubt, 255, "{hides_by_mm} mm, {contact:?}");
        } else if hides_by_mm < -1e-4 {
            let expected = ramp(reach_mm - 5.0 * PITCH_MM, 0.5 * PITCH_MM, 1.5 * PITCH_MM);
            assert!((doubt - expected).abs() <= 1.01, "{doubt}, {expected} expected: {contact:?}");
            kinds[1 + usize::from(contact.doubt > 0) + usize::from(contact.doubt == 255)] += 1;
        }
    }
    assert!(kinds.iter().all(|kind| *kind > 100), "{kinds:?}");
}

/// A fit at rest is doubted for how much is hidden, from a ratio of 5/4 to 7/4, times how little it is like, from a
/// confidence of 160 to
/// 96. Its own doubt then stands still to the last bit.
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
        let mut contact = Contact::default();
        for _ in 0..700 {
            contact = fit.read(&picture, &config);
        }
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
        let unsure = 6.0;
        assert!((doubt - expected).abs() <= unsure, "{doubt}, {expected} expected: ratio {ratio}, {contact:?}");
        kinds[usize::from(expected > 0.0) + 2 * usize::from((1.0..254.0).contains(&unlike))] += 1;
    }
    println!("{kinds:?}");
    assert!(kinds[0] > 50 && kinds[1] > 10 && kinds[3] > 10, "{kinds:?}");
}

/// An eighth of the way up in each frame, a 64th of the way down.
#[test]
fn doubt_comes_in_some_eight_frames_and_goes_in_some_sixty() {
    let config = config();
    let mut rng = Rng::with_seed(3);
    let mut hidden = NONE;
    (hidden[4], hidden[5]) = (0b11_1111, 0b11_1111);
    // Until the first refinement it goes by the sums: of these, a bad taxel hides a part.
    let doubtful = plane(1.5, [0.0, 0.0], 0.0, hidden, &mut rng);
    let mut fit = Fit::new(FitLevel::OneRow);
    let mut doubt = 0.0;
    for frame in 0..10 {
        doubt += (255.0 - doubt) / 8.0;
        let found = f64::from(fit.read(&doubtful, &config).doubt);
        assert!((found - doubt).abs() <= 1.0, "{found}, {doubt} expected in frame {frame}");
    }
    // The same contact in full sight: once the refinement under way is over, nothing is doubted.
    let seen = plane(1.5, [0.0, 0.0], 0.0, NONE, &mut rng);
    let before: Vec<_> = (0..30).map(|_| fit.read(&seen, &config).doubt).collect();
    let mut doubt = f64::from(before[29]);
    assert!(doubt > 100.0, "{before:?}");
    for frame in 0..300 {
        doubt -= doubt / 64.0;
        let found = f64::from(fit.read(&seen, &config).doubt);
        assert!((found - doubt).abs() <= 1.5, "{found}, {doubt} expected in frame {frame}");
    }
    for _ in 0..400 {
        fit.read(&seen, &config);
    }
    assert_eq!(fit.read(&seen, &config).doubt, 0, "it goes to the last bit");
    // Without a contact nothing is doubted, from the first frame on.
    for _ in 0..10 {
        fit.read(&doubtful, &config);
    }
    assert_eq!(fit.read(&Picture::EMPTY, &config).doubt, 0);
}
