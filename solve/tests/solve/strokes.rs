//! The drive solved from recorded strokes, on simulated drives: what is found, how true it is, and what never happens.

use crate::*;
use fingertip::measure::series::{CHECK, Out};
use fingertip::measure::strokes::{Kept, StrokeInputs, Strokes};
use fingertip::measure::{Ended, MeasureState, MeasureStatus, Row, Task};
use fingertip::shipped::Config;
use fingertip::units::Newtons;
use solve::record;
use solve::strokes::{Record, solve};

/// Recorded strokes: all, and the slow ones alone.
const ALL: usize = 32;
const SLOW: usize = 8;
/// Bound of the motions.
const TRAVEL_MM: f64 = 1.6;

const QUANTITIES: [&str; 5] = ["k", "tau", "inertia", "friction forward", "friction back"];

/// Prints the worst of values that belong to drives, and the median; returns the worst.
fn tell(name: &str, values: &[(f64, usize)]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some((worst, number)) = values.first() else { return 0.0 };
    println!("{name}: worst {worst:.2} (drive {number}), median {:.2}", values[values.len() / 2].0);
    *worst
}

/// Standard uncertainties up to which k and tau count as measured.
const MEASURED: [f64; 2] = [0.025, 0.05];

/// Measures drives, number by number, of which it keeps this number of strokes, and judges the results by the bounds that
/// hold for every population in the air. At least `least` of the drives must be measured.
fn judge(
    name: &str,
    numbers: Range<usize>,
    strokes: usize,
    least: usize,
    draw: impl Fn(&mut fastrand::Rng, usize) -> SimulatedDrive,
) {
    // Errors of each quantity, in percent, and drives with an error beyond 5 % and two standard uncertainties.
    let (mut errors, mut silent) = (QUANTITIES.map(|_| Vec::new()), Vec::new());
    let (mut refused, mut measured, count) = (Vec::new(), 0, numbers.len());
    for number in numbers {
        let mut rng = fastrand::Rng::with_seed(number as u64);
        let mut rig = Rig::new(draw(&mut rng, number), rng.u64(..));
        let record = measure(&mut rig, strokes);
        assert!(rig.travel_mm < TRAVEL_MM, "drive {number}: {} mm", rig.travel_mm);
        let d = &rig.drive;
        let found = match solve(&record) {
            Ok(found) => found,
            Err(refusal) => {
                println!("drive {number}: {refusal} {d:?}");
                refused.push(number);
                continue;
            }
        };
        let pairs = [
            (found.torque_constant, d.k),
            (found.time_constant_s, d.tau()),
            (found.inertia_kg_m2, d.inertia),
            (found.friction_nm[0], d.friction_nm),
            (found.friction_nm[1], d.friction_nm),
        ];
        for (place, (found, truth)) in pairs.into_iter().enumerate() {
            let error = (found.value / truth - 1.0).abs();
            errors[place].push((100.0 * error, number));
            if place < 2 && error > 0.05 && found.relative() < 0.5 * error {
                silent.push(number);
            }
        }
        measured += usize::from(pairs.iter().zip(MEASURED).all(|((found, _), most)| found.relative() < most));
    }
    println!("{name}: {measured} of {count} measured, refused {refused:?}, silently wrong {silent:?}");
    let [worst, ..] =
        core::array::from_fn::<_, 5, _>(|place| tell(&format!("{} %", QUANTITIES[place]), &errors[place]));
    assert!(silent.is_empty() && measured >= least, "{measured} measured");
    // By encoders of 256 to 4096 counts, k cannot be exact for every drive of a population.
    assert!(least < 8 || (0.1..5.0).contains(&worst), "{worst}");
}

sim::sizes!(
    ordinary_drives_are_measured,
    judge("ordinary", 0..9, ALL, 8, |rng, _| SimulatedDrive::ordinary(rng)),
    judge("ordinary", 9..30, ALL, 19, |rng, _| SimulatedDrive::ordinary(rng))
);

sim::sizes!(
    varied_drives_are_measured,
    judge("varied", 0..4, ALL, 3, |rng, _| SimulatedDrive::varied(rng)),
    judge("varied", 4..30, ALL, 24, |rng, _| SimulatedDrive::varied(rng))
);

// Slow strokes alone do not separate k from friction that falls with speed. The uncertainties must cover that.
sim::sizes!(
    slow_strokes_alone_say_how_little_they_tell,
    judge("slow", 0..1, SLOW, 0, |rng, _| SimulatedDrive::varied(rng)),
    judge("slow", 1..4, SLOW, 0, |rng, _| SimulatedDrive::varied(rng))
);

// Friction that changes along the travel and from stroke to stroke is not in the model.
sim::sizes!(friction_that_is_not_even_is_not_silently_wrong, uneven(0..4), uneven(4..8));

fn uneven(numbers: Range<usize>) {
    judge("uneven", numbers, ALL, 2, |rng, number| {
        let ripple = if number % 2 == 0 { 0.05 } else { 0.0 };
        SimulatedDrive { ripple, unrest: 0.05, ..SimulatedDrive::varied(rng) }
    });
}

/// Motors that are nothing like the reference, known as far as their sheets go, and one that is far from its sheet.
#[test]
fn other_motors_are_measured_too() {
    let mut rng = fastrand::Rng::with_seed(7);
    let drive = SimulatedDrive::ordinary(&mut rng);
    let motors = [
        // Without a gear on a short crank; a small quick one with a high gear; three times the inertia of the sheet.
        SimulatedDrive {
            rad_per_mm: 0.4,
            friction_nm: 0.3e-3,
            stiction: 0.0,
            counts_per_turn: 4096.0,
            ..drive.clone().of_sheet(16e-3, 8.0, 8e-7)
        },
        SimulatedDrive { rad_per_mm: 18.75, friction_nm: 0.05e-3, ..drive.clone().of_sheet(3.2e-3, 9.0, 0.1e-7) },
        SimulatedDrive { inertia: 2.1e-7, ..drive },
    ];
    judge("other", 0..3, ALL, 2, |_, number| motors[number].clone());
}

#[test]
fn a_refusal_states_its_reason_and_the_number_behind_it() {
    let mut rng = fastrand::Rng::with_seed(7);
    let drive = SimulatedDrive::ordinary(&mut rng);
    let refused = |record: &Record| solve(record).expect_err("nothing to solve");
    // The controller's own: the motor's leads swapped, and an encoder without supply.
    for (counts, reason) in [(-1, Reason::Reversed), (0, Reason::Still)] {
        let mut rig = Rig::new(SimulatedDrive { counts, ..drive.clone() }, 1);
        let refusal = refused(&measure(&mut rig, ALL));
        let NoDrive::Ended(ended) = refusal else { panic!("{refusal}") };
        assert_eq!(ended.reason, reason);
        assert!(ended.value > 0 && rig.travel_mm < TRAVEL_MM);
    }
    // What the samples alone show.
    let record = measure(&mut Rig::new(drive, 1), ALL);
    let changed = |change: fn(i32) -> i32| {
        let mut record = record.clone();
        let samples = record.strokes.iter_mut().flat_map(|stroke| &mut stroke.samples);
        samples.for_each(|sample| sample.count = change(sample.count));
        record
    };
    let counts = 1.4 * record.rad_per_mm / core::f64::consts::TAU * record.counts_per_turn;
    let NoDrive::Reversed(found) = refused(&changed(|count| -count)) else { panic!("not reversed") };
    assert!((f64::from(found) - counts).abs() < 0.1 * counts);
    assert_eq!(refused(&changed(|_| 7)), NoDrive::Still(0));
    assert!(matches!(refused(&changed(|count| if count > 60 { count + 50 } else { count })), NoDrive::Astray(_)));
    // A memory that was full before the motions ended: the strokes in it count, but for the last.
    let full = record::Ended { reason: Reason::Full, value: 5_000 };
    let cut = Record { strokes: record.strokes[..25].to_vec(), ended: Some(full), ..record.clone() };
    let whole = Record { strokes: record.strokes[..24].to_vec(), ..record.clone() };
    let found = solve(&cut);
    assert!(found.is_ok() && found == solve(&whole), "{found:?}");
    assert_eq!(refused(&Record { strokes: record.strokes[..4].to_vec(), ..record.clone() }), NoDrive::Few(2));
    let touched = record::Ended { reason: Reason::Touched, value: 50 };
    assert_eq!(refused(&Record { ended: Some(touched), ..record }), NoDrive::Ended(touched));
}

// The strokes of the core on a simulated drive, and the record that it keeps of them.

/// Rows that the memory of a capture holds.
const ROWS: usize = (40 * 1024 - HEAD) / 4;
/// PWM steps of the full duty.
const PWM: f64 = 8400.0;

fn params(rig: &Rig) -> Params {
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
fn measure(rig: &mut Rig, strokes: usize) -> Record {
    let params = params(rig);
    let config = Config::shipped(&params).expect("a sheet that is allowed");
    let proof = fingertip::measure::BuiltIn::PROOF.expect("it is built in");
    let mut run = Strokes::begin(Task::Strokes, rig.view(0.0).encoder, proof);
    let mut standing = MeasureStatus::running(Task::Strokes);
    let (mut kept, mut begun, mut applied) = (Vec::new(), 0, 0.0);
    while run.running() {
        let inputs = rig.view(applied);
        run.observe(&inputs, &mut standing, &config);
        let row = run.row();
        begun += usize::from(row == Some(Kept::Stroke));
        kept.extend(row.filter(|_| begun <= strokes));
        let supply_v = 1e-3 * f64::from(inputs.supply_mv);
        let duty = (f64::from(run.voltage_mv()) * 1e-3 / supply_v * PWM).round() / PWM;
        applied = duty * supply_v;
        rig.frame(duty);
    }
    assert_ne!(standing.state, MeasureState::Running);
    let ended = if kept.len() > ROWS { Ended::Full } else { standing.ended };
    kept.truncate(ROWS);
    let mut bytes = vec![0; 4 * kept.len()];
    let mut out = Out::new(&mut bytes, 0, CHECK);
    for row in &kept {
        out.row::<10, 10>(&match *row {
            Kept::Stroke => Row::Stroke,
            Kept::Sample(count, voltage) => Row::Sample { count, voltage },
        });
    }
    let [frame_ns, delay_ns] = [FRAME_S, DELAY_S].map(|time_s| (1e9 * time_s).round() as u32);
    let (rows, origin, value) = (kept.len() as u32, run.origin(), standing.value);
    let head = Head { kind: 2, shape: [10; 2], ended, rows, frame_ns, origin, delay_ns, value, ..Head::NONE };
    record::strokes(&crate::sealed(&head, &bytes), &params).expect("a series")
}

// A drive as it comes: winding, friction that falls with speed, encoder, supply that sags.

/// A control frame, and steps of the simulation in it. The duty of a frame acts from the second step's end.
const FRAME_S: f64 = 100e-6;
const STEPS: usize = 6;
const DELAYED: usize = 2;
const DELAY_S: f64 = FRAME_S * DELAYED as f64 / STEPS as f64;

/// Shares of the additional friction that may be left at a speed of `r` Stribeck speeds.
const FALLS: [fn(f64) -> f64; 3] = [|r| 1.0 / (1.0 + r * r), |r| (-r * r).exp(), |r| (-r).exp()];

#[derive(Clone, Debug)]
struct SimulatedDrive {
    pub k: f64,
    pub winding_ohm: f64,
    pub bridge_ohm: f64,
    pub inertia: f64,
    /// Friction at high speed, N m; what standstill adds, as a share of it; and the speed that halves that or so.
    pub friction_nm: f64,
    pub stiction: f64,
    pub stribeck: f64,
    pub falls: fn(f64) -> f64,
    pub counts_per_turn: f64,
    pub rad_per_mm: f64,
    pub source_v: f64,
    pub source_ohm: f64,
    /// Share by which friction changes along the travel, and the period of that in the motor's angle.
    pub ripple: f64,
    pub period_rad: f64,
    /// Friction of each motion differs by up to this share of it.
    pub unrest: f64,
    /// Count direction of the encoder: 1, -1 against the motor, 0 not at all.
    pub counts: i32,
    pub sheet_k: f64,
    pub sheet_inertia: f64,
    /// The resistance that an ohmmeter shows, with the bridge's by its sheet.
    pub ohmmeter_ohm: f64,
}

fn log_uniform(rng: &mut fastrand::Rng, from: f64, to: f64) -> f64 {
    (from.ln() + rng.f64() * (to / from).ln()).exp()
}

fn uniform(rng: &mut fastrand::Rng, from: f64, to: f64) -> f64 {
    from + rng.f64() * (to - from)
}

impl SimulatedDrive {
    /// As `host-tests/sim/tests/fingers/drives.toml` draws them.
    pub fn ordinary(rng: &mut fastrand::Rng) -> Self {
        let winding_ohm = uniform(rng, 2.4, 3.3);
        let rad_per_mm: f64 = 43.0 / 12.0;
        let normal: f64 = (0..12).map(|_| rng.f64()).sum::<f64>() - 6.0;
        Self {
            k: uniform(rng, 4.6e-3, 6.1e-3),
            winding_ohm,
            bridge_ohm: uniform(rng, 0.63, 0.77),
            inertia: uniform(rng, 0.6e-7, 0.82e-7) + 0.05e-7 + 0.03 * (1e-3 / rad_per_mm).powi(2),
            friction_nm: uniform(rng, 0.03e-3, 0.25e-3),
            stiction: uniform(rng, 0.0, 0.5),
            stribeck: 5.0,
            falls: FALLS[0],
            counts_per_turn: log_uniform(rng, 256.0, 4096.0).round(),
            rad_per_mm,
            source_v: uniform(rng, 6.0, 8.4),
            source_ohm: log_uniform(rng, 0.05, 0.5),
            ripple: 0.0,
            period_rad: uniform(rng, 0.5, 6.0),
            unrest: 0.0,
            counts: 1,
            sheet_k: 5.35e-3,
            sheet_inertia: 0.71e-7,
            ohmmeter_ohm: winding_ohm * (1.0 + 0.01 * normal) + 0.7,
        }
    }

    /// With friction of 0.5 to 4 % of the supply, up to half as much again at rest, that falls in any way.
    pub fn varied(rng: &mut fastrand::Rng) -> Self {
        let drive = Self::ordinary(rng);
        let volts = uniform(rng, 0.005, 0.04) * drive.source_v;
        Self {
            friction_nm: volts * drive.k / drive.ohm(),
            stribeck: log_uniform(rng, 2.0, 30.0),
            falls: FALLS[rng.usize(..3)],
            ..drive
        }
    }

    /// The drive with this torque constant (N m/A), resistance (Ohm) and inertia (kg m^2), which its data sheet states correctly.
    fn of_sheet(self, k: f64, winding_ohm: f64, inertia: f64) -> Self {
        Self { k, sheet_k: k, winding_ohm, ohmmeter_ohm: winding_ohm + 0.7, inertia, sheet_inertia: inertia, ..self }
    }

    pub fn ohm(&self) -> f64 {
        self.winding_ohm + self.bridge_ohm
    }

    pub fn tau(&self) -> f64 {
        self.ohm() * self.inertia / (self.k * self.k)
    }
}

struct Rig {
    pub drive: SimulatedDrive,
    rng: fastrand::Rng,
    angle: f64,
    speed: f64,
    current: f64,
    duty: f64,
    supply_v: f64,
    /// Friction of this motion as a share of the mean.
    unrest: f64,
    /// Largest distance from the start so far.
    pub travel_mm: f64,
}

impl Rig {
    pub fn new(drive: SimulatedDrive, seed: u64) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        // The encoder starts anywhere within a count.
        let angle = rng.f64() * TAU / drive.counts_per_turn;
        let supply_v = drive.source_v;
        Self { drive, rng, angle, speed: 0.0, current: 0.0, unrest: 1.0, duty: 0.0, supply_v, travel_mm: 0.0 }
    }

    /// One frame: `duty` acts a third of a frame later than its start.
    pub fn frame(&mut self, duty: f64) {
        for step in 0..STEPS {
            self.step(if step < DELAYED { self.duty } else { duty });
        }
        // A motion begins where the bridge was shorted.
        if self.duty == 0.0 && duty != 0.0 {
            self.unrest = 1.0 + self.drive.unrest * uniform(&mut self.rng, -1.0, 1.0);
        }
        self.duty = duty;
    }

    /// Inputs of the controller in a frame, after one with this voltage at the motor.
    pub fn view(&mut self, applied_v: f64) -> StrokeInputs {
        let count = (self.angle * self.drive.counts_per_turn / TAU).floor() as i32;
        // A converter's noise and steps.
        let supply_mv = (1e3 * (self.supply_v + uniform(&mut self.rng, -4e-3, 4e-3))).round() as u16;
        StrokeInputs {
            encoder: count * self.drive.counts,
            force: Newtons::ZERO,
            supply_mv,
            applied: (4e3 * applied_v) as i32,
        }
    }

    fn step(&mut self, duty: f64) {
        const DT_S: f64 = FRAME_S / STEPS as f64;
        const HENRY: f64 = 70e-6;
        let d = &self.drive;
        let ohm = d.ohm() + duty * duty * d.source_ohm;
        let settled = (duty * d.source_v - d.k * self.speed) / ohm;
        self.current = settled + (self.current - settled) * (-DT_S * ohm / HENRY).exp();
        self.supply_v = d.source_v - d.source_ohm * duty * self.current;
        let r = self.speed.abs() / d.stribeck;
        let share = (d.falls)(r);
        let rippled = 1.0 + d.ripple * (self.angle / d.period_rad * TAU).sin();
        let friction = d.friction_nm * rippled * self.unrest * (1.0 + d.stiction * share);
        let net = d.k * self.current;
        if self.speed != 0.0 {
            let next = self.speed + DT_S * (net - self.speed.signum() * friction) / d.inertia;
            self.angle += DT_S * 0.5 * (self.speed + next);
            self.speed = if next * self.speed > 0.0 { next } else { 0.0 };
        } else if net.abs() > friction {
            self.speed = DT_S * (net - net.signum() * friction) / d.inertia;
            self.angle += DT_S * 0.5 * self.speed;
        }
        self.travel_mm = self.travel_mm.max((self.angle / d.rad_per_mm).abs());
    }
}

/// Strokes of the emulated board for which the cost of the fit is flat around its minimum. The fit once ran out of rounds.
#[test]
fn a_fit_with_nothing_left_to_gain_is_solved() {
    let strokes = record::strokes(include_bytes!("flat-valley.strokes"), &Params::DEFAULT).expect("strokes");
    let k = solve(&strokes).expect("a drive").torque_constant;
    assert!((k.value * 1e6 / f64::from(Params::DEFAULT.torque_constant_unm_per_a) - 1.0).abs() < 0.02, "{k:?}");
}
