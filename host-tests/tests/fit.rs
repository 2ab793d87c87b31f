//! The contact from tactile images: the named hard cases, small samples of what `cargo xtask fit` judges at length, and
//! the work of a fit, spread over frames.

use crate::common::*;
use fingertip::contact::CONFIDENCE_LEAST;
use host_tests::fit_statistics::{BAD, CUT_MIN, FRAMES, GOOD, Judged, Outcome, Series, WAYS, judge, quantile};
use images::picture;
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
    let ways = all_ways(&picture, &scene.config());
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

/// An image that is full everywhere, and checkerboards.
#[test]
fn what_no_contact_makes_is_flagged() {
    let board = |high| core::array::from_fn(|row| core::array::from_fn(|column| high * ((row + column) as i32 & 1)));
    let full = ([[FULL; COLUMNS]; ROWS], CONFIDENCE_LEAST - 1);
    for (taxels, most) in [full, (board(40 * 16), 0), (board(1000 * 16), 0), (board(FULL), 0)] {
        for contact in &all_ways(&picture(&taxels, NONE), &config())[BY_MODEL..] {
            assert!(contact.confidence <= most, "{} beside {}: {contact:?}", taxels[0][1], taxels[0][0]);
        }
    }
}

/// Centred on a corner, half a radius beyond the edge, and over ten dead taxels in the middle.
#[test]
fn a_contact_of_which_much_is_hidden_is_found() {
    for (pitch_mm, d_mm) in [1.27, 1.5, 2.0].into_iter().flat_map(|pitch_mm| [3.0, 5.0].map(|d_mm| (pitch_mm, d_mm))) {
        let corner = 5.0 * pitch_mm;
        for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            holds(&plane(pitch_mm, d_mm, x * corner, y * corner), NONE);
        }
    }
    for (pitch_mm, d_mm) in [(1.27, 1.0), (1.27, 5.0), (1.5, 2.0), (2.0, 3.0)] {
        let beyond = 5.0 * pitch_mm + 0.5 * host_tests::fit_cases::contact_radius_mm(d_mm);
        holds(&plane(pitch_mm, d_mm, beyond, 0.7), NONE);
        holds(&plane(pitch_mm, d_mm, -1.3, -beyond), NONE);
    }
    let mut bad = NONE;
    bad[4..6].fill(0b00_1111_1000);
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
    judge(series, CASES, &|_| {})
}

fn values(judged: &Judged, way: usize, of: fn(&Outcome) -> f64) -> impl Iterator<Item = f64> {
    judged.iter().map(move |verdict| of(&verdict.outcomes[way]))
}

/// Noise of 1 % has a wider bound of the force and none of the centre.
#[test]
fn good_contacts_are_within_their_bounds_but_not_exact() {
    let [clean, dead, _, noise, noise_dead, _] = GOOD;
    for series in [clean, dead, noise, noise_dead] {
        let (judged, noisy) = (judged(&series), series.reading.noise != Noise::None);
        let errors: [fn(&Outcome) -> f64; 2] = [|outcome| outcome.force, |outcome| outcome.centre];
        for (way, of) in
            [TWO, FIT].into_iter().flat_map(|way| errors.map(|of| (way, of))).step_by(1 + usize::from(noisy))
        {
            let [middle, worst] = [0.5, 1.0].map(|share| quantile(values(&judged, way, of), share));
            assert!((0.1..=1.0).contains(&worst), "{} by way {way}: {worst}", series.name);
            assert!((0.01..0.2).contains(&middle), "{} by way {way}: {middle}", series.name);
        }
        if noisy {
            let alarms = (1..WAYS).map(|way| judged.iter().filter(|verdict| verdict.outcomes[way].flagged).count());
            let alarms = alarms.max();
            assert!(alarms <= Some(CASES / 100), "{}: {alarms:?} false alarms of {CASES}", series.name);
        } else {
            let sum_over = values(&judged, MOMENTS, errors[0]).filter(|force| *force > 1.0).count();
            assert!(sum_over > CASES * 8 / 10, "the sum is beyond its bound in {sum_over} of {CASES} only");
        }
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

/// A contact that reaches over the edge.
fn cut_off(d_mm: f64) -> Scene {
    plane(1.5, d_mm, 6.0, 1.0)
}

fn image(scene: &Scene) -> TactileImage {
    still(scene, NONE).0
}

#[test]
fn a_refinement_ends_in_its_frame_and_another_effort_begins_anew() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    let levels = [(FitLevel::OneRow, 11), (FitLevel::TwoRows, 6), (FitLevel::FiveRows, 3), (FitLevel::AllRows, 1)];
    for before in 0..11 {
        for (fit_level, frames) in levels {
            let mut fit = Fit::new(if before == 0 { fit_level } else { FitLevel::OneRow });
            read_often(&mut fit, &picture, before, &config);
            fit.set_fit_level(fit_level);
            let expected = if fit_level == FitLevel::OneRow { 11 - before } else { frames };
            let refined = (1..100).find(|_| fit.read(&picture, &config).confidence < 255);
            assert_eq!(refined, Some(expected), "{fit_level:?} after {before} frames");
        }
    }
}

#[test]
fn what_was_found_is_kept_by_another_effort_and_goes_with_the_contact() {
    let (config, picture) = (config(), image(&cut_off(1.5)));
    let sums = from_sums(&picture, &config);
    let full = self::picture(&[[FULL; COLUMNS]; ROWS], NONE);
    let mut fit = Fit::new(FitLevel::AllRows);
    let found = read_often(&mut fit, &picture, 21, &config);
    assert!(found.force > sums.force);
    fit.set_fit_level(FitLevel::OneRow);
    for _ in 0..10 {
        assert_eq!(fit.read(&picture, &config).force, found.force);
    }
    // The same contact, the largest one, and the same again are read as by a fit that has seen none before.
    for next in [&picture, &full, &picture] {
        assert_eq!(fit.read(&TactileImage::EMPTY, &config), Contact { confidence: 255, ..Contact::default() });
        let mut fresh = Fit::new(FitLevel::OneRow);
        for frame in 0..FRAMES {
            let contact = fit.read(next, &config);
            assert_eq!(contact, fresh.read(next, &config));
            assert!(frame > 0 || contact.force == from_sums(next, &config).force, "at first a contact is its sum");
        }
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
        let (picture, _) = seen(&scene, 0.1, NONE, &mut rng);
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
