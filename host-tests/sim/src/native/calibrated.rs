//! Finger that the host calibrates as a user does: presses at three places of a plate that is not quite level, from
//! whose records modulus and gains of the taxels are solved, and three forces on a kitchen scale. All effects of the
//! finger act meanwhile, and tip and array remember one press in the next.
//!
//! [`fingers`] compares the errors of the force before and after, for fingers far from their parameters
//! (`populations/unlike.toml`).

use crate::cores;
use crate::native::bench::Bench;
use crate::native::simulate_calibrated;
use crate::population::load;
use crate::run::RunError;
use crate::scene::{Scene, read, set};
use crate::watch::{Summary, Watch};
use fastrand::Rng;
use fingertip::config::newtons;
use fingertip::measure::{MeasureState, Task};
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{Calibration, Config, Gains};
use fingertip::state::Mode;
use solve::gains::Condition;
use solve::modulus::Modulus;
use solve::record;
use solve::scale::{Held, SWINGS};
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// A place on the plate: centre of the contact from the array's middle, mm, and inclination of the plate, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Along the columns and along the rows.
    pub centre_mm: [f64; 2],
    /// Along the columns and along the rows.
    pub tilt_deg: [f64; 2],
}

/// Places of the three presses.
const PLACES: [Place; 3] = [
    Place { centre_mm: [0.3, -0.2], tilt_deg: [1.0, -1.5] },
    Place { centre_mm: [-1.5, 1.0], tilt_deg: [2.0, 0.5] },
    Place { centre_mm: [1.4, 1.2], tilt_deg: [-1.0, 1.0] },
];
/// Pause after a press, s: creep and relaxation recover.
const PAUSE_S: f64 = 10.0;
/// Forces held on the scale.
const HOLDS_N: [f64; 3] = [1.0, 2.5, 4.0];
/// Duration of a swing around a force, s.
const SWING_S: f64 = 0.25;
/// Duration of a hold, and the last part of it, in which scale and array are read, s.
const HOLD_S: f64 = 0.7;
const READ_S: f64 = 0.2;
/// Step of a kitchen scale, N.
const SCALE_STEP_N: f64 = 0.005;
/// Time in which the finger releases the plate, s.
const RELEASE_S: f64 = 0.4;

/// Result of a calibration, to be stored in the controller.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// Parameters with modulus and scale.
    pub params: Params,
    pub gains: Gains,
    /// Steps of the procedure that failed, each with its reason. The finger keeps its values there.
    pub refused: Vec<String>,
}

impl Calibrated {
    /// Calibrates the first finger of a scene.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        calibrate(&mut Bench::new(scene)?, scene)
    }

    /// The scene with the parameters found.
    pub fn scene(&self, scene: &Scene) -> Result<Scene, RunError> {
        let Params { modulus_pa, codes_per_kpa_milli, .. } = self.params;
        let found = [("controller.modulus_pa", modulus_pa), ("controller.codes_per_kpa_milli", codes_per_kpa_milli)];
        changed(scene, &found.map(|(key, value)| (key, value.to_string())))
    }
}

/// The native board with a finger that is calibrated first.
pub fn board(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, RunError> {
    let calibrated = Calibrated::of(scene)?;
    Ok(simulate_calibrated(&calibrated.scene(scene)?, &calibrated.gains, watch)?)
}

/// Calibrates a finger in front of the plate of its scene. The finger has the result in the end.
pub fn calibrate(bench: &mut Bench, scene: &Scene) -> Result<Calibrated, RunError> {
    let mut params = scene.params();
    let (mut presses, mut refused) = (Vec::new(), Vec::new());
    for place in PLACES {
        bench.exchange(&plate(scene, place)?)?;
        bench.tare();
        bench.run(0.02);
        let standing = bench.measure(Task::Press, |_| {});
        if standing.state == MeasureState::Done {
            presses.push(record::press(bench.kept(), &params)?);
        } else {
            refused.push(format!("press: {:?} {}, {:?}", standing.ended, standing.value, bench.status().fault));
        }
        release(bench);
        bench.rest(PAUSE_S);
    }
    let mut gains = Gains::ONE;
    match solve::modulus(&presses) {
        Ok(found) => {
            params.modulus_pa = (1e3 * found.kpa).round() as i32;
            gains = gains_of(&found, params.curve_permille);
            let left_out = &found.gains.left_out;
            refused.extend(left_out.iter().map(|(number, why)| format!("press {number}: {why}")));
        }
        Err(why) => refused.push(format!("modulus: {why}")),
    }
    bench.pipeline().configure(&Config::shipped(&params)?);
    bench.pipeline().calibrate(&Calibration::of(&gains));
    bench.exchange(&plate(scene, PLACES[0])?)?;
    bench.tare();
    let mut held = Vec::new();
    for goal_n in HOLDS_N {
        hold(bench, goal_n, SWING_S);
        for share in SWINGS {
            hold(bench, goal_n * share, SWING_S);
        }
        let [true_n, read_n] = hold(bench, goal_n, HOLD_S);
        let Status { mode, fault, .. } = *bench.status();
        if mode == Mode::Force {
            held.push(Held { shown_n: (true_n / SCALE_STEP_N).round() * SCALE_STEP_N, read_n });
        } else {
            refused.push(format!("{goal_n} N on the scale: {mode:?}, {fault:?}"));
        }
    }
    release(bench);
    bench.rest(PAUSE_S);
    match solve::scale(&held) {
        Ok(scale) => {
            let factor = scale.value;
            params.codes_per_kpa_milli = (f64::from(params.codes_per_kpa_milli) / factor).round() as i32;
            params.modulus_pa = (f64::from(params.modulus_pa) * factor).round() as i32;
        }
        Err(why) => refused.push(format!("scale: {why}")),
    }
    bench.pipeline().configure(&Config::shipped(&params)?);
    Ok(Calibrated { params, gains, refused })
}

/// The scene's finger before a level or inclined plate, with the contact at a place.
pub fn plate(scene: &Scene, place: Place) -> Result<Scene, RunError> {
    let ([x, y], [along_columns, along_rows]) = (place.centre_mm, place.tilt_deg);
    let numbers = [
        ("object.centre_x_mm", x),
        ("object.centre_y_mm", y),
        ("effects.tilted_plane.along_columns_deg", along_columns),
        ("effects.tilted_plane.along_rows_deg", along_rows),
        ("effects.sphere.curvature_per_mm", 0.0),
        ("effects.cylinder.curvature_per_mm", 0.0),
        ("effects.object_stiffness.yield_mm_per_n", 0.0),
    ];
    changed(scene, &numbers.map(|(path, value)| (path, format!("{value:?}"))))
}

/// Returns a scene with other values in its text, each by its path. The seed of a drawn finger is not in its text.
pub fn changed(scene: &Scene, changes: &[(&str, String)]) -> Result<Scene, RunError> {
    let text = changes.iter().try_fold(scene.text.clone(), |text, (path, value)| set(&text, path, value))?;
    Ok(Scene { seed: scene.seed, ..read("finger.toml", &text)? })
}

/// Holds a force, starting from any state. Returns the means of the true force and of the reading over the end, N.
fn hold(bench: &mut Bench, goal_n: f64, seconds: f64) -> [f64; 2] {
    bench.command().goal = newtons((goal_n * 1e3) as i32);
    bench.run(seconds - READ_S);
    let until_s = bench.time_s() + READ_S;
    let (mut true_n, mut read_n, mut count) = (0.0, 0.0, 0.0);
    while bench.time_s() < until_s {
        let status = bench.step();
        true_n += bench.truth().force_n;
        // The reading without creep and temperature drift, as `fingertip calibrate` takes it.
        read_n += f64::from(status.contact.force.0) - f64::from(status.creep.0) - f64::from(status.drift.0);
        count += 1.0;
    }
    [true_n / count, read_n / count]
}

/// Releases the object, then torque off.
fn release(bench: &mut Bench) {
    bench.command().goal = newtons(0);
    bench.run(RELEASE_S);
    bench.command().torque = false;
    bench.run(0.05);
}

/// Gains to store: the inverse of the measured gains; 1 for taxels whose readings do not follow the model.
fn gains_of(found: &Modulus, curve_permille: i32) -> Gains {
    let mut gains = Gains::ONE;
    for (place, taxel) in found.gains.taxels.iter().enumerate() {
        if taxel.condition == Condition::Sound {
            let gain = (f64::from(GAIN_ONE) * taxel.factor(curve_permille)).round();
            gains.set(place, gain.clamp(f64::from(Gains::MIN), f64::from(Gains::MAX)) as u16);
        }
    }
    gains
}

/// Distance of the contact off the centre, mm.
const OFF_MM: f64 = 3.5;
/// Duration of a hold, s.
const TEST_HOLD_S: f64 = 1.5;
/// Tests: name, goal in N, whether it is off the centre.
const TESTS: [(&str, f64, bool); 3] =
    [("1 N", 1.0, false), ("5 N, centred", 5.0, false), ("5 N, off the centre", 5.0, true)];

#[derive(Clone, Debug)]
pub struct Unlike {
    pub calibrated: Calibrated,
    /// Errors of the true force in the order of the tests, as shares of the goal: before and after calibration.
    pub errors: [[f64; 3]; 2],
}

/// Draws a finger, holds forces, calibrates it and holds them again.
fn finger(seed: u64, number: usize) -> Result<Unlike, RunError> {
    let drawn = load("unlike")?.finger(seed, number)?;
    let mut rng = Rng::with_seed(seed ^ (number as u64) << 32);
    let mut taxels: Vec<[usize; 2]> = (0..36).map(|taxel| [2 + taxel / 6, 2 + taxel % 6]).collect();
    rng.shuffle(&mut taxels);
    taxels.truncate(rng.usize(1..=3));
    let angle = TAU * rng.f64();
    let off = Place { centre_mm: [OFF_MM * angle.cos(), OFF_MM * angle.sin()], ..Place::default() };
    let scene = changed(&drawn.scene, &[("effects.broken_taxels.dead", format!("{taxels:?}"))])?;
    let mut bench = Bench::new(&scene)?;
    let errors = |bench: &mut Bench| -> Result<[f64; 3], RunError> {
        let mut errors = [0.0; 3];
        for (error, (_, goal_n, is_off)) in errors.iter_mut().zip(TESTS) {
            bench.exchange(&plate(&scene, if is_off { off } else { Place::default() })?)?;
            bench.tare();
            *error = hold(bench, goal_n, TEST_HOLD_S)[0] / goal_n - 1.0;
            release(bench);
            bench.rest(PAUSE_S);
        }
        Ok(errors)
    };
    let before = errors(&mut bench)?;
    let calibrated = calibrate(&mut bench, &scene)?;
    let after = errors(&mut bench)?;
    Ok(Unlike { calibrated, errors: [before, after] })
}

/// Median and 95th percentile of the absolute errors of each test in percent: before and after calibration.
pub fn percentiles(fingers: &[Unlike]) -> [[[f64; 2]; 3]; 2] {
    [0, 1].map(|when| {
        [0, 1, 2].map(|test| {
            let mut all: Vec<f64> = fingers.iter().map(|finger| 100.0 * finger.errors[when][test].abs()).collect();
            all.sort_by(f64::total_cmp);
            [0.5, 0.95].map(|share| all[((all.len() - 1) as f64 * share).round() as usize])
        })
    })
}

pub fn fingers(seed: u64, count: usize) -> Result<Vec<Unlike>, RunError> {
    cores::map(0..count, |number| finger(seed, number)).into_iter().collect()
}

/// The errors as a text: worst fingers first, then percentiles.
pub fn errors_text(fingers: &[Unlike]) -> String {
    let mut text = String::new();
    let worst = |finger: &Unlike| finger.errors[1].iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
    let mut order: Vec<usize> = (0..fingers.len()).collect();
    order.sort_by(|a, b| worst(&fingers[*b]).total_cmp(&worst(&fingers[*a])));
    for number in order {
        let percent = |error: f64| format!("{:+.1}", 100.0 * error);
        let [before, after] = fingers[number].errors.map(|errors| errors.map(percent).join(", "));
        let refused = fingers[number].calibrated.refused.join("; ");
        let _ = writeln!(text, "finger {}: {before} % before, {after} % after  {refused}", number + 1);
    }
    let [before, after] = percentiles(fingers);
    for ((name, ..), (before, after)) in TESTS.into_iter().zip(before.into_iter().zip(after)) {
        let _ = writeln!(
            text,
            "{name}: error of the true force, median {:.1} % and 95 % at {:.1} % before, {:.1} % and {:.1} % after",
            before[0], before[1], after[0], after[1]
        );
    }
    text
}
