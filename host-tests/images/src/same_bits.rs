//! The same random inputs on any processor for every function that has instructions of its own on some, and a digest of
//! the results of each.
//!
//! Two processors whose digests are equal agree in every bit of every result. These functions are the ones of `lanes`,
//! those that correct its roots, and copies. The rest of the loop is the same integers everywhere: a replayed recording
//! compares it as a whole.

use fingertip::arith::floor_sqrt;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip};
use fingertip::shipped::COLUMNS;
use fingertip::units::{Kilopascals, Millimetres};
use lanes::{Codes, Common, Curve, Row, Total};

/// Inputs that a comparison takes.
pub const INPUTS: u32 = 1_000_000;

/// A seeded source of inputs: the upper half of a linear congruential generator.
#[derive(Clone, Debug)]
struct Source(u64);

impl Source {
    fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// 64 random bits.
    fn wide(&mut self) -> u64 {
        u64::from(self.word()) << 32 | u64::from(self.word())
    }

    /// 0 to `top`, evenly.
    fn up_to(&mut self, top: u32) -> u32 {
        ((u64::from(self.word()) * (u64::from(top) + 1)) >> 32) as u32
    }

    /// Any number, every size as likely.
    fn any(&mut self) -> i32 {
        self.word().cast_signed() >> self.up_to(30)
    }

    /// `min` to `max`, evenly.
    fn within(&mut self, min: i32, max: i32) -> i32 {
        min.saturating_add_unsigned(self.up_to(max.abs_diff(min)))
    }
}

/// Digest of numbers in order. Each number permutes the digest, so two runs that differ in one number keep different
/// digests, unless another difference cancels the first.
#[derive(Clone, Copy, Debug)]
struct Mix(u64);

impl Mix {
    fn add(&mut self, number: impl Into<i64>) {
        let number: i64 = number.into();
        self.0 = (self.0.rotate_left(23) ^ number.cast_unsigned()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

/// Name of a function, number of inputs of which it takes one, and function that adds its results to the digest.
type Function = (&'static str, u32, fn(&mut Source, &mut Mix));

const FUNCTIONS: [Function; 11] = [
    ("lanes::sub", 1, |source, mix| mix.add(lanes::sub(source.word(), source.any().cast_unsigned()))),
    ("lanes::excess", 1, |source, mix| mix.add(lanes::excess(source.word(), source.any().cast_unsigned()))),
    ("lanes::dot", 1, |source, mix| mix.add(lanes::dot(source.word(), source.any().cast_unsigned(), source.any()))),
    ("lanes::add_high", 1, |source, mix| {
        mix.add(lanes::add_high(source.any(), source.word().cast_signed(), source.any()));
    }),
    ("lanes::near_root", 1, |source, mix| mix.add(lanes::near_root(source.word() | 1 << 30))),
    ("lanes::root_and_product", 1, |source, mix| {
        let [x, y] = [(); 2].map(|()| source.any().cast_unsigned());
        let (root, product) = lanes::root_and_product(x, y, source.wide());
        mix.add(root);
        mix.add(product.cast_signed());
    }),
    ("floor_sqrt", 1, |source, mix| mix.add(floor_sqrt(source.wide() >> source.up_to(63)))),
    ("floor_sqrt_of_squares", 1, |source, mix| {
        let square = u64::from(source.any().unsigned_abs()).pow(2);
        mix.add(floor_sqrt(square));
        mix.add(floor_sqrt(square.wrapping_sub(1)));
    }),
    ("Tip::pressure", 16, |source, mix| {
        let radius = Millimetres::from_bits(source.within(RADIUS_MIN.to_bits(), RADIUS_MAX.to_bits()));
        let modulus = Kilopascals::from_bits(source.within(MODULUS_MIN.to_bits(), MODULUS_MAX.to_bits()));
        if let Ok(tip) = Tip::new(radius, modulus) {
            let d = Millimetres::from_bits(source.within(0, tip.depth_max().to_bits()));
            let r = Millimetres::from_bits(source.within(0, tip.contact_radius(d).to_bits()));
            mix.add(tip.pressure(r, d).to_bits());
        }
    }),
    ("lanes::pass", 16, |source, mix| {
        let mut row = || core::array::from_fn(|_| source.word() as u16);
        let [first, second, undriven, gains, moments]: [[u16; COLUMNS]; 5] = [(); 5].map(|()| row());
        let signed = |row: [u16; COLUMNS]| row.map(u16::cast_signed);
        let codes = Codes { rows: [first, second], undriven };
        let tare = core::array::from_fn(|_| source.any());
        let bent = Curve { least: source.any(), growth: source.any() | 1 };
        for curve in [Curve::LINE, bent] {
            let common = Common { dead: source.word(), sag: source.word() & 0x7fff_7fff, curve };
            let mut rows = [Row { tare, ..Row::new(signed(gains), signed(moments)) }; 2];
            let mut taxels = [[0; COLUMNS]; 2];
            let mut total = Total::ZERO;
            // The first row, the other one, and both in one pass.
            for range in [0..1, 1..2, 0..2] {
                total = lanes::pass(&codes, &mut rows, &common, &mut taxels, range, total);
                let Total { first, second, running, largest, peak } = total;
                [first, second, running, peak].into_iter().for_each(|number| mix.add(number));
                [largest, rows[0].largest, rows[1].largest].into_iter().for_each(|number| mix.add(number));
            }
            rows.iter().for_each(|row| mix.add(row.boost));
            taxels.into_iter().flatten().for_each(|taxel| mix.add(taxel));
            rows.iter().for_each(|row| (0..COLUMNS).for_each(|column| mix.add(row.reading(column))));
        }
    }),
    // The board's own against this machine's, at any alignment and overlap.
    ("copy_and_fill", 1_024, |source, mix| {
        let mut bytes: [u8; 160] = core::array::from_fn(|_| source.word() as u8);
        for _ in 0..64 {
            let [from, to, length] = [90, 90, 69].map(|top| source.up_to(top) as usize);
            let before = bytes;
            match source.up_to(2) {
                0 => bytes.copy_within(from..from + length, to),
                1 => bytes[to..to + length].copy_from_slice(&before[from..from + length]),
                _ => bytes[to..to + length].fill(source.word() as u8),
            }
        }
        bytes.into_iter().for_each(|byte| mix.add(byte));
    }),
];

pub struct Comparison {
    source: Source,
    taken: u32,
    mixes: [Mix; FUNCTIONS.len()],
}

impl Default for Comparison {
    /// Comparison before the first input.
    fn default() -> Self {
        Self { source: Source(2003), taken: 0, mixes: [Mix(0); FUNCTIONS.len()] }
    }
}

impl Comparison {
    /// Gives the next input to every function.
    pub fn take(&mut self) {
        for ((_, every, function), mix) in FUNCTIONS.iter().zip(&mut self.mixes) {
            if self.taken.is_multiple_of(*every) {
                function(&mut self.source, mix);
            }
        }
        self.taken += 1;
    }

    /// Each function's name and digest.
    pub fn digests(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        FUNCTIONS.iter().zip(&self.mixes).map(|((name, ..), mix)| (*name, mix.0))
    }
}
