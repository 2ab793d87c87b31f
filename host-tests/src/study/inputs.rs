//! The inputs of every kernel, by fixed seeds: made here, read by the image, looked at again by the judge.
//!
//! From integers and the four operations alone, so that every machine makes the same.

use fastrand::Rng;

const SEED: u64 = 2003;

/// A pair of numbers in Q16, with at most 24 significant bits each.
pub type Pair = [i32; 2];

/// All inputs.
pub struct Inputs {
    /// Numbers to take the root of, 0.01 to 32767.
    pub root: Vec<Pair>,
    /// Indentations, 0.01 to 9.5 mm.
    pub force: Vec<Pair>,
    /// Forces, 1 mN to 70 N.
    pub indentation: Vec<Pair>,
    /// Distances from the centre, up to a little beyond the rim, and indentations, 0.01 to 9.5 mm.
    pub pressure: Vec<Pair>,
    /// Indentations, 0.5 to 5 mm.
    pub rings: Vec<Pair>,
}

impl Inputs {
    /// The same at every call.
    pub fn new() -> Self {
        let mut rng = Rng::with_seed(SEED);
        Self {
            root: spread(&mut rng, 512, 656, i32::MAX),
            force: spread(&mut rng, 512, 656, 622_592),
            indentation: spread(&mut rng, 512, 66, 70 << 16),
            pressure: spread(&mut rng, 512, 656, 622_592)
                .into_iter()
                .map(|[d, _]| [distance(&mut rng, d), d])
                .collect(),
            rings: spread(&mut rng, 32, 32_768, 327_680),
        }
    }

    /// As the image reads them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for section in [&self.root, &self.force, &self.indentation, &self.pressure, &self.rings] {
            bytes.extend((section.len() as u32).to_le_bytes());
            bytes.extend(section.iter().flatten().flat_map(|word| word.to_le_bytes()));
        }
        bytes
    }
}

impl Default for Inputs {
    fn default() -> Self {
        Self::new()
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
