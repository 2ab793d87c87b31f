//! The inputs of every kernel, by fixed seeds: made here, read by the image, looked at again by the judge.
//!
//! From integers and the four operations alone, so that every machine makes the same.

use crate::fit_cases::Scene;
use crate::fit_statistics::{FRAMES, GOOD, Series};
use crate::stimulus::{self, config};
use bringup::script::{Bench, RECORDS};
use fastrand::Rng;
use fingertip::shipped::{COLUMNS, Frame, Pipeline, ROWS, TactileImage};
use images::record::Record;
use sim::plant::{Plant, Setup};

const SEED: u64 = 2003;
/// Seed of the frames of contacts.
const FRAMES_SEED: u64 = 0xc33d_778f_6519_a910;

/// A pair of numbers in Q16, with at most 24 significant bits each.
pub type Pair = [i32; 2];

pub struct Inputs {
    /// Numbers to take the root of, 0.01 to 32767.
    pub root: Vec<Pair>,
    /// Indentations, 0.01 to 9.5 mm.
    pub force: Vec<Pair>,
    /// Forces, 1 mN to 70 N.
    pub indentation: Vec<Pair>,
    /// Distances from the centre, up to a little beyond the rim, and indentations, 0.01 to 9.5 mm.
    pub pressure: Vec<Pair>,
    /// Frames of contacts, and the calibration.
    pub frames: Frames,
    /// Contacts without noise, and with noise of 1 % of each reading: several tactile images of each.
    pub fits: [Vec<Seen>; 2],
    pub records: Vec<Record>,
}

/// A contact and its pictures, each with noise of its own.
pub struct Seen {
    pub scene: Scene,
    pub pictures: Vec<TactileImage>,
}

/// The series of `docs/contact.md` that are studied: none and 1 % of each reading.
const SERIES: [usize; 2] = [0, 3];
const CONTACTS: usize = 64;

fn seen(series: &Series) -> Vec<Seen> {
    let one = |number| {
        let case = series.case(number);
        let mut rng = Rng::with_seed(SEED + number as u64);
        let mut another = || series.reading.picture(&case.pressures, case.picture.bad, &mut rng).0;
        let pictures = (0..FRAMES).map(|frame| if frame == 0 { case.picture } else { another() }).collect();
        Seen { scene: case.scene, pictures }
    };
    let mut seen: Vec<_> = (0..CONTACTS).map(one).collect();
    seen.sort_by(|a, b| a.scene.pitch_mm.total_cmp(&b.scene.pitch_mm));
    seen
}

/// Bytes for the image: the cases by pitch, with the first `pictures` tactile images of each.
fn seen_to_bytes<'a>(seen: impl Iterator<Item = &'a Seen>, pictures: usize) -> Vec<u8> {
    let seen: Vec<_> = seen.collect();
    let mut words = vec![seen.len() as i32, pictures as i32];
    for same in seen.chunk_by(|a, b| a.scene.pitch_mm == b.scene.pitch_mm) {
        words.extend(same.first().map(|seen| (seen.scene.pitch_mm * 1e3).round() as i32));
        words.push(same.len() as i32);
        let shown = same.iter().flat_map(|seen| seen.pictures.iter().take(pictures));
        words.extend(shown.flat_map(|picture| picture.taxels.into_iter().flatten()));
    }
    words.into_iter().flat_map(i32::to_le_bytes).collect()
}

/// Frames of a contact, and what the array's calibration is.
pub struct Frames {
    /// Q14, 0.8 to 1.2.
    pub gains: [[u16; COLUMNS]; ROWS],
    /// Without contact.
    pub quiet: Frame,
    /// Indentations of 0.1 to 5 mm, centres up to 4 mm from the array's middle on each axis.
    pub contacts: Vec<Frame>,
}

impl Frames {
    fn new(rng: &mut Rng) -> Self {
        let gains = core::array::from_fn(|_| core::array::from_fn(|_| rng.u16(13_107..19_661)));
        let mut frame = |d: Option<i32>| {
            let mut setup = Setup::default();
            let distance_mm = setup.wall.distance_mm;
            (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (8.0 * rng.f64() - 4.0, 8.0 * rng.f64() - 4.0);
            let mut world = Plant::new(&setup);
            if let Some(d) = d {
                world.place(distance_mm + f64::from(d) / 65_536.0);
            }
            let mut frame = Frame::EMPTY;
            world.fill_frame(&mut frame);
            frame
        };
        let quiet = frame(None);
        let depths = spread(&mut Rng::with_seed(SEED), 256, 6_554, 327_680);
        Self { gains, quiet, contacts: depths.into_iter().map(|[d, _]| frame(Some(d))).collect() }
    }

    fn to_bytes(&self) -> Vec<u8> {
        let gains = self.gains.iter().flatten().map(|gain| u32::from(*gain));
        let frames = [&self.quiet].into_iter().chain(&self.contacts);
        let words = [self.contacts.len() as u32].into_iter().chain(gains);
        let codes = frames.flat_map(|frame| frame.codes.rows.into_iter().chain([frame.codes.undriven]).flatten());
        words.flat_map(u32::to_le_bytes).chain(codes.flat_map(u16::to_le_bytes)).collect()
    }
}

impl Default for Inputs {
    /// The same at every call.
    fn default() -> Self {
        let mut rng = Rng::with_seed(SEED);
        Self {
            root: spread(&mut rng, 512, 656, i32::MAX),
            force: spread(&mut rng, 512, 656, 622_592),
            indentation: spread(&mut rng, 512, 66, 70 << 16),
            pressure: spread(&mut rng, 512, 656, 622_592)
                .into_iter()
                .map(|[d, _]| [distance(&mut rng, d), d])
                .collect(),
            frames: Frames::new(&mut Rng::with_seed(FRAMES_SEED)),
            fits: SERIES.map(|series| seen(&GOOD[series])),
            records: stimulus::records(),
        }
    }
}

impl Inputs {
    /// As the image reads them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.every([1; 3], FRAMES);
        bytes.extend((self.records.len() as u32).to_le_bytes());
        bytes.extend(self.records.iter().flat_map(Record::to_bytes));
        bytes
    }

    /// Inputs that the image of `cargo xtask bringup` keeps: a few of all but the records, which it makes itself.
    pub fn few_to_bytes(&self) -> Vec<u8> {
        self.every([32, 16, 16], 12)
    }

    /// Every n-th of the numbers, of the frames and of the contacts, with this number of pictures of a contact.
    fn every(&self, [number, frame, contact]: [usize; 3], pictures: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        for section in [&self.root, &self.force, &self.indentation, &self.pressure] {
            let words = section.iter().step_by(number).flatten().copied();
            let count = section.len().div_ceil(number) as i32;
            bytes.extend([count].into_iter().chain(words).flat_map(i32::to_le_bytes));
        }
        let contacts = self.frames.contacts.iter().copied().step_by(frame).collect();
        bytes.extend(Frames { contacts, ..self.frames }.to_bytes());
        for seen in &self.fits {
            bytes.extend(seen_to_bytes(seen.iter().step_by(contact), pictures));
        }
        bytes
    }

    /// The same with the records behind it, as that image makes them: what the timing model's image takes.
    pub fn few_with_records(&self) -> Vec<u8> {
        let config = config();
        let (mut pipeline, mut bench) = (Pipeline::new(&config), Bench::at_rest());
        bench.finger.make_table();
        bench.restart();
        let mut bytes = self.few_to_bytes();
        bytes.extend(RECORDS.to_le_bytes());
        (0..RECORDS).for_each(|_| bytes.extend(bench.record(&mut pipeline).to_bytes()));
        bytes
    }
}

/// A distance of 0 to 1.05 contact radii.
fn distance(rng: &mut Rng, d: i32) -> i32 {
    let rim = (i64::from(d) * (20 * 65_536 - i64::from(d))).isqrt();
    rng.i64(0..=rim * 21 / 20).min(10 * 65_536 - 1) as i32
}

/// As many from each octave of a range, uniformly within it.
fn spread(rng: &mut Rng, count: usize, low: i32, high: i32) -> Vec<Pair> {
    let octaves = low.ilog2()..=high.ilog2();
    let drawn = octaves.cycle().map(|octave| (1 << octave) + rng.i32(0..1 << octave));
    let rounded = drawn.map(|bits: i32| bits & (-1 << (bits.ilog2().saturating_sub(23))));
    rounded.filter(|bits| (low..=high).contains(bits)).map(|bits| [bits, 0]).take(count).collect()
}
