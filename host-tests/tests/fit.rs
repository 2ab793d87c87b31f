//! The contact from pictures: the named hard cases, and small samples of what `cargo xtask fit` judges at length.

use crate::common::*;
use fingertip::contact::{CONFIDENCE_LEAST, from_sums};
use host_tests::fit_cases::picture;
use host_tests::fit_statistics::{BAD, CUT_MIN, FRAMES, GOOD, Judged, Outcome, Series, WAYS, judge, quantile};
use images::single::{Refined, read};

/// A converter that gives its smallest and its largest code, in sixteenths.
const FULL: i32 = 4095 * 16;
const NONE: [u32; ROWS] = [0; ROWS];
/// Indices of the reading methods in a verdict.
const MOMENTS: usize = 0;
const TWO: usize = 2;
const FIT: usize = WAYS - 1;

type Taxels = [[i32; COLUMNS]; ROWS];

/// Contacts of a tactile image by each fit level once it has settled, and by each single-frame method; the sums first.
fn all_ways(picture: &TactileImage, config: &Config) -> Vec<Contact> {
    let followed = |fit_level| read_often(&mut Fit::new(fit_level), picture, FRAMES, config);
    let looks = Refined::ALL.map(|refined| read(picture, refined, config));
    FitLevel::ALL.map(followed).into_iter().chain(looks).collect()
}

/// Methods of [`all_ways`] that use the model.
const BY_MODEL: usize = FitLevel::OneRow as usize;

fn newtons(force: Newtons) -> f64 {
    force.0.to_num()
}

fn mm(length: Millimetres) -> f64 {
    length.0.to_num()
}

/// Checks force and centre of a tactile image for two refinements, and for each fit level after many frames.
fn holds(scene: &Scene, bad: [u32; ROWS]) {
    let (picture, seen) = still(scene, bad);
    assert!(seen >= 12, "{seen} taxels see {scene:?}");
    let config = scene.config();
    let ways = all_ways(&picture, &config);
    let one = FitLevel::ALL.len() + Refined::One as usize;
    for (way, contact) in ways.iter().enumerate().skip(BY_MODEL).filter(|(way, _)| *way != one) {
        let outcome = Outcome::of(contact, scene, false);
        assert!(outcome.force <= 1.0 && outcome.centre <= 1.0 && !outcome.flagged, "way {way}, {scene:?}: {outcome:?}");
    }
    let sum = Outcome::of(&ways[FitLevel::Sum as usize], scene, false);
    assert!(sum.force > 5.0, "the sum alone is right as well: {scene:?}");
}

#[test]
fn nothing_is_no_contact() {
    let saturated = picture(&[[FULL; COLUMNS]; ROWS], [(1 << COLUMNS) - 1; ROWS]);
    for (picture, bad_taxels) in [(TactileImage::EMPTY, 0), (saturated, 100)] {
        for contact in all_ways(&picture, &config()) {
            assert_eq!(contact, Contact { confidence: 255, bad_taxels, ..Contact::default() });
        }
    }
}

#[test]
fn one_taxel_is_its_own_sum() {
    let config = config();
    for (row, column) in [(0, 0), (0, 5), (4, 5), (9, 9)] {
        let mut taxels = Taxels::default();
        taxels[row][column] = 300 * 16;
        let picture = picture(&taxels, NONE);
        for contact in all_ways(&picture, &config) {
            // 300 codes at 24 codes/kPa on 1.5 mm squared.
            assert!((newtons(contact.force) - 0.028_125).abs() < 1e-4, "{row} {column}: {contact:?}");
            assert!(mm(contact.centre_x).abs() <= 6.75 + 1e-6 && mm(contact.centre_y).abs() <= 6.75 + 1e-6);
        }
    }
}

#[test]
fn full_everywhere_is_flagged() {
    let picture = picture(&[[FULL; COLUMNS]; ROWS], NONE);
    for contact in &all_ways(&picture, &config())[BY_MODEL..] {
        assert!(contact.confidence < CONFIDENCE_LEAST, "{contact:?}");
    }
}

#[test]
fn a_checkerboard_is_flagged() {
    for high in [40 * 16, 1000 * 16, FULL] {
        let taxels = core::array::from_fn(|row| core::array::from_fn(|column| high * ((row + column) as i32 & 1)));
        for contact in &all_ways(&picture(&taxels, NONE), &config())[BY_MODEL..] {
            assert_eq!(contact.confidence, 0, "{high}: {contact:?}");
        }
    }
}

#[test]
fn frames_between_the_extremes_leave_nothing_behind() {
    let config = config();
    let full = picture(&[[FULL; COLUMNS]; ROWS], NONE);
    let mut fit = Fit::default();
    for _ in 0..100 {
        let contact = fit.read(&full, &config);
        assert_eq!(contact.force, from_sums(&full, &config).force, "the first frame of a contact is its sum");
        assert_eq!(fit.read(&TactileImage::EMPTY, &config), Contact { confidence: 255, ..Contact::default() });
    }
    // A real contact after them is read as if they had not occurred.
    let scene = plane(1.5, 2.0, 6.0, 0.0);
    let (picture, _) = still(&scene, NONE);
    let mut fresh = Fit::default();
    for _ in 0..FRAMES {
        assert_eq!(fit.read(&picture, &config), fresh.read(&picture, &config));
    }
}

#[test]
fn a_contact_centred_on_a_corner_is_found() {
    for pitch_mm in [1.27, 1.5, 2.0] {
        let corner = 5.0 * pitch_mm;
        for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            for d_mm in [3.0, 5.0] {
                holds(&plane(pitch_mm, d_mm, x * corner, y * corner), NONE);
            }
        }
    }
}

#[test]
fn a_contact_centred_half_a_radius_beyond_the_edge_is_found() {
    for (pitch_mm, d_mm) in [(1.27, 1.0), (1.27, 5.0), (1.5, 2.0), (2.0, 3.0)] {
        let beyond = 5.0 * pitch_mm + 0.5 * host_tests::fit_cases::contact_radius_mm(d_mm);
        holds(&plane(pitch_mm, d_mm, beyond, 0.7), NONE);
        holds(&plane(pitch_mm, d_mm, -1.3, -beyond), NONE);
    }
}

#[test]
fn ten_dead_taxels_under_the_contact_are_filled_in() {
    // The ten in the middle, where the sum loses most.
    let mut bad = NONE;
    (bad[4], bad[5]) = (0b00_1111_1000, 0b00_1111_1000);
    for (pitch_mm, d_mm) in [(1.27, 1.5), (1.5, 2.5), (2.0, 5.0)] {
        holds(&plane(pitch_mm, d_mm, 0.3, -0.2), bad);
    }
}

#[test]
fn a_contact_that_grows_in_over_the_edge_is_never_taken_for_a_much_larger_one() {
    // With seven taxels in sight, a deep contact far beyond the edge looks almost like this one.
    for (x_mm, y_mm) in [(-7.974, 1.681), (-9.251, -1.865), (7.0, 7.0)] {
        let mut scene = plane(1.27, 0.0, x_mm, y_mm);
        let config = scene.config();
        let mut fit = Fit::default();
        let mut seen_12 = 0;
        for frame in 1..=6_000 {
            scene.d_mm = 0.1 + 0.3e-3 * f64::from(frame);
            let (picture, seen) = still(&scene, NONE);
            let contact = fit.read(&picture, &config);
            let (found, truth) = (newtons(contact.force), scene.force_n());
            assert!(found < 2.0 * truth + 0.02, "{found} N for {truth} N, {seen} taxels, {scene:?}");
            seen_12 = if seen >= 12 { seen_12 + 1 } else { 0 };
            // Rim alone, and moving: wider than the bound of a contact at rest.
            if seen_12 > 2 * FRAMES {
                assert!((found - truth).abs() < 0.04 * truth + 0.01, "{found} N for {truth} N, {scene:?}");
            }
        }
        assert!(seen_12 > 2 * FRAMES, "too few taxels ever see {scene:?}");
    }
}

#[test]
fn a_covered_contact_keeps_its_sum() {
    let scene = plane(1.5, 1.5, 0.4, -0.8);
    let (picture, _) = still(&scene, NONE);
    let config = scene.config();
    let sums = from_sums(&picture, &config);
    for contact in &all_ways(&picture, &config)[1..] {
        assert_eq!(Contact { confidence: 255, ..*contact }, sums);
        // The quick model of the rim leaves a residual, but a small one.
        assert!((200..=255).contains(&contact.confidence), "{}", contact.confidence);
    }
}

#[test]
fn one_code_near_no_force_moves_the_indentation_by_what_is_documented() {
    let scene = plane(2.0, 1.0, 0.0, 0.0);
    let config = scene.config();
    let mut largest: f64 = 0.0;
    for ((row, column), code) in places().flat_map(|place| [(place, -16), (place, 16)]) {
        let mut taxels = Taxels::default();
        taxels[row][column] = code;
        for contact in all_ways(&picture(&taxels, NONE), &config) {
            largest = largest.max(mm(contact.indentation));
            assert_eq!((contact.centre_x, contact.centre_y), (Millimetres::ZERO, Millimetres::ZERO));
            assert_eq!(contact.confidence, 255);
        }
    }
    // sqrt(h^2 / (24 codes/kPa pi Y)) = 14.6 um for h = 2 mm; the force is rounded down to 1/65536 N before.
    assert!((0.0135..=0.0147).contains(&largest), "{largest} mm");
}

const CASES: usize = 200;

fn judged(series: &Series) -> Judged {
    judge(series, CASES, FitLevel::default(), &|_| {})
}

fn values(judged: &Judged, way: usize, of: fn(&Outcome) -> f64) -> impl Iterator<Item = f64> {
    judged.iter().map(move |verdict| of(&verdict.outcomes[way]))
}

#[test]
fn good_contacts_are_within_their_bounds_but_not_exact() {
    let [clean, dead, ..] = GOOD;
    for series in [clean, dead] {
        let judged = judged(&series);
        for way in [TWO, FIT] {
            for (of, median) in [(force as fn(&Outcome) -> f64, 0.01..0.2), (centre, 0.01..0.2)] {
                let worst = quantile(values(&judged, way, of), 1.0);
                assert!((0.1..=1.0).contains(&worst), "{} by way {way}: {worst}", series.name);
                let middle = quantile(values(&judged, way, of), 0.5);
                assert!(median.contains(&middle), "{} by way {way}: {middle}", series.name);
            }
        }
        let sum_over = values(&judged, MOMENTS, force).filter(|force| *force > 1.0).count();
        assert!(sum_over > CASES * 8 / 10, "the sum is beyond its bound in {sum_over} of {CASES} only");
    }
}

#[test]
fn noise_of_one_percent_stays_within_the_wider_bound() {
    let [.., noise, noise_dead, _] = GOOD;
    for series in [noise, noise_dead] {
        let judged = judged(&series);
        for way in [TWO, FIT] {
            let over = values(&judged, way, force).filter(|force| *force > 1.0).count();
            let middle = quantile(values(&judged, way, force), 0.5);
            assert!(over == 0 && (0.01..0.2).contains(&middle), "{} by way {way}: {over}, {middle}", series.name);
        }
        let alarms = (1..WAYS).map(|way| judged.iter().filter(|verdict| verdict.outcomes[way].flagged).count()).max();
        assert!(alarms <= Some(CASES / 100), "{}: {alarms:?} false alarms of {CASES}", series.name);
    }
}

#[test]
fn what_is_no_hemisphere_on_a_plane_is_flagged() {
    for series in BAD {
        let judged = judged(&series);
        for way in 1..WAYS {
            let missed = judged.iter().filter(|verdict| !verdict.outcomes[way].flagged).count();
            assert!(missed <= CASES / 100, "{} by way {way}: {missed} of {CASES} missed", series.name);
        }
        assert!(judged.iter().all(|verdict| verdict.case.cut == 0.0 || verdict.case.cut >= CUT_MIN));
    }
}

fn force(outcome: &Outcome) -> f64 {
    outcome.force
}

fn centre(outcome: &Outcome) -> f64 {
    outcome.centre
}

/// A code of 4095 with the largest sag and the largest gain, in sixteenths; a tare can be as large.
const LARGEST: i32 = 4095 * 2 * 2 * 16;

fn any_config() -> impl Strategy<Value = Config> {
    let ends_or = |low: i32, high: i32| prop_oneof![Just(low), Just(high), low..=high];
    let fingers = (ends_or(500, 4_000), ends_or(4_000, 16_000), ends_or(20_000, 2_000_000), ends_or(1_000, 200_000));
    (fingers, ends_or(1, 14)).prop_filter_map(
        "the converter sees the least contacts",
        |((pitch_um, tip_radius_um, modulus_pa, codes_per_kpa_milli), contact_off_mn)| {
            let params =
                Params { pitch_um, tip_radius_um, modulus_pa, codes_per_kpa_milli, contact_off_mn, ..Params::DEFAULT };
            Config::shipped(&params).ok()
        },
    )
}

/// All of one kind: an even level, extremes, small values, anything, or a few spikes.
fn any_picture() -> impl Strategy<Value = TactileImage> {
    let extremes = prop_oneof![Just(-LARGEST), Just(0), Just(LARGEST), Just(16), Just(1)];
    let taxel = prop_oneof![
        3 => Just(None),
        1 => extremes.clone().prop_map(Some),
        1 => (-40..400).prop_map(Some),
        1 => (-LARGEST..=LARGEST).prop_map(Some),
    ];
    let level = prop_oneof![extremes, 0..LARGEST, -40..4_000];
    let spikes = proptest::collection::vec(taxel, ROWS * COLUMNS);
    let bad = prop_oneof![3 => Just([0; ROWS]), 1 => proptest::array::uniform10(0..1_u32 << COLUMNS)];
    (level, prop::bool::ANY, spikes, bad).prop_map(|(level, even, spikes, bad)| {
        let taxels = core::array::from_fn(|row| {
            core::array::from_fn(|column| if even { level } else { spikes[row * COLUMNS + column].unwrap_or(level) })
        });
        picture(&taxels, bad)
    })
}

fn in_range(contact: &Contact, config: &Config) {
    let radius = config.tip.radius();
    // A fit's centre stays within a tip radius of the array.
    let farthest = config.half_pitch.0.to_num::<f64>() * COLUMNS as f64 + radius.0.to_num::<f64>() + 1e-3;
    assert!(contact.force.to_bits() >= 0, "{contact:?}");
    assert!(contact.indentation.to_bits() >= 0 && contact.indentation < radius, "{contact:?}");
    assert!(contact.radius.to_bits() >= 0 && contact.radius <= radius, "{contact:?}");
    for centre in [contact.centre_x, contact.centre_y] {
        assert!(centre.0.to_num::<f64>().abs() <= farthest, "{contact:?}");
    }
}

proptest! {
    #![proptest_config(seeded(1_500, 2003))]

    #[test]
    fn any_pictures_are_read(config in any_config(), pictures in proptest::collection::vec(any_picture(), 1..4)) {
        let mut fits = FitLevel::ALL.map(Fit::new);
        for picture in &pictures {
            for refined in Refined::ALL {
                in_range(&read(picture, refined, &config), &config);
            }
            // Not a whole number of refinements, so that an image meets a guess from another image.
            for _ in 0..19 {
                for fit in &mut fits {
                    in_range(&fit.read(picture, &config), &config);
                }
            }
        }
    }
}
