//! The fit judged over many pictures with a known contact: how far off it is, and whom its confidence flags.
//!
//! Case number n of a series is drawn from n alone, so every effort sees the very same pictures and the figures do not
//! depend on the number of threads.

use crate::fit_cases::{Noise, PITCHES_MM, Reading, Scene, Steps};
use fastrand::Rng;
use fingertip::config::Config;
use fingertip::contact::{self, CONFIDENCE_LEAST, Effort};
use fingertip::pipeline::Contact;
use fingertip::pressure::Picture;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A contact that fewer live taxels see is not judged.
pub const TAXELS_MIN: usize = 12;
/// An edge that takes a smaller share of the force that the live taxels would see without it is not judged.
///
/// One reading's noise: whoever looks at the taxels with 1 % of noise cannot tell a smaller change of the seen force, spread
/// over the taxels, from noise.
pub const CUT_MIN: f64 = 0.01;
/// The efforts that are judged. [`Effort::Moments`] is the plain sum with the moments' centre.
pub const EFFORTS: [Effort; 4] = [Effort::Moments, Effort::One, Effort::Two, Effort::Full];

/// Pictures of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    /// As the tables call it.
    pub name: &'static str,
    /// Draws a scene.
    pub scene: fn(&mut Rng) -> Scene,
    /// What the readings suffer.
    pub reading: Reading,
}

const fn reading(dead: usize, steps: Steps, noise: Noise) -> Reading {
    Reading { steps, noise, dead }
}

/// Noise of 1 % of each reading.
const NOISE: Noise = Noise::OfReading(0.01);

/// Hemispheres on a plane.
pub const GOOD: [Series; 6] = [
    Series { name: "clean", scene: Scene::good, reading: reading(0, Steps::Sixteenths, Noise::None) },
    Series { name: "10 dead", scene: Scene::good, reading: reading(10, Steps::Sixteenths, Noise::None) },
    Series { name: "10 dead, floor", scene: Scene::good, reading: reading(10, Steps::Codes, Noise::None) },
    Series { name: "noise", scene: Scene::good, reading: reading(0, Steps::Sixteenths, NOISE) },
    Series { name: "noise, 10 dead", scene: Scene::good, reading: reading(10, Steps::Sixteenths, NOISE) },
    Series {
        name: "noise of the peak",
        scene: Scene::good,
        reading: reading(0, Steps::Sixteenths, Noise::OfPeak(0.01)),
    },
];

/// What is no hemisphere on a plane, with noise.
pub const BAD: [Series; 6] = [
    Series { name: "edge", scene: Scene::edge, reading: reading(0, Steps::Sixteenths, NOISE) },
    Series { name: "edge, 10 dead", scene: Scene::edge, reading: reading(10, Steps::Sixteenths, NOISE) },
    Series { name: "two contacts", scene: Scene::two, reading: reading(0, Steps::Sixteenths, NOISE) },
    Series { name: "two contacts, 10 dead", scene: Scene::two, reading: reading(10, Steps::Sixteenths, NOISE) },
    Series { name: "bent", scene: Scene::bent, reading: reading(0, Steps::Sixteenths, NOISE) },
    Series { name: "bent, 10 dead", scene: Scene::bent, reading: reading(10, Steps::Sixteenths, NOISE) },
];

/// One picture with what is known of it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The contact.
    pub scene: Scene,
    /// What the array shows of it.
    pub picture: Picture,
    /// Share of the seen force that an edge takes; 0 without one.
    pub cut: f64,
    /// Draws that were left out before this one because too few taxels see the contact.
    pub too_few: usize,
    /// Draws that were left out because the edge takes too little.
    pub invisible: usize,
}

impl Series {
    /// The case of this number that is to be judged.
    pub fn case(&self, number: usize) -> Case {
        let mut rng = Rng::with_seed(0x5eed_0000_0000 + number as u64);
        let (mut too_few, mut invisible) = (0, 0);
        loop {
            let scene = (self.scene)(&mut rng);
            let pressures = scene.pressures();
            let (picture, seen) = self.reading.picture(&pressures, &mut rng);
            if seen < TAXELS_MIN {
                too_few += 1;
                continue;
            }
            let cut = scene.cut(&pressures, &picture.bad);
            if cut.is_some_and(|cut| cut < CUT_MIN) {
                invisible += 1;
                continue;
            }
            return Case { scene, picture, cut: cut.unwrap_or(0.0), too_few, invisible };
        }
    }
}

/// The core's constants for each pitch.
#[derive(Clone, Debug)]
pub struct Configs(Vec<(f64, Config)>);

impl Default for Configs {
    fn default() -> Self {
        let config = |pitch_mm| {
            let mut scene = Scene::good(&mut Rng::with_seed(0));
            scene.pitch_mm = pitch_mm;
            (pitch_mm, scene.config())
        };
        Self(PITCHES_MM.into_iter().map(config).collect())
    }
}

impl Configs {
    /// Those of a scene's array.
    ///
    /// # Panics
    /// On a pitch that is not one of [`PITCHES_MM`].
    pub fn of(&self, scene: &Scene) -> &Config {
        let found = self.0.iter().find(|(pitch_mm, _)| *pitch_mm == scene.pitch_mm);
        &found.expect("one of the arrays' pitches").1
    }
}

/// How one effort did on one case.
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
    pub fn of(contact: &Contact, case: &Case, noisy: bool) -> Self {
        let scene = &case.scene;
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

/// What came of a series: each case with an outcome for each effort.
pub type Judged = Vec<(Case, [Outcome; EFFORTS.len()])>;

/// Judges `cases` cases of a series on all threads; `progress` hears how many are done.
pub fn judge(series: &Series, cases: usize, progress: &(impl Fn(usize) + Sync)) -> Judged {
    let configs = Configs::default();
    let noisy = series.reading.noise != Noise::None;
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get()).min(cases.max(1));
    let done = AtomicUsize::new(0);
    let part = |range: std::ops::Range<usize>| -> Judged {
        let one = |number| {
            let case = series.case(number);
            let config = configs.of(&case.scene);
            let outcomes =
                EFFORTS.map(|effort| Outcome::of(&contact::read(&case.picture, effort, config), &case, noisy));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            (case, outcomes)
        };
        range.map(one).collect()
    };
    std::thread::scope(|scope| {
        let part = &part;
        let start = |thread| scope.spawn(move || part(cases * thread / threads..cases * (thread + 1) / threads));
        let running: Vec<_> = (0..threads).map(start).collect();
        // A panic in a case is a panic here.
        running
            .into_iter()
            .flat_map(|thread| thread.join().unwrap_or_else(|cause| std::panic::resume_unwind(cause)))
            .collect()
    })
}

/// The value below which this share of the values lies.
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}
