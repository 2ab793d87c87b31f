//! The worst that frames can bring: every code at the top, one corner, half of them, alternating ones, and any at all.
//! Nothing may overflow, so these are worth most with overflow checks.

use crate::common::*;
use fingertip::config::{Geometry, Shaped};
use fingertip::contact::parts::{
    CENTRE_BITS, Comparison, Equations, Guess, ONE, PeakScale, Prediction, SLOPE_BITS, SQUARE_BITS, ScaledImage,
};
use fingertip::contact::{self, Fit};
use fingertip::frame::{Frame, Shape};
use fingertip::pipeline::Pipeline;
use fingertip::pressure::{Array, Calibration, TactileImage};
use images::single::{self, Refined};

/// The highest code that is not saturated.
const TOP: u16 = 4_089;
/// A code that shows no contact, above a level of 0.
const QUIET: u16 = 40;

/// By parameters within their ranges.
fn config<const ROWS: usize, const COLUMNS: usize>(params: &Params) -> Shaped<ROWS, COLUMNS> {
    Shaped::new(params, &CLOCKS).expect("parameters within their ranges")
}

/// Calls a check for each shape, rows x columns, with these arguments.
macro_rules! shapes {
    ($check:ident: $($shapes:tt)+) => { shapes!($check(): $($shapes)+) };
    ($check:ident $given:tt: $($rows:literal x $columns:literal),+) => {{ $($check::<$rows, $columns>$given;)+ }};
}

/// Parameters at the limits that matter for the sums and the fit, with the largest sag that the shape allows.
fn extremes<const ROWS: usize, const COLUMNS: usize>() -> Vec<Params> {
    let with = |sag: &i32| Params { row_sag_ppb_per_code: *sag, ..Params::DEFAULT };
    let allowed = |sag: &i32| Shaped::<ROWS, COLUMNS>::new(&with(sag), &CLOCKS).is_ok();
    let row_sag_ppb_per_code = (0..=7_600).rev().step_by(4).find(allowed).expect("a sag that is allowed");
    let mut all = Vec::new();
    for (pitch_um, tip_radius_um) in [(500, 16_000), (4_000, 4_000), (1_500, 10_000), (500, 4_000)] {
        for (modulus_pa, codes_per_kpa_milli) in [(20_000, 200_000), (2_000_000, 1_000), (250_000, 24_000)] {
            // The converter's whole range counts as sound.
            let params = Params { pitch_um, tip_radius_um, headroom_codes: 5, ..Params::DEFAULT };
            let params = Params { modulus_pa, codes_per_kpa_milli, ..params };
            all.extend([0, row_sag_ppb_per_code].map(|sag| Params { row_sag_ppb_per_code: sag, ..params }));
        }
    }
    all
}

/// A frame whose taxels show this above a level of 0.
fn frame<const ROWS: usize, const COLUMNS: usize>(code: impl Fn(usize, usize) -> u16) -> Frame<ROWS, COLUMNS> {
    let mut frame = Frame::EMPTY;
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        frame.set_code(row, column, code(row, column));
    }
    frame
}

/// Every taxel at the top; a corner; halves; chessboards; a dome in the middle and one at a corner; nothing.
fn frames<const ROWS: usize, const COLUMNS: usize>() -> Vec<Frame<ROWS, COLUMNS>> {
    let top = |at: bool| if at { TOP } else { QUIET };
    let dome = |row: i32, column: i32, flat: i32| {
        (i32::from(TOP) - flat * (row * row + column * column)).max(QUIET.into()) as u16
    };
    let mut all = vec![
        frame(|_, _| TOP),
        frame(|row, column| top(row < 2 && column < 2)),
        frame(|row, column| top(row + 2 >= ROWS && column + 2 >= COLUMNS)),
        frame(|row, column| top(row == 0 && column + 1 == COLUMNS)),
        frame(|row, _| top(row >= ROWS / 2)),
        frame(|_, column| top(column < COLUMNS / 2)),
        frame(|_, column| top(column >= COLUMNS.div_ceil(2))),
        frame(|row, column| top((row + column) % 2 == 0)),
        frame(|_, column| top(column % 2 == 0)),
        frame(|row, _| top(row % 2 == 0)),
        frame(|row, column| top(row >= ROWS / 2 && column >= COLUMNS / 2)),
    ];
    for flat in [2, 10, 60, 400] {
        all.push(frame(|row, column| dome(row as i32 - ROWS as i32 / 2, column as i32 - COLUMNS as i32 / 2, flat)));
        all.push(frame(|row, column| dome(row as i32, column as i32, flat)));
        all.push(frame(|row, column| dome(row as i32 - ROWS as i32, column as i32 + 1, flat)));
    }
    all.push(frame(|_, _| QUIET));
    all
}

/// Expected sums, in sixteenths of a code.
fn sums<const ROWS: usize, const COLUMNS: usize>(
    frame: &Frame<ROWS, COLUMNS>,
    gain: u16,
    config: &Shaped<ROWS, COLUMNS>,
) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for row in 0..ROWS {
        let net: [f64; COLUMNS] = core::array::from_fn(|column| f64::from(frame.code(row, column)));
        let sag = f64::from(config.sag_q32) / 4_294_967_296.0 * net.iter().sum::<f64>();
        for (column, net) in net.into_iter().enumerate() {
            let reading = 16.0 * net * f64::from(gain) / 16_384.0 / (1.0 - sag);
            sums[0] += reading;
            sums[1] += reading * (2.0 * column as f64 + 1.0 - COLUMNS as f64);
            sums[2] += reading * (2.0 * row as f64 + 1.0 - ROWS as f64);
        }
    }
    sums
}

/// Every frame several times, through the array, all fit levels and the readings of single pictures.
fn survives<const ROWS: usize, const COLUMNS: usize>() {
    let frames = frames::<ROWS, COLUMNS>();
    for params in extremes::<ROWS, COLUMNS>() {
        let config = config::<ROWS, COLUMNS>(&params);
        for gain in [GAIN_MAX, 1 << 14] {
            let mut array = Array::new();
            array.calibrate(&Calibration::new(&[[gain; COLUMNS]; ROWS], &[0; ROWS]).expect("gains within their range"));
            let mut fits = FitLevel::ALL.map(Fit::<ROWS, COLUMNS>::new);
            for frame in &frames {
                let picture = *array.read(frame, &config);
                let exact = sums(frame, gain, &config);
                let found = [picture.sum, picture.moment_x, picture.moment_y].map(f64::from);
                let off = exact.iter().zip(found).map(|(exact, found)| (exact - found).abs()).fold(0.0, f64::max);
                // The error of the boost's series is 2^-20 at the end of its range.
                assert!(off < 2e-5 * exact[0] * ROWS.max(COLUMNS) as f64 + 20.0, "{found:?}, not {exact:?}");
                for refined in Refined::ALL {
                    single::read(&picture, refined, &config);
                }
                for fit in &mut fits {
                    (0..2 * ROWS + 3).for_each(|_| _ = fit.read(&picture, &config));
                }
            }
            // And tared by every frame, which the next is then read above.
            for frame in &frames {
                array.start_tare(false);
                for _ in 0..Array::<ROWS, COLUMNS>::TARE_FRAMES {
                    array.read(frame, &config);
                    array.continue_tare();
                }
                array.judge_tare(&config);
                let picture = *array.read(&frames[0], &config);
                fits.iter_mut().for_each(|fit| _ = fit.read(&picture, &config));
                array.follow_drift(1 << 16);
            }
        }
    }
}

sim::sizes!(
    the_worst_frames_overflow_nothing,
    shapes!(survives: 3 x 3, 3 x 5, 10 x 10, 3 x 32),
    shapes!(survives: 4 x 4, 8 x 8, 16 x 16, 16 x 32)
);

/// A tare takes the same out of every taxel, also where the rows are odd.
fn tares<const ROWS: usize, const COLUMNS: usize>() {
    let config = config::<ROWS, COLUMNS>(&Params::DEFAULT);
    let frame = frame::<ROWS, COLUMNS>(|row, column| 40 + 3 * row as u16 + 5 * column as u16);
    let mut array = Array::new();
    let done = (1..).find(|_| {
        array.read(&frame, &config);
        array.continue_tare()
    });
    assert_eq!(done, Some(32 * ROWS.div_ceil(2) as u32));
    let picture = array.read(&frame, &config);
    assert!(picture.taxels.iter().flatten().all(|taxel| taxel.abs() <= 1), "{:?}", picture.taxels);
    assert!(picture.sum.abs() <= 2 && picture.moment_x.abs() <= 4 && picture.moment_y.abs() <= 4);
}

#[test]
fn a_tare_zeroes_every_taxel() {
    shapes!(tares: 3 x 3, 3 x 5, 4 x 4, 9 x 8, 16 x 16, 15 x 31, 16 x 32);
}

/// A taxel that is dead or saturated is left out, whichever it is, and no other.
fn leaves_out<const ROWS: usize, const COLUMNS: usize>() {
    let config = config::<ROWS, COLUMNS>(&Params::DEFAULT);
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        for code in [0, 4_095] {
            let spoilt = frame::<ROWS, COLUMNS>(|r, c| if (r, c) == (row, column) { code } else { 100 });
            let mut array = Array::new();
            let picture = *array.read(&spoilt, &config);
            let mut bad = [0; ROWS];
            bad[row] = 1 << column;
            assert_eq!((picture.bad, picture.bad_count, array.begin(&spoilt, ROWS, &config).0), (bad, 1, 1));
            assert_eq!(picture.taxels[row][column], 0);
            let sound = picture.taxels.iter().flatten().filter(|taxel| **taxel > 0).count();
            assert!(picture.peak > 0 && sound + 1 == ROWS * COLUMNS);
        }
    }
}

#[test]
fn a_bad_taxel_is_left_out_wherever_it_is() {
    shapes!(leaves_out: 3 x 3, 3 x 5, 4 x 4, 8 x 8, 10 x 10, 16 x 16, 5 x 31, 16 x 32);
}

#[test]
fn an_array_that_is_all_bad_counts_every_taxel() {
    let config = config::<16, 32>(&Params::DEFAULT);
    let frame = frame::<16, 32>(|_, _| 4_095);
    let mut array = Array::new();
    assert_eq!(array.read(&frame, &config).bad_count, 512);
    assert_eq!(array.read(&frame, &config).bad_again, 512);
    assert_eq!(contact::from_sums(array.picture(), &config).bad_taxels, 255);
}

/// Any codes: of a converter of 12 bits, or 16 at random.
fn any_frame<const ROWS: usize, const COLUMNS: usize>() -> impl Strategy<Value = Frame<ROWS, COLUMNS>> {
    let code = prop_oneof![8 => 0..4_096_u16, 2 => Just(TOP), 1 => Just(0), 1 => any::<u16>()];
    let sound = 30..4_080_u16;
    let count = Shape::<ROWS, COLUMNS>::SLOTS * COLUMNS;
    let all = prop::collection::vec;
    let codes = prop_oneof![all(sound.boxed(), count), all(code.boxed(), count), all((30..200_u16).boxed(), count)];
    (codes, prop::bool::ANY, any::<u32>()).prop_map(|(codes, level, sequence)| {
        let mut frame = Frame { sequence, ..Frame::EMPTY };
        for (place, code) in codes.into_iter().enumerate() {
            let (slot, column) = (place / COLUMNS, place % COLUMNS);
            frame.set_code(slot, column, if slot == ROWS && level { 20 } else { code });
        }
        frame
    })
}

fn any_sense() -> impl Strategy<Value = Sense> {
    let parts = (any::<i32>(), 5_000..7_000_u16, any::<u16>(), prop::bool::weighted(0.02), 0..20_000_u32);
    parts.prop_map(|(encoder, supply_mv, bus_silent_ms, bridge_fault, answer)| Sense {
        encoder: if encoder % 3 == 0 { encoder } else { encoder % 500 },
        supply_mv,
        bus_silent_ms,
        bridge_fault,
        chip: (answer % 2 == 0).then_some(Celsius::from_bits(encoder)),
        answer: CoreCycles(answer),
    })
}

/// Frames and senses to a pipeline that is tared and driven; a fault is cleared at once.
fn takes_anything<const ROWS: usize, const COLUMNS: usize>(cases: u32) {
    let steps = prop::collection::vec((any_frame::<ROWS, COLUMNS>(), any_sense(), 0..6_u8), 1..8);
    let test = |steps: Vec<(Frame<ROWS, COLUMNS>, Sense, u8)>| {
        let mut pipeline = Pipeline::new(&config::<ROWS, COLUMNS>(&Params::DEFAULT));
        let mut command = Command { tare_request: 1, goal: newtons(2_000), ..Command::default() };
        let quiet = frame::<ROWS, COLUMNS>(|_, _| QUIET);
        let still = Sense { supply_mv: 6_000, ..Sense::default() };
        for _ in 0..Array::<ROWS, COLUMNS>::TARE_FRAMES + 2 {
            pipeline.step(&quiet, &still, &command);
        }
        for (frame, sense, fit_level) in &steps {
            command.fit_level = FitLevel::from_number(*fit_level);
            for _ in 0..ROWS + 2 {
                pipeline.begin(frame, ROWS / 2);
                let (duty, status) = pipeline.step(frame, sense, &command);
                assert_eq!(duty, status.duty);
                command.torque = status.fault.is_none();
                command.clear_request += u8::from(status.fault.is_some());
                command.measure_request = command.measure_request.wrapping_add(fit_level % 4);
            }
        }
        Ok(())
    };
    TestRunner::new(seeded(cases, 2003)).run(&steps, test).expect("no panic");
}

#[test]
fn any_frame_and_any_sense_is_taken() {
    shapes!(takes_anything(200): 3 x 3, 3 x 5, 4 x 4);
    shapes!(takes_anything(60): 8 x 8);
    shapes!(takes_anything(30): 16 x 16, 16 x 32);
}

// The sums over a row's slopes stay within 32 bits, also where the indentation follows the force away from the guess.
// Nothing may overflow, so this is worth most with overflow checks.

/// The farthest that the indentation follows the force, as in the fit: 1/16 of the radius.
const FOLLOWED: i32 = ONE / 16;

fn between(rng: &mut Rng, low: i32, high: i32) -> i32 {
    // The ends are where it is hardest.
    match rng.u8(..4) {
        0 => low,
        1 => high,
        _ => rng.i32(low..=high),
    }
}

fn take<const ROWS: usize, const COLUMNS: usize>(
    prediction: &Prediction<ROWS, COLUMNS>,
    view: &ScaledImage<ROWS, COLUMNS>,
    geometry: &Geometry,
) {
    let comparison = Comparison { prediction, view, geometry };
    let mut equations = Equations::NONE;
    (0..ROWS).for_each(|row| equations.take_row(comparison, row));
}

/// Contacts of all depths anywhere, on arrays of all pitches, with the indentation followed as far as it may be.
fn stays_within<const ROWS: usize, const COLUMNS: usize>(poses: u32) {
    let mut rng = Rng::with_seed(2003);
    let mut picture = TactileImage::<ROWS, COLUMNS>::EMPTY;
    let mut steepest = 0;
    for _ in 0..poses / 500 {
        let (pitch_um, tip_radius_um) = (between(&mut rng, 500, 4_000), between(&mut rng, 4_000, 16_000));
        let config = config::<ROWS, COLUMNS>(&Params { pitch_um, tip_radius_um, ..Params::DEFAULT });
        let geometry = &config.geometry;
        let peak = between(&mut rng, 16, 4_095 * 16 * i32::from(GAIN_MAX >> 14));
        let Some(scale) = PeakScale::new(peak, geometry) else { continue };
        picture.taxels.as_flattened_mut().fill_with(|| between(&mut rng, 0, peak));
        let view = ScaledImage { picture: &picture, scale: &scale };
        for _ in 0..500 {
            let [x, y] = [COLUMNS, ROWS].map(|side| {
                let reach = (geometry.pitch >> (SQUARE_BITS - CENTRE_BITS)) * side as i32 / 2 + (1 << CENTRE_BITS);
                rng.i32(-reach..=reach)
            });
            let guess = Guess::new(between(&mut rng, ONE / 8, ONE), x, y, geometry);
            let mut prediction = Prediction::new(&guess, &scale, &config);
            prediction.height += between(&mut rng, -FOLLOWED, FOLLOWED);
            for at in (0..16).map(|share| prediction.outside / 16 * share) {
                let taxel = prediction.taxel(at, &geometry.nodes);
                steepest = steepest.max(taxel.by_height).max(taxel.by_square);
            }
            take(&prediction, &view, geometry);
        }
    }
    // The bound is reached, so it cannot be lower.
    assert_eq!(steepest, 3 << (SLOPE_BITS - 1), "{ROWS} x {COLUMNS}");
}

sim::sizes!(a_rows_sums_fit_wherever_the_contact_is_and_however_deep, sums_fit(10_000), sums_fit(200_000));

fn sums_fit(poses: u32) {
    // The most columns that lose none, one and two bits, and the least that lose one and two.
    shapes!(stays_within(poses): 3 x 3, 3 x 14, 3 x 15, 3 x 28, 3 x 29, 3 x 32);
    shapes!(stays_within(2 * poses): 10 x 10);
    shapes!(stays_within(poses / 2): 16 x 16);
}

/// The finest array under the largest tip, a row just within the rim: all its taxels are as steep as may be.
fn stays_within_along_the_rim<const ROWS: usize, const COLUMNS: usize>() {
    let params = Params { pitch_um: 500, tip_radius_um: 16_000, modulus_pa: 20_000, ..Params::DEFAULT };
    let config = config::<ROWS, COLUMNS>(&params);
    let (geometry, picture) = (&config.geometry, TactileImage::<ROWS, COLUMNS>::EMPTY);
    let scale = PeakScale::new(4_095 * 16, geometry).expect("a peak that is high enough");
    let pitch = geometry.pitch >> (SQUARE_BITS - CENTRE_BITS);
    for height in (ONE / 4..ONE).step_by(1 << 19) {
        let s = f64::from(height) / f64::from(ONE);
        let rim = ((1.0 - s * s).sqrt() * f64::from(1 << CENTRE_BITS)) as i32;
        for off in (0..pitch).step_by(1 << 13) {
            let guess = Guess::new(height, 0, rim - off - pitch / 2 * (ROWS as i32 - 1), geometry);
            let mut prediction = Prediction::new(&guess, &scale, &config);
            prediction.height -= FOLLOWED;
            take(&prediction, &ScaledImage { picture: &picture, scale: &scale }, geometry);
        }
    }
}

#[test]
fn a_rows_sums_fit_along_the_rim() {
    shapes!(stays_within_along_the_rim: 3 x 3, 10 x 10, 3 x 14, 3 x 15, 3 x 28, 3 x 31, 3 x 32, 16 x 32);
}
