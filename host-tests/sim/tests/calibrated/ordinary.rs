//! Ordinary fingers, calibrated by the device's own procedures first: true force against the goal, beside the same
//! fingers as they come.
//!
//! The procedures: the modulus by a press, gains by three presses at three places of a plate that stands askew by up to 2
//! degrees, and a kitchen scale with steps of 5 mN at two holds. All of the finger's effects are there meanwhile.

use crate::gains::press;
use fingertip::identify::Identification;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{Calibration, Config, Gains};
use fingertip::state::Mode;
use sim::effects::set::Named;
use sim::native::bench::Bench;
use sim::native::{self, simulate_calibrated};
use sim::population;
use sim::run::{Outcome, run};
use sim::scene::text::{set, write};
use sim::scene::{Scene, controller, read};

/// Where the plate is pressed, and how it stands.
const PLATES: [([f64; 2], [f64; 2]); 3] =
    [([0.3, -0.2], [1.0, -1.5]), ([-1.5, 1.0], [2.0, 0.5]), ([1.4, 1.2], [-1.0, 1.0])];
/// What is held on the scale.
const HOLDS_N: [f64; 2] = [1.5, 4.0];

fn changed(scene: &Scene, changes: &[(&str, String)]) -> Scene {
    let bare = Scene { bounds: Vec::new(), ..scene.clone() };
    let text = changes.iter().fold(write(&bare), |text, (path, value)| set(&text, path, value).expect("a key"));
    let read = read("finger.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}"));
    Scene { bounds: scene.bounds.clone(), ..read }
}

/// The finger before a plate instead of what it was to touch.
fn plate(scene: &Scene, ([x, y], [along_columns, along_rows]): ([f64; 2], [f64; 2])) -> Scene {
    let none = |path: &'static str| (path, "0.0".to_owned());
    changed(
        scene,
        &[
            ("object.centre_x_mm", format!("{x:?}")),
            ("object.centre_y_mm", format!("{y:?}")),
            ("effects.tilted_plane.along_columns_deg", format!("{along_columns:?}")),
            ("effects.tilted_plane.along_rows_deg", format!("{along_rows:?}")),
            none("effects.sphere.curvature_per_mm"),
            none("effects.cylinder.curvature_per_mm"),
            none("effects.object_stiffness.yield_mm_per_n"),
        ],
    )
}

struct Calibrated {
    params: Params,
    gains: Gains,
}

fn configure(bench: &mut Bench<Named>, params: &Params) {
    bench.pipeline().configure(&Config::shipped(params).expect("a configuration"));
}

/// Young's modulus by a press; as it was where the press is refused.
fn identified(bench: &mut Bench<Named>, params: &Params) -> Params {
    bench.tare();
    bench.command().identify_request += 1;
    let asked = bench.command().identify_request;
    let ended = |status: &Status| status.taken.identify == asked && status.identification.number() > 1;
    assert!((0..80_000).any(|_| ended(&bench.step())), "no end");
    // It lets go.
    for _ in 0..4_000 {
        bench.step();
    }
    match bench.pipeline().status().identification {
        Identification::Done(found) => {
            Params { modulus_pa: (found.modulus.0.to_num::<f64>() * 1e3).round() as i32, ..*params }
        }
        refused => {
            println!("    {refused:?}");
            *params
        }
    }
}

/// What the user does.
fn calibrate(scene: &Scene) -> Calibrated {
    let mut bench = Bench::<Named>::new(&plate(scene, PLATES[0])).expect("it runs");
    let mut params = identified(&mut bench, &controller::params(scene));
    configure(&mut bench, &params);
    let mut taken = 0;
    for place in PLATES {
        bench.exchange(&plate(scene, place)).expect("it runs");
        let state = press(&mut bench);
        taken += usize::from(state.number() == 2);
        if state.number() != 2 {
            println!("    {state:?}");
        }
    }
    // Where all are refused it keeps the gains that it has, and the rest is done all the same.
    let gains = if taken > 0 { bench.pipeline().proposal().gains } else { Gains::ONE };
    bench.pipeline().calibrate(&Calibration::of(&gains));
    bench.exchange(&plate(scene, PLATES[0])).expect("it runs");
    params = identified(&mut bench, &params);
    configure(&mut bench, &params);
    bench.tare();
    for goal_n in HOLDS_N {
        bench.command().goal = fingertip::config::newtons((goal_n * 1e3) as i32);
        let mut shown = Vec::new();
        for frame in 0..7_000 {
            bench.step();
            if frame > 5_000 {
                shown.push(bench.truth().force_n);
            }
        }
        let status = *bench.pipeline().status();
        if status.mode != Mode::Force {
            println!("    {:?} {:?} at {goal_n} N", status.mode, status.fault);
            break;
        }
        let mean_mn = 1e3 * shown.iter().sum::<f64>() / shown.len() as f64;
        bench.command().shown_mn = 5 * (mean_mn / 5.0).round() as i32;
        bench.command().shown_request += 1;
        let scale = bench.step().scale;
        if scale.refusal.is_some() {
            println!("    {:?} at {goal_n} N: {mean_mn} mN", scale.refusal);
        }
    }
    let scale = bench.pipeline().status().scale;
    if scale.factor_ppm > 0 {
        let factor = f64::from(scale.factor_ppm) / 1e6;
        params.codes_per_kpa_milli = (f64::from(params.codes_per_kpa_milli) / factor).round() as i32;
        params.modulus_pa = (f64::from(params.modulus_pa) * factor).round() as i32;
    }
    Calibrated { params, gains }
}

/// Of each hold: what the true force is off, and what may be: 3 % and 20 mN, and 8 % and 50 mN; as shares of these.
fn errors(outcome: &Outcome) -> Vec<[f64; 2]> {
    let held = outcome.holds.iter().filter(|hold| !hold.missed && !hold.faulty);
    held.map(|hold| {
        let off_n = (hold.mean_n - hold.goal_n).abs();
        [off_n / (0.03 * hold.goal_n + 0.02), off_n / (0.08 * hold.goal_n + 0.05)]
    })
    .collect()
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

fn told(name: &str, errors: &[[f64; 2]]) -> [f64; 2] {
    let mut sorted = [0, 1].map(|way| errors.iter().map(|error| error[way]).collect::<Vec<_>>());
    sorted.iter_mut().for_each(|values| values.sort_by(f64::total_cmp));
    let [median, most] = [percentile(&sorted[0], 0.5), percentile(&sorted[1], 0.95)];
    println!(
        "{name}: {} holds, median {median:.2} of 3 % + 20 mN, 95 % at {most:.2} and worst {:.2} of 8 % + 50 mN",
        errors.len(),
        percentile(&sorted[1], 1.0)
    );
    [median, most]
}

#[test]
fn ordinary_fingers_hold_closer_once_they_are_calibrated() {
    let ordinary = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let number = |name, usually| std::env::var(name).map_or(usually, |count| count.parse().expect("a number"));
    let (first, count) = (number("FIRST", 0), number("FINGERS", 10));
    let mut broken = Vec::new();
    for number in first..first + count {
        let scene = ordinary.finger(7, number).unwrap_or_else(|errors| panic!("{errors}")).scene;
        let Calibrated { params, gains } = calibrate(&scene);
        let own = controller::params(&scene);
        let with = changed(
            &scene,
            &[
                ("controller.modulus_pa", params.modulus_pa.to_string()),
                ("controller.codes_per_kpa_milli", params.codes_per_kpa_milli.to_string()),
            ],
        );
        let board = |scene: &Scene, watch: &mut dyn sim::watch::Watch| Ok(simulate_calibrated(scene, &gains, watch)?);
        let as_it_comes = run(&scene, &native::board, &mut []).expect("it runs");
        let calibrated = run(&with, &board, &mut []).expect("it runs");
        let worst = |outcome: &Outcome| errors(outcome).iter().map(|error| error[1]).fold(0.0, f64::max);
        println!(
            "finger {number}: modulus {} to {}, codes {} to {}: {:.2} to {:.2}",
            own.modulus_pa,
            params.modulus_pa,
            own.codes_per_kpa_milli,
            params.codes_per_kpa_milli,
            worst(&as_it_comes),
            worst(&calibrated)
        );
        if !calibrated.passed() {
            broken.push((
                number,
                calibrated.verdicts.iter().filter(|verdict| !verdict.held).cloned().collect::<Vec<_>>(),
                as_it_comes.passed(),
            ));
        }
        before.extend(errors(&as_it_comes));
        after.extend(errors(&calibrated));
    }
    told("as they come", &before);
    let [median, most] = told("calibrated", &after);
    println!("{broken:#?}");
    assert!(broken.is_empty());
    assert!(median < 1.0 && most < 1.0, "{median} {most}");
}
