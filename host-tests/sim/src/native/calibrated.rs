//! A finger that is calibrated first, by the device's own procedures, as a user does it: the modulus by a press, gains by
//! three presses at three places of a plate that stands askew by up to 2 degrees, and a kitchen scale with steps of 5 mN
//! at three holds, each higher than the one before. All of the finger's effects are there meanwhile.

use super::bench::Bench;
use super::simulate_calibrated;
use crate::effects::set::Named;
use crate::run::RunError;
use crate::scene::text::{set, write};
use crate::scene::{Scene, controller, read};
use crate::watch::{Summary, Watch};
use fingertip::calibrate::State;
use fingertip::config::newtons;
use fingertip::identify::Identification;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{Calibration, Config, Gains};
use fingertip::state::Mode;

/// Where the plate is pressed, mm, and how it stands, degrees.
const PLATES: [([f64; 2], [f64; 2]); 3] =
    [([0.3, -0.2], [1.0, -1.5]), ([-1.5, 1.0], [2.0, 0.5]), ([1.4, 1.2], [-1.0, 1.0])];
/// What is held on the scale.
const HOLDS_N: [f64; 3] = [1.0, 2.5, 4.0];
/// Frames of a hold, the last of which the scale shows.
const HOLD_FRAMES: usize = 7_000;
const SHOWN_FRAMES: usize = 2_000;
/// The scale's steps, mN.
const SCALE_STEP_MN: f64 = 5.0;
/// Frames that a press may take.
const PRESS_FRAMES: usize = 80_000;
/// Frames to let go in.
const RELEASE_FRAMES: usize = 4_000;

/// What a calibration gives.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The parameters.
    pub params: Params,
    /// The taxels' gains.
    pub gains: Gains,
    /// What was refused meanwhile, and why: the finger keeps what it had.
    pub refused: Vec<String>,
}

impl Calibrated {
    /// Calibrates the first finger of a scene.
    ///
    /// # Errors
    /// What the scene asks for cannot be simulated, or a procedure does not end.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let mut bench = Bench::<Named>::new(&plate(scene, PLATES[0])?)?;
        let mut refused = Vec::new();
        let mut params = controller::params(scene);
        identify(&mut bench, &mut params, &mut refused)?;
        for place in PLATES {
            bench.exchange(&plate(scene, place)?)?;
            let state = press(&mut bench)?;
            if state != State::Done {
                refused.push(format!("press: {state:?}"));
            }
        }
        let standing = bench.pipeline().status().calibration;
        let gains = if standing.presses > 0 { bench.pipeline().proposal().gains } else { Gains::ONE };
        bench.pipeline().calibrate(&Calibration::of(&gains));
        bench.exchange(&plate(scene, PLATES[0])?)?;
        identify(&mut bench, &mut params, &mut refused)?;
        bench.tare();
        for goal_n in HOLDS_N {
            hold(&mut bench, goal_n, &mut refused);
        }
        let scale = bench.pipeline().status().scale;
        if scale.factor_ppm > 0 {
            let factor = f64::from(scale.factor_ppm) * 1e-6;
            params.codes_per_kpa_milli = (f64::from(params.codes_per_kpa_milli) / factor).round() as i32;
            params.modulus_pa = (f64::from(params.modulus_pa) * factor).round() as i32;
        }
        params.check()?;
        Ok(Self { params, gains, refused })
    }

    /// The scene with what was found.
    ///
    /// # Errors
    /// It is no scene then.
    pub fn scene(&self, scene: &Scene) -> Result<Scene, RunError> {
        let Params { modulus_pa, codes_per_kpa_milli, .. } = self.params;
        changed(
            scene,
            &[
                ("controller.modulus_pa", modulus_pa.to_string()),
                ("controller.codes_per_kpa_milli", codes_per_kpa_milli.to_string()),
            ],
        )
    }
}

/// The native board with a finger that is calibrated first.
///
/// # Errors
/// As [`Calibrated::of`].
pub fn board(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, RunError> {
    let calibrated = Calibrated::of(scene)?;
    Ok(simulate_calibrated(&calibrated.scene(scene)?, &calibrated.gains, watch)?)
}

/// A scene with other values.
fn changed(scene: &Scene, changes: &[(&str, String)]) -> Result<Scene, RunError> {
    let bare = Scene { bounds: Vec::new(), ..scene.clone() };
    let text = changes.iter().try_fold(write(&bare), |text, (path, value)| set(&text, path, value))?;
    Ok(Scene { bounds: scene.bounds.clone(), ..read("finger.toml", &text, &[])? })
}

/// The finger before a plate instead of what it was to touch.
fn plate(scene: &Scene, ([x, y], [along_columns, along_rows]): ([f64; 2], [f64; 2])) -> Result<Scene, RunError> {
    let number = |path, value: f64| (path, format!("{value:?}"));
    changed(
        scene,
        &[
            number("object.centre_x_mm", x),
            number("object.centre_y_mm", y),
            number("effects.tilted_plane.along_columns_deg", along_columns),
            number("effects.tilted_plane.along_rows_deg", along_rows),
            number("effects.sphere.curvature_per_mm", 0.0),
            number("effects.cylinder.curvature_per_mm", 0.0),
            number("effects.object_stiffness.yield_mm_per_n", 0.0),
        ],
    )
}

/// Young's modulus by a press; as it was where the press is refused.
fn identify(bench: &mut Bench<Named>, params: &mut Params, refused: &mut Vec<String>) -> Result<(), RunError> {
    bench.pipeline().configure(&Config::shipped(params)?);
    bench.tare();
    let asked = bench.command().identify_request.wrapping_add(1);
    bench.command().identify_request = asked;
    let ended = |status: &Status| status.taken.identify == asked && status.identification.number() > 1;
    if !(0..PRESS_FRAMES).any(|_| ended(&bench.step())) {
        return Err("the press for the modulus does not end".into());
    }
    for _ in 0..RELEASE_FRAMES {
        bench.step();
    }
    match bench.pipeline().status().identification {
        Identification::Done(found) => params.modulus_pa = (found.modulus.0.to_num::<f64>() * 1e3).round() as i32,
        other => refused.push(format!("modulus: {other:?}")),
    }
    bench.pipeline().configure(&Config::shipped(params)?);
    Ok(())
}

/// Presses once, from a tare on; how the press ended.
///
/// # Errors
/// It does not end.
pub fn press(bench: &mut Bench<Named>) -> Result<State, RunError> {
    bench.tare();
    let asked = bench.command().calibrate_request.wrapping_add(1);
    bench.command().calibrate_request = asked;
    for _ in 0..PRESS_FRAMES {
        let status = bench.step();
        let state = status.calibration.state;
        if status.taken.calibrate == asked && state.number() > 1 || status.fault.is_some() {
            bench.command().torque = false;
            bench.step();
            return status.fault.map_or(Ok(state), |fault| Err(format!("a press ended in {fault:?}").into()));
        }
    }
    Err("the press for the gains does not end".into())
}

/// Holds a force and tells what the scale shows.
fn hold(bench: &mut Bench<Named>, goal_n: f64, refused: &mut Vec<String>) {
    bench.command().goal = newtons((goal_n * 1e3) as i32);
    let mut sum_n = 0.0;
    for frame in 0..HOLD_FRAMES {
        bench.step();
        if frame >= HOLD_FRAMES - SHOWN_FRAMES {
            sum_n += bench.truth().force_n;
        }
    }
    let Status { mode, fault, .. } = *bench.pipeline().status();
    if mode != Mode::Force {
        return refused.push(format!("{goal_n} N on the scale: {mode:?}, {fault:?}"));
    }
    let steps = (1e3 * sum_n / SHOWN_FRAMES as f64 / SCALE_STEP_MN).round();
    let command = bench.command();
    command.shown_mn = (SCALE_STEP_MN * steps) as i32;
    command.shown_request = command.shown_request.wrapping_add(1);
    if let Some(why) = bench.step().scale.refusal {
        refused.push(format!("{goal_n} N on the scale: {why:?}"));
    }
}
