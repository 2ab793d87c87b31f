//! The strokes of the core on a simulated drive, and the record that it keeps of them.

use super::drive::{DELAY_S, FRAME_S, Rig};
use fingertip::measure::series::{CHECK, HEAD, Head, Out};
use fingertip::measure::strokes::{Kept, Strokes, View};
use fingertip::measure::{Ended, MeasureStatus, Row, State, Task};
use fingertip::params::Params;
use fingertip::shipped::Config;
use fingertip::units::Newtons;
use solve::record;
use solve::strokes::Record;

/// Rows that the memory of a capture holds.
pub const ROWS: usize = (40 * 1024 - HEAD) / 4;
/// PWM steps of the full duty.
const PWM: f64 = 8400.0;

/// The parameters by the drive's sheet.
pub fn params(rig: &Rig) -> Params {
    let d = &rig.drive;
    Params {
        encoder_counts_per_turn: d.counts_per_turn as i32,
        reduction_mrad_per_mm: (1e3 * d.rad_per_mm).round() as i32,
        resistance_mohm: (1e3 * d.ohmmeter_ohm).round() as i32,
        torque_constant_unm_per_a: (1e6 * d.sheet_k).round() as i32,
        inertia_ug_m2: (1e9 * d.sheet_inertia).round() as i32,
        ..Params::DEFAULT
    }
}

/// All motions, of which the record keeps the first strokes, up to this number.
pub fn measure(rig: &mut Rig, strokes: usize) -> Record {
    let params = params(rig);
    let config = Config::shipped(&params).expect("a sheet that is allowed");
    let first = rig.view();
    let mut run = Strokes::begin(Task::Strokes, first.count);
    let mut standing = MeasureStatus::running(Task::Strokes);
    let mut bytes = vec![0; 4 * ROWS];
    let (mut check, mut length, mut begun, mut applied, mut full) = (CHECK, 0, 0, 0.0, false);
    while run.running() {
        let now = rig.view();
        let view = View {
            encoder: now.count,
            force: Newtons::from_bits((now.force_n * 65_536.0) as i32),
            supply_mv: (1e3 * now.supply_v).round() as u16,
            applied: (4e3 * applied) as i32,
        };
        run.observe(&view, &mut standing, &config);
        let row = run.row();
        begun += usize::from(row == Some(Kept::Stroke));
        if let Some(row) = row.filter(|_| begun <= strokes && !full) {
            let row: Row<'_, 10, 10> = match row {
                Kept::Stroke => Row::Stroke,
                Kept::Sample(count, voltage) => Row::Sample { count, voltage },
            };
            let mut out = Out::new(&mut bytes[length..], 0, check);
            out.row(&row);
            full = out.full;
            if !full {
                (check, length) = (out.check, length + out.count);
            }
        }
        let duty = (f64::from(run.voltage_mv()) * 1e-3 / now.supply_v * PWM).round() / PWM;
        applied = duty * now.supply_v;
        rig.frame(duty);
    }
    assert_ne!(standing.state, State::Running);
    let [frame_ns, delay_ns] = [FRAME_S, DELAY_S].map(|time_s| (1e9 * time_s).round() as u32);
    let rows = (length / 4) as u32;
    let ended = if full { Ended::Full } else { standing.ended };
    let value = standing.value;
    let head = Head { kind: 2, shape: [10; 2], ended, rows, check, frame_ns, origin: run.origin(), delay_ns, value };
    let series = [&head.bytes(), &bytes[..length]].concat();
    record::strokes(&series, &params).expect("a series")
}
