//! From a picture to a contact, at each effort, and followed from frame to frame.

use super::call::pass_on;
use super::host::{Inputs, fail, say};
use fingertip::config::Config;
use fingertip::contact::{self, Effort, Fit};
use fingertip::frame::{COLUMNS, ROWS};
use fingertip::params::Params;
use fingertip::pipeline::Contact;
use fingertip::pressure::Picture;

/// What the variants read and write.
struct Bench<'a> {
    picture: Picture,
    config: &'a Config,
    fit: Fit,
    contact: Contact,
}

type Kernel = extern "C" fn(&mut Bench);

const VARIANTS: [(&str, Kernel); 5] = [
    ("**Moments**", moments),
    ("**One**", one),
    ("**Two**", two),
    ("**Full**", full),
    ("**Fit, frame by frame**", follow),
];

extern "C" fn moments(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Effort::Moments, bench.config);
}

extern "C" fn one(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Effort::One, bench.config);
}

extern "C" fn two(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Effort::Two, bench.config);
}

extern "C" fn full(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Effort::Full, bench.config);
}

extern "C" fn follow(bench: &mut Bench) {
    bench.contact = bench.fit.read(&bench.picture, bench.config);
}

/// Measures all over the next section: for each pitch its cases, of as many pictures each. All but the last variant see the
/// first picture only.
#[inline(never)]
pub fn run(kernel: &str, region: &mut u32, inputs: &mut Inputs) {
    let [count, frames] = inputs.words();
    let start = inputs.place();
    for (place, (name, variant)) in VARIANTS.iter().enumerate() {
        say(format_args!("region {region} {kernel}: {name}"));
        inputs.seek(start);
        let mut left = count;
        while left > 0 {
            // Cases of a pitch follow each other: constants are made once for each, as two do not fit the stack.
            let [pitch_um, cases] = inputs.words();
            let Ok(config) = Config::new(&Params { pitch_um, ..Params::DEFAULT }) else { fail("a pitch is refused") };
            for _ in 0..cases {
                let follows = place + 1 == VARIANTS.len();
                one_case(*region, *variant, if follows { frames } else { 1 }, frames, &config, inputs);
            }
            left -= cases;
        }
        *region += 1;
    }
}

/// Measures the first so many pictures of all.
fn one_case(region: u32, variant: Kernel, measured: i32, all: i32, config: &Config, inputs: &mut Inputs) {
    let mut bench = Bench { picture: Picture::EMPTY, config, fit: Fit::new(), contact: Contact::default() };
    for frame in 0..all {
        bench.picture = picture(inputs);
        if frame < measured {
            pass_on(region, variant, &mut bench);
        }
    }
    let Contact { force, centre_x, centre_y, .. } = bench.contact;
    let [force, x, y] = [force.to_bits(), centre_x.to_bits(), centre_y.to_bits()];
    say(format_args!("i16 {force} i24 {x} i24 {y}"));
}

/// All taxels are good.
fn picture(inputs: &mut Inputs) -> Picture {
    let mut bytes = [0; 4 * ROWS * COLUMNS];
    inputs.read(&mut bytes);
    let mut values = bytes.as_chunks::<4>().0.iter().map(|bytes| i32::from_le_bytes(*bytes));
    let mut picture = Picture::EMPTY;
    for (row, line) in picture.taxels.iter_mut().enumerate() {
        for (column, taxel) in line.iter_mut().enumerate() {
            *taxel = values.next().unwrap_or(0);
            picture.sum += *taxel;
            picture.moment_x += *taxel * (2 * column as i32 - 9);
            picture.moment_y += *taxel * (2 * row as i32 - 9);
            picture.peak = picture.peak.max(*taxel);
        }
    }
    picture
}
