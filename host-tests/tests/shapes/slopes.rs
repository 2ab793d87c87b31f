//! The sums over a row's slopes stay within 32 bits, also where the indentation follows the force away from the guess.
//! Nothing may overflow, so this is worth most with overflow checks.

use fastrand::Rng;
use fingertip::config::{Geometry, Shaped};

use fingertip::contact::parts::{
    CENTRE_BITS, Comparison, Equations, Guess, ONE, Prediction, SLOPE_BITS, SQUARE_BITS, Scale, View,
};
use fingertip::params::Params;
use fingertip::pressure::{GAIN_MAX, Picture};

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
    view: &View<ROWS, COLUMNS>,
    geometry: &Geometry,
) {
    let comparison = Comparison { prediction, view, geometry };
    let mut equations = Equations::NONE;
    (0..ROWS).for_each(|row| equations.take_row(comparison, row));
}

/// Contacts of all depths anywhere, on arrays of all pitches, with the indentation followed as far as it may be.
fn stays_within<const ROWS: usize, const COLUMNS: usize>(poses: u32) {
    let mut rng = Rng::with_seed(2003);
    let mut picture = Picture::<ROWS, COLUMNS>::EMPTY;
    let mut steepest = 0;
    for _ in 0..poses / 500 {
        let (pitch_um, tip_radius_um) = (between(&mut rng, 500, 4_000), between(&mut rng, 4_000, 16_000));
        let params = Params { pitch_um, tip_radius_um, ..Params::DEFAULT };
        let config = Shaped::<ROWS, COLUMNS>::new(&params, &fingertip::shipped::CLOCKS).expect("allowed parameters");
        let geometry = &config.geometry;
        let peak = between(&mut rng, 16, 4_095 * 16 * i32::from(GAIN_MAX >> 14));
        let Some(scale) = Scale::new(peak, geometry) else { continue };
        picture.taxels.as_flattened_mut().fill_with(|| between(&mut rng, 0, peak));
        let view = View { picture: &picture, scale };
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

#[test]
fn a_rows_sums_fit_wherever_the_contact_is_and_however_deep() {
    stays_within::<3, 3>(200_000);
    stays_within::<10, 10>(400_000);
    // The most columns that lose none, one and two bits, and the least that lose one and two.
    stays_within::<3, 14>(200_000);
    stays_within::<3, 15>(200_000);
    stays_within::<3, 28>(200_000);
    stays_within::<3, 29>(200_000);
    stays_within::<3, 32>(200_000);
    stays_within::<16, 16>(100_000);
}

/// The finest array under the largest tip, with a row just within the rim and the indentation followed away from the
/// rim: all taxels of the row are as steep as may be.
fn stays_within_along_the_rim<const ROWS: usize, const COLUMNS: usize>() {
    let params = Params { pitch_um: 500, tip_radius_um: 16_000, modulus_pa: 20_000, ..Params::DEFAULT };
    let config = Shaped::<ROWS, COLUMNS>::new(&params, &fingertip::shipped::CLOCKS).expect("allowed parameters");
    let (geometry, picture) = (&config.geometry, Picture::<ROWS, COLUMNS>::EMPTY);
    let scale = Scale::new(4_095 * 16, geometry).expect("a peak that is high enough");
    let pitch = geometry.pitch >> (SQUARE_BITS - CENTRE_BITS);
    for height in (ONE / 4..ONE).step_by(1 << 19) {
        let s = f64::from(height) / f64::from(ONE);
        let rim = ((1.0 - s * s).sqrt() * f64::from(1 << CENTRE_BITS)) as i32;
        for off in (0..pitch).step_by(1 << 13) {
            let guess = Guess::new(height, 0, rim - off - pitch / 2 * (ROWS as i32 - 1), geometry);
            let mut prediction = Prediction::new(&guess, &scale, &config);
            prediction.height -= FOLLOWED;
            take(&prediction, &View { picture: &picture, scale }, geometry);
        }
    }
}

#[test]
fn a_rows_sums_fit_along_the_rim() {
    stays_within_along_the_rim::<3, 3>();
    stays_within_along_the_rim::<10, 10>();
    stays_within_along_the_rim::<3, 14>();
    stays_within_along_the_rim::<3, 15>();
    stays_within_along_the_rim::<3, 28>();
    stays_within_along_the_rim::<3, 31>();
    stays_within_along_the_rim::<3, 32>();
    stays_within_along_the_rim::<16, 32>();
}
