//! The exact sums of a frame, and the errors of force and centre read from a variant's.

use super::inputs::Frames;
use super::judge::Errors;
use super::output::Number;
use crate::prove::reference::{Real, real};
use fingertip::config::Config;
use fingertip::frame::{COLUMNS, Frame, ROWS};
use fingertip::params::Params;
use fingertip::pressure::{Array, Calibration, TARE_FRAMES};

/// Half of the pitch, mm.
const HALF_PITCH_MM: f64 = 0.75;
/// Newtons for a code on a taxel: its area over the codes for a kPa.
const NEWTONS_PER_CODE: f64 = 1.5 * 1.5 * 1e-3 / 24.0;

/// Largest and root mean square error of the force in N and of the centre in mm.
pub fn errors(returned: &[Vec<Number>], frames: &Frames) -> Option<[[f64; 2]; 2]> {
    let config = Config::new(&Params::DEFAULT).ok()?;
    let tare = tare(frames, &config)?;
    let (mut force, mut centre) = (Errors::default(), Errors::default());
    if returned.len() != frames.contacts.len() {
        return None;
    }
    for (frame, returned) in frames.contacts.iter().zip(returned) {
        let exact = sums(frame, frames, &tare, &config);
        let [sum, x, y] = returned[..] else { return None };
        let ([Some(sum), Some(x), Some(y)], [exact_sum, exact_x, exact_y]) = ([sum, x, y].map(Number::real), exact)
        else {
            force.add(f64::NAN);
            centre.add(f64::NAN);
            continue;
        };
        force.add((&sum - &exact_sum).to_f64().value() * NEWTONS_PER_CODE);
        let along = |moment: Real, exact: Real| (moment / &sum - exact / &exact_sum).to_f64().value() * HALF_PITCH_MM;
        centre.add(along(x, exact_x).hypot(along(y, exact_y)));
    }
    Some([force.both(), centre.both()])
}

/// The tare that the core measures, sixteenths of a code: part of the calibration, the same for every variant.
fn tare(frames: &Frames, config: &Config) -> Option<Vec<i32>> {
    let mut array = Array::new();
    array.calibrate(&Calibration::new(&frames.gains, &[0; ROWS]).ok()?);
    for _ in 0..TARE_FRAMES {
        array.read(&frames.quiet, config);
        array.continue_tare();
    }
    Some(array.tare().collect())
}

/// Sum and moments in codes: gain times net code over 1 - rho N, less the tare.
fn sums(frame: &Frame, frames: &Frames, tare: &[i32], config: &Config) -> [Real; 3] {
    let mut sums = [(); 3].map(|()| real(0, 0));
    for row in 0..ROWS {
        let net = |column| i32::from(frame.code(row, column)) - i32::from(frame.code(ROWS, column));
        let total: i32 = (0..COLUMNS).map(net).sum();
        let remaining = real(1, 0) - real(config.sag_q32 as i32, 32) * real(total, 0);
        for column in 0..COLUMNS {
            let gained = real(net(column) * i32::from(frames.gains[row][column]), 14);
            let value = gained / &remaining - real(tare[row * COLUMNS + column], 4);
            let weight = |place: usize| real(2 * place as i32 - 9, 0);
            let [sum, x, y] = sums;
            sums = [sum + &value, x + &value * weight(column), y + &value * weight(row)];
        }
    }
    sums
}
