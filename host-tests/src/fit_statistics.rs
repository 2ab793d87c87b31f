//! The fit judged over many pictures with a known contact: how far off it is, and whom its confidence flags.
//!
//! Case number n of a series is drawn from n alone, so every fit level sees the very same pictures and the figures do
//! not depend on the number of threads.

use crate::fit_cases::{Noise, PITCHES_MM, Pressures, Reading, Scene, Steps};
use crate::page::Page;
use fastrand::Rng;
use fingertip::contact::{self, CONFIDENCE_LEAST, Contact, FitLevel};
use fingertip::shipped::{Config, Fit, TactileImage};
use images::single::{self, Refined};
use std::fmt::Write as _;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A contact that fewer live taxels see is not judged.
pub const TAXELS_MIN: usize = 12;
/// An edge that takes a smaller share of the force that the live taxels would see without it is not judged.
///
/// One reading's noise: whoever looks at the taxels with 1 % of noise cannot tell a smaller change of the seen force,
/// spread over the taxels, from noise.
pub const CUT_MIN: f64 = 0.01;
/// Methods to read a contact: the plain sum with the moments' centre, one image refined as often as [`Refined::ALL`]
/// says, and [`Fit`] over [`FRAMES`] pictures.
pub const WAYS: usize = 1 + Refined::ALL.len() + 1;
/// Frames, each with its own noise, that [`Fit`] sees of a case.
pub const FRAMES: usize = 90;

/// Pictures of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    pub name: &'static str,
    pub scene: fn(&mut Rng) -> Scene,
    /// Disturbances of the readings.
    pub reading: Reading,
}

const fn series(name: &'static str, scene: fn(&mut Rng) -> Scene, dead: usize, steps: Steps, noise: Noise) -> Series {
    Series { name, scene, reading: Reading { steps, noise, dead } }
}

/// Noise of 1 % of each reading.
const NOISE: Noise = Noise::OfReading(0.01);

/// Hemispheres on a plane.
pub const GOOD: [Series; 6] = [
    series("clean", Scene::good, 0, Steps::Sixteenths, Noise::None),
    series("10 dead", Scene::good, 10, Steps::Sixteenths, Noise::None),
    series("10 dead, floor", Scene::good, 10, Steps::Codes, Noise::None),
    series("noise", Scene::good, 0, Steps::Sixteenths, NOISE),
    series("noise, 10 dead", Scene::good, 10, Steps::Sixteenths, NOISE),
    series("noise of the peak", Scene::good, 0, Steps::Sixteenths, Noise::OfPeak(0.01)),
];

/// Contacts other than a hemisphere on a plane, with noise.
pub const BAD: [Series; 6] = [
    series("edge", Scene::edge, 0, Steps::Sixteenths, NOISE),
    series("edge, 10 dead", Scene::edge, 10, Steps::Sixteenths, NOISE),
    series("two contacts", Scene::two, 0, Steps::Sixteenths, NOISE),
    series("two contacts, 10 dead", Scene::two, 10, Steps::Sixteenths, NOISE),
    series("bent", Scene::bent, 0, Steps::Sixteenths, NOISE),
    series("bent, 10 dead", Scene::bent, 10, Steps::Sixteenths, NOISE),
];

/// One tactile image with its truth.
#[derive(Clone, Debug)]
pub struct Case {
    pub scene: Scene,
    pub pressures: Pressures,
    pub picture: TactileImage,
    /// Share of the seen force that an edge takes; 0 without one.
    pub cut: f64,
}

impl Series {
    /// Case `number` of the series. Draws with too few live taxels or too small a cut are skipped.
    pub fn case(&self, number: usize) -> Case {
        let mut rng = Rng::with_seed(0x5eed_0000_0000 + number as u64);
        loop {
            let scene = (self.scene)(&mut rng);
            let pressures = scene.pressures();
            let bad = self.reading.dead(&mut rng);
            let (picture, seen) = self.reading.picture(&pressures, bad, &mut rng);
            let cut = scene.cut(&pressures, &picture.bad);
            if seen >= TAXELS_MIN && cut.is_none_or(|cut| cut >= CUT_MIN) {
                return Case { scene, pressures, picture, cut: cut.unwrap_or(0.0) };
            }
        }
    }
}

/// The core's constants for the array of a case.
fn config(scene: &Scene) -> &'static Config {
    static CONFIGS: LazyLock<[Config; PITCHES_MM.len()]> =
        LazyLock::new(|| PITCHES_MM.map(|pitch_mm| Scene { pitch_mm, ..Scene::good(&mut Rng::with_seed(0)) }.config()));
    let place = PITCHES_MM.iter().position(|pitch_mm| *pitch_mm == scene.pitch_mm);
    &CONFIGS[place.expect("one of the arrays' pitches")]
}

/// Result of one reading method on one case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Error of the force in units of its bound.
    pub force: f64,
    /// Error of the centre in units of its bound, 0.05 mm.
    pub centre: f64,
    /// Confidence below [`CONFIDENCE_LEAST`].
    pub flagged: bool,
}

impl Outcome {
    /// Compares a reading with the truth of a plane contact.
    pub fn of(contact: &Contact, scene: &Scene, noisy: bool) -> Self {
        let truth = scene.force_n();
        let bound = if noisy { 0.03 * truth + 0.02 } else { 0.01 * truth + 0.005 };
        let apart =
            (contact.centre_x.0.to_num::<f64>() - scene.x_mm).hypot(contact.centre_y.0.to_num::<f64>() - scene.y_mm);
        Self {
            force: (contact.force.0.to_num::<f64>() - truth).abs() / bound,
            centre: apart / 0.05,
            flagged: contact.confidence < CONFIDENCE_LEAST,
        }
    }
}

/// A case and what came of it.
#[derive(Clone, Debug)]
pub struct Verdict {
    pub case: Case,
    /// Outcome of each reading method.
    pub outcomes: [Outcome; WAYS],
}

/// Verdicts on a series.
pub type Judged = Vec<Verdict>;

impl Verdict {
    /// Judges the case of this number.
    pub fn of(series: &Series, number: usize) -> Self {
        let case = series.case(number);
        let config = config(&case.scene);
        let noisy = series.reading.noise != Noise::None;
        let mut rng = Rng::with_seed(0xf7a3_0000_0000 + number as u64);
        let mut fit = Fit::default();
        let sums = Outcome::of(&contact::from_sums(&case.picture, config), &case.scene, noisy);
        let mut last = sums;
        for _ in 0..FRAMES {
            let (picture, _) = series.reading.picture(&case.pressures, case.picture.bad, &mut rng);
            last = Outcome::of(&fit.read(&picture, config), &case.scene, noisy);
        }
        let read = |refined| Outcome::of(&single::read(&case.picture, refined, config), &case.scene, noisy);
        let [one, two, full] = Refined::ALL.map(read);
        Self { case, outcomes: [sums, one, two, full, last] }
    }
}

/// The tip pressed in at `um_per_frame` to the indentation of a good case, on an array without noise: the largest error
/// of the force that [`Fit`] makes once enough taxels see the contact, in units of its bound, and that of the centre.
pub fn pressed(number: usize, um_per_frame: f64) -> Outcome {
    let [clean, ..] = GOOD;
    let mut scene = clean.case(number).scene;
    let (config, end) = (config(&scene), scene.d_mm);
    let mut rng = Rng::with_seed(number as u64);
    let mut fit = Fit::default();
    let mut worst = Outcome { force: 0.0, centre: 0.0, flagged: false };
    let mut settled = 0;
    scene.d_mm = 0.1;
    while scene.d_mm < end {
        let (picture, seen) = clean.reading.picture(&scene.pressures(), [0; fingertip::shipped::ROWS], &mut rng);
        let outcome = Outcome::of(&fit.read(&picture, config), &scene, false);
        settled = if seen < TAXELS_MIN || scene.d_mm < 0.3 { 0 } else { settled + 1 };
        if settled > FRAMES {
            worst.force = worst.force.max(outcome.force);
            worst.centre = worst.centre.max(outcome.centre);
            worst.flagged |= outcome.flagged;
        }
        scene.d_mm += 1e-3 * um_per_frame;
    }
    worst
}

/// Judges `cases` cases of a series on all threads. `progress` gets the number done.
pub fn judge(series: &Series, cases: usize, progress: &(impl Fn(usize) + Sync)) -> Judged {
    let done = AtomicUsize::new(0);
    sim::cores::map(0..cases, |number| {
        let verdict = Verdict::of(series, number);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1);
        verdict
    })
}

/// The value below which this share of the values lies.
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}

// The tables of `docs/contact.md`, from pictures judged by [`crate::fit_statistics`].

pub const PAGE: Page = Page { name: "docs/contact.md", tables: "tables", command: "cargo xtask fit --write" };
/// Cases a series where nothing else is asked.
pub const CASES: usize = 10_000;

/// All tables; `progress` gets a series' name and how many of its cases are done.
pub fn markdown(cases: usize, progress: &(impl Fn(&str, usize) + Sync)) -> String {
    let judged = |series: &Series| judge(series, cases, &|done| progress(series.name, done));
    let good: Vec<_> = GOOD.iter().map(|series| (series, judged(series))).collect();
    let bad: Vec<_> = BAD.iter().map(|series| (series, judged(series))).collect();
    let mut page = format!("{cases} cases a series, `Fit` with fit level {}.\n\n", FitLevel::default() as u8);
    errors(&mut page, &good);
    alarms(&mut page, &bad);
    motion(&mut page, cases, progress);
    page
}

/// Reading methods in the tables: the best result from one image, and the firmware's. `docs/study.md` has the errors of
/// the others.
const SHOWN: [(usize, &str); 2] = [(3, "Full"), (WAYS - 1, "Fit")];

fn errors(page: &mut String, good: &[(&Series, Judged)]) {
    page.push_str(
        "| series | method | force 99 % | force max | over | centre 99 % | centre max | over | flagged |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (series, judged) in good {
        for (way, name) in SHOWN {
            let half = |value: fn(&Outcome) -> f64| {
                let values = || judged.iter().map(|verdict| value(&verdict.outcomes[way]));
                let over = values().filter(|value| *value > 1.0).count();
                format!("{:.3} | {:.3} | {over}", quantile(values(), 0.99), quantile(values(), 1.0))
            };
            let (force, centre) = (half(|outcome| outcome.force), half(|outcome| outcome.centre));
            let alarms = flagged(judged, way);
            let _ = writeln!(page, "| {} | {name} | {force} | {centre} | {alarms} |", series.name);
        }
    }
}

fn flagged<'a>(judged: impl IntoIterator<Item = &'a Verdict>, way: usize) -> usize {
    judged.into_iter().filter(|verdict| verdict.outcomes[way].flagged).count()
}

fn alarms(page: &mut String, bad: &[(&Series, Judged)]) {
    page.push_str("\nBad contacts that are flagged, percent:\n\n| image | Full | Fit |\n| --- | --- | --- |\n");
    for (series, judged) in bad {
        let [full, fit] = SHOWN.map(|(way, _)| 100.0 * flagged(judged, way) as f64 / judged.len().max(1) as f64);
        let _ = writeln!(page, "| {} | {full:.2} | {fit:.2} |", series.name);
    }
}

fn motion(page: &mut String, cases: usize, progress: &(impl Fn(&str, usize) + Sync)) {
    let cases = (cases / 100).max(1);
    let _ = write!(
        page,
        "\nPressed in from 0.1 mm, `Fit` at every frame from the {FRAMES}th on with at least 12 taxels, {cases} contacts without noise:\n\n\
        | speed | force 99 % | force max | over | centre max | flagged |\n| --- | --- | --- | --- | --- | --- |\n"
    );
    for um_per_frame in [0.3, 1.0, 3.0] {
        let outcome = |number| {
            progress("pressed in", number);
            pressed(number, um_per_frame)
        };
        let outcomes: Vec<_> = (0..cases).map(outcome).collect();
        let force = || outcomes.iter().map(|outcome| outcome.force);
        let [most, max] = [0.99, 1.0].map(|share| quantile(force(), share));
        let centre = quantile(outcomes.iter().map(|outcome| outcome.centre), 1.0);
        let over = force().filter(|force| *force > 1.0).count();
        let flagged = outcomes.iter().filter(|outcome| outcome.flagged).count();
        let mm_per_s = 10.0 * um_per_frame;
        let _ = writeln!(page, "| {mm_per_s} mm/s | {most:.3} | {max:.3} | {over} | {centre:.3} | {flagged} |");
    }
}
