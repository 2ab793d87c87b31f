//! The exact sums of a frame, and the errors of force and centre read from a variant's.

use super::inputs::Frames;
use super::judge::Errors;
use super::output::Number;
use crate::prove::reference::{Real, real};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, Frame, ROWS};

/// Half of the pitch, mm.
const HALF_PITCH_MM: f64 = 0.75;
/// Newtons for a code on a taxel: its area over the codes for a kPa.
const NEWTONS_PER_CODE: f64 = 1.5 * 1.5 * 1e-3 / 24.0;

/// Largest and root mean square error of the force in N and of the centre in mm; the tare is the exact reading of the
/// quiet frame.
pub fn errors(returned: &[Vec<Number>], frames: &Frames) -> Option<[[f64; 2]; 2]> {
    let config = Config::shipped(&Params::DEFAULT).ok()?;
    let tare = sums(&frames.quiet, frames, &config);
    let (mut force, mut centre) = (Errors::default(), Errors::default());
    if returned.len() != frames.contacts.len() {
        return None;
    }
    for (frame, returned) in frames.contacts.iter().zip(returned) {
        let [exact_sum, exact_x, exact_y] = sums(frame, frames, &config);
        let exact = [exact_sum - &tare[0], exact_x - &tare[1], exact_y - &tare[2]];
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

/// Sum and moments in codes: gain times net code over 1 - rho N.
fn sums(frame: &Frame, frames: &Frames, config: &Config) -> [Real; 3] {
    let mut sums = [(); 3].map(|()| real(0, 0));
    for row in 0..ROWS {
        let net = |column| i32::from(frame.code(row, column)) - i32::from(frame.code(ROWS, column));
        let total: i32 = (0..COLUMNS).map(net).sum();
        let remaining = real(1, 0) - real(config.sag_q32.into(), 32) * real(total, 0);
        for column in 0..COLUMNS {
            let gained = real(net(column) * i32::from(frames.gains[row][column]), 14);
            let value = gained / &remaining;
            let weight = |place: usize| real(2 * place as i32 - 9, 0);
            let [sum, x, y] = sums;
            sums = [sum + &value, x + &value * weight(column), y + &value * weight(row)];
        }
    }
    sums
}
