//! The drive commissioned over the bus, on drives as they come: what is found, how true it is, and what never happens.

mod host;

use fingertip::shipped::address;
use host::{Came, Host};
use sim::population::{self, Finger, Population};

/// The bounds of the motions: travel, and force on whatever is in the way.
const TRAVEL_MM: f64 = 2.0;
const FORCE_N: f64 = 0.3;

fn drives() -> Population {
    population::read("drives.toml", include_str!("drives.toml")).unwrap_or_else(|errors| panic!("{errors}"))
}

fn value(finger: &Finger, name: &str) -> f64 {
    let found = finger.drawn.iter().find(|(known, _)| known == name);
    let drawn = found.unwrap_or_else(|| panic!("no {name}"));
    drawn.1.number().expect("a number")
}

/// Of values that belong to fingers: the worst, the 95th of a hundred, the median.
fn tell(name: &str, mut values: Vec<(f64, usize)>) -> f64 {
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    let at = |share: f64| values[(values.len() as f64 * share) as usize];
    let (worst, number) = values[0];
    println!("{name}: worst {worst:.2} (drive {number}), 95 % {:.2}, median {:.2}", at(0.05).0, at(0.5).0);
    worst
}

#[test]
fn two_hundred_drives_are_measured() {
    let population = drives();
    let names = ["torque constant %", "time constant %", "inertia %", "friction forward %", "friction back %"];
    let mut errors: [Vec<(f64, usize)>; 5] = Default::default();
    let mut in_sigmas: [Vec<(f64, usize)>; 5] = Default::default();
    let (mut travels, mut forces) = (Vec::new(), Vec::new());
    let mut refused = Vec::new();
    for number in 0..200 {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let mut host = Host::new(&finger.scene);
        let came = host.commission(2);
        travels.push((host.travel_mm, number));
        forces.push((1e3 * host.force_n, number));
        if came != Came::Measured {
            refused.push((number, came));
            println!("drive {number} {came:?}: {:?}", &finger.drawn[..6]);
            continue;
        }
        let k = 1e-3 * value(&finger, "torque_mnm_per_a");
        let ohm = value(&finger, "winding_ohm") + value(&finger, "supply.bridge_ohm");
        let inertia = 1e-7 * (value(&finger, "motor.inertia_g_cm2") + 0.05) + 0.03 * (12e-3_f64 / 43.0).powi(2);
        let friction = 1e-3 * value(&finger, "friction_mnm");
        let found = [
            (address::MEASURED_TORQUE_CONSTANT, address::TORQUE_CONSTANT_SIGMA, 1e-6, k),
            (address::MEASURED_TIME_CONSTANT, address::TIME_CONSTANT_SIGMA, 1e-6, ohm * inertia / (k * k)),
            (address::MEASURED_INERTIA, address::INERTIA_SIGMA, 1e-9, inertia),
            (address::MEASURED_FRICTION_FORWARD, address::FRICTION_FORWARD_SIGMA, 1e-6, friction),
            (address::MEASURED_FRICTION_BACK, address::FRICTION_BACK_SIGMA, 1e-6, friction),
        ];
        for (place, (register, sigma, unit, truth)) in found.into_iter().enumerate() {
            let error = f64::from(host.read(register)) * unit / truth - 1.0;
            let sigma = 1e-3 * f64::from(host.read(sigma));
            errors[place].push((100.0 * error.abs(), number));
            in_sigmas[place].push((error.abs() / sigma, number));
        }
    }
    println!("{} drives measured, refused: {refused:?}", 200 - refused.len());
    let worst: Vec<f64> = names.iter().zip(errors).map(|(name, errors)| tell(name, errors)).collect();
    for (name, sigmas) in names.iter().zip(in_sigmas) {
        let within = sigmas.iter().filter(|(sigmas, _)| *sigmas <= 2.0).count();
        println!("{name}: {within} of {} within two sigmas", sigmas.len());
    }
    let travel = tell("travel mm", travels);
    let force = tell("force mN", forces);
    assert!(travel < TRAVEL_MM && force < 1e3 * FORCE_N);
    let bounds = [3.0, 10.0, 10.0, 15.0, 15.0];
    for ((name, worst), bound) in names.iter().zip(worst).zip(bounds) {
        assert!(worst <= bound, "{name}: {worst}");
    }
}
