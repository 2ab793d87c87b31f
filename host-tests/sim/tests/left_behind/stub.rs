//! A board that is quick to build a test on: the core and the plant of `host_tests`, no effects.

use fingertip::config::Config;
use fingertip::record::Digest;
use fingertip::units::Newtons;
use host_tests::native::Native;
use sim::metrics;
use sim::run::RunError;
use sim::scene::{self, Scene, controller};
use sim::watch::{Controller, Cost, Step, Summary, Truth, Watch};

/// The wall of the library, held for a shorter time.
pub fn wall() -> Scene {
    let (path, text) = scene::library::text("wall").unwrap();
    let text = scene::text::set(&text, "duration_s", "0.35").unwrap();
    let text = text.replace("dry_friction", "row_sag").replace("torque_mnm = 0.12", "switch_ohm = 30.0");
    scene::read(&path.to_string_lossy(), &text, &metrics::names()).unwrap()
}

/// Runs a scene; what it costs is made up, and the row's sag is the only effect that it knows.
pub fn board(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, RunError> {
    let params = controller::params(scene);
    let mut setup = controller::setup(scene);
    let sag = scene.effects.iter().find(|named| named.effect.name == "row_sag");
    setup.array.row_ohm = sag.map_or(0.0, |named| named.values.number("switch_ohm"));
    let config = Config::new(&params).map_err(|error| error.to_string())?;
    let mut native = Native::new(&setup, &config);
    watch.begin(&[Controller { params, calibration: None }]);
    let mut digest = Digest::new();
    native.command.tare_request = 1;
    let tare_steps = fingertip::pressure::TARE_FRAMES as i32 + 2;
    let frame_s = f64::from(config.timing.frame_ns()) * 1e-9;
    let steps = (scene.duration_s / frame_s) as i32;
    for step in -tare_steps..=steps {
        let time_s = f64::from(step) * frame_s;
        native.command.torque = step >= 0;
        if step >= 0 {
            let goal = scene.script.iter().rev().find(|event| event.at_s <= time_s);
            native.command.goal = Newtons(fixed(goal.map_or(0.0, |event| event.goal_n)));
        }
        let status = native.step();
        digest.add(status.duty, &status);
        let mut truth = truth(&mut native);
        if watch.wants_pressures(0, time_s) {
            truth.pressures_kpa =
                core::array::from_fn(|row| core::array::from_fn(|column| native.world.pressure_kpa(row, column)));
        }
        let Native { frame, sense, command, .. } = &native;
        watch.step(&Step { finger: 0, time_s, frame, sense, command, status: &status, truth: &truth });
    }
    let ledger = scene.effects.iter().map(|named| Cost { effect: named.effect.name, evaluations: 7, seconds: 1e-3 });
    Ok(Summary {
        virtual_s: scene.duration_s,
        wall_s: 0.01,
        ledger: ledger.collect(),
        digest: format!("{:016x}", digest.value()),
    })
}

fn fixed(newtons: f64) -> fixed::types::I16F16 {
    fixed::types::I16F16::from_num(newtons)
}

fn truth(native: &mut Native) -> Truth {
    let world = &native.world;
    let wall = world.setup().wall;
    Truth {
        force_n: world.force_n(),
        indentation_mm: world.indentation_mm(),
        centre_mm: [wall.centre_x_mm, wall.centre_y_mm],
        travel_mm: world.travel_mm(),
        speed_mm_per_s: world.speed_mm_per_s(),
        current_a: world.current_a(),
        supply_v: world.supply_v(),
        winding_c: 25.0,
        ..Truth::default()
    }
}
