//! Frame rate, crosstalk and noise of the scan's settings, by the board's electrical model.

use super::inputs::Frames;
use super::kernels::Errors;
use super::output::Number;
use super::page::figure;
use crate::prove::reference::{Real, real};
use fingertip::params::Params;
use fingertip::scan::ScanTiming;
use fingertip::shipped::{CLOCKS, COLUMNS, Config, Frame, ROWS, TAXELS};
use sim::mechanics::decay;
use sim::setup::{Array, Setup};
use std::fmt::Write as _;

/// Noise of a conversion, codes: assumed, as the simulated converters have none.
const NOISE_CODES: f64 = 1.0;
/// The converter's resistance and capacitance with the largest source for which 15 cycles are meant: 6 kOhm, 10 kOhm, 4
/// pF.
const SAMPLING_TAU_S: f64 = (6e3 + 10e3) * 4e-12;
/// Force of a code on a taxel, mN.
const MN_PER_CODE: f64 = 1.5 * 1.5 / 24.0;

/// Settle time in ns, sampling time in converter cycles, frames averaged.
type Setting = (u32, u16, u32);
const DEFAULT: Setting = (Params::DEFAULT.settle_ns as u32, Params::DEFAULT.sample_cycles as u16, 1);
const SETTINGS: [Setting; 14] = [
    (600, 3, 1),
    (600, 15, 1),
    (1_200, 15, 1),
    (1_800, 15, 1),
    (2_400, 3, 1),
    DEFAULT,
    (2_400, 28, 1),
    (2_400, 56, 1),
    (3_600, 15, 1),
    (4_800, 15, 1),
    (2_400, 15, 2),
    (2_400, 15, 4),
    (2_400, 15, 16),
    (4_800, 56, 16),
];

struct Row {
    setting: Setting,
    rate_hz: f64,
    row: f64,
    column: f64,
    noise_codes: f64,
}

impl Row {
    fn of(setting: Setting, array: &Array) -> Option<Self> {
        let (settle_ns, sample_cycles, frames) = setting;
        let timing = ScanTiming::new(settle_ns, sample_cycles, [ROWS, COLUMNS], &CLOCKS).ok()?;
        let cycle_s = 1.0 / f64::from(CLOCKS.converter_hz);
        let sampling_s = (f64::from(sample_cycles) - 0.5) * cycle_s;
        Some(Self {
            setting,
            rate_hz: 1e9 / f64::from(timing.frame_ns) / f64::from(frames),
            row: decay(f64::from(settle_ns) * 1e-9 / array.settle_tau_s),
            column: decay(sampling_s / SAMPLING_TAU_S),
            noise_codes: NOISE_CODES / f64::from(frames).sqrt(),
        })
    }
}

pub fn markdown() -> String {
    let array = Setup::default().array;
    let mut rows: Vec<_> = SETTINGS.into_iter().filter_map(|setting| Row::of(setting, &array)).collect();
    rows.sort_by(|a, b| b.rate_hz.total_cmp(&a.rate_hz));
    let mut page = String::from(
        "\n## Scan settings\n\nBy the board's electrical model; no code was run. A row's edge settles with tau = 0.2 us, and the converter's capacitor \
        (4 pF behind 6 kOhm and a source of 10 kOhm) keeps a share of the column before. A conversion's noise is **assumed** to be 1 code rms. \
        *Error* is that of a taxel beside a saturated one; *force noise* is that of the sum of 100 taxels. Bold is the default.\n\n\
        | settle, us | sampling, cycles | frames averaged | results a second | error, codes | \
        force noise, mN rms |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for row in &rows {
        let (settle_ns, sample_cycles, frames) = row.setting;
        // Crosstalk of a full range, and noise.
        let error_codes = Array::CODES * (row.row + row.column) + row.noise_codes;
        let noise_mn = row.noise_codes * MN_PER_CODE * (TAXELS as f64).sqrt();
        let (settle_us, [error, noise]) = (f64::from(settle_ns) * 1e-3, [error_codes, noise_mn].map(figure));
        let bold = if row.setting == DEFAULT { "**" } else { "" };
        let setting = format!("{bold}{settle_us}{bold} | {bold}{sample_cycles}{bold} | {frames}");
        let _ = writeln!(page, "| {setting} | {:.0} | {error} | {noise} |", row.rate_hz);
    }
    page
}

// The exact sums of a frame, and the errors of force and centre read from a variant's.

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
