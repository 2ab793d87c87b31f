//! The drive commissioned over the bus, on drives as they come: what is found, how true it is, and what never happens.

mod host;

use fingertip::shipped::address;
use host::{Came, Host};
use sim::population::{self, Finger, Population};

/// The bounds of the motions: travel, and force on whatever is in the way.
const TRAVEL_MM: f64 = 2.0;
const FORCE_N: f64 = 0.3;

/// Errors of a status packet.
const RESULT: u8 = 1;
const ACCESS: u8 = 7;

const DRIVES: &str = include_str!("drives.toml");

fn drives() -> Population {
    drives_of(DRIVES)
}

fn drives_of(text: &str) -> Population {
    population::read("drives.toml", text).unwrap_or_else(|errors| panic!("{errors}"))
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

/// The parameters that commissioning may change.
const CHANGED: [&str; 4] = ["torque_constant_unm_per_a", "inertia_ug_m2", "friction_unm", "direction_confirmed"];

fn params(host: &mut Host) -> [u32; 4] {
    CHANGED.map(|name| host.read(param(name)))
}

fn param(name: &str) -> u16 {
    let register = fingertip::shipped::REGISTERS.iter().find(|register| register.name.eq_ignore_ascii_case(name));
    register.expect("a parameter").address
}

/// A drive whose direction nobody confirmed.
fn unconfirmed(finger: &Finger) -> Host {
    let mut host = Host::new(&finger.scene);
    assert_eq!(host.write(param("direction_confirmed"), &0_u32.to_le_bytes()), 0);
    host
}

#[test]
fn swapped_leads_or_channels_are_found_and_safe() {
    let population = drives();
    let (mut travels, mut duties) = (Vec::new(), Vec::new());
    for number in 0..200 {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let mut host = unconfirmed(&finger);
        for swapped in ["leads-swapped", "encoder-reversed"] {
            host.bus.command(&format!("fault {swapped}")).expect("a command");
            assert_eq!(host.commission(1), Came::Refused(5), "drive {number}, {swapped}");
            assert_eq!(host.write(address::COMMISSION_ACCEPT, &[1]), RESULT, "drive {number}, {swapped}");
            assert_eq!(host.write(address::TORQUE_ENABLE, &[1]), RESULT, "drive {number}, {swapped}");
            travels.push((host.travel_mm, number));
            duties.push((100.0 * host.duty, number));
            host.bus.command("mend").expect("a command");
        }
        assert_eq!(host.commission(1), Came::Directed, "drive {number}");
        travels.push((host.travel_mm, number));
        duties.push((100.0 * host.duty, number));
    }
    let travel = tell("travel of a jog mm", travels);
    let duty = tell("duty of a jog %", duties);
    assert!(travel < 1.5 && duty <= 5.0 && duty > 1.0);
}

/// A thing nearer than the strokes go, for half of the drives one that the array does not see.
#[test]
fn what_is_in_the_way_stops_it_below_the_bound() {
    let population =
        drives_of(&DRIVES.replace("distance_mm = { uniform = [2, 8] }", "distance_mm = { uniform = [0.02, 0.8] }"));
    let mut forces = Vec::new();
    let mut counts = [0; 13];
    let mut through = Vec::new();
    for number in 0..200 {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let mut host = Host::new(&finger.scene);
        if number % 2 == 1 {
            host.bus.command("fault array-frozen").expect("a command");
        }
        let blind = number % 2 == 1;
        match host.commission(2) {
            Came::Refused(why) => counts[usize::from(why)] += 1,
            // Less than a touch, or what the array does not see and the motor hardly feels: it makes little of the result.
            came => {
                assert_eq!(came, Came::Measured, "drive {number}");
                assert!(blind || host.force_n < 0.06, "drive {number}: {} N", host.force_n);
                let truth = 1e3 * value(&finger, "torque_mnm_per_a");
                let found = f64::from(host.read(address::MEASURED_TORQUE_CONSTANT));
                through.push((100.0 * (found / truth - 1.0).abs(), number));
            }
        }
        forces.push((1e3 * host.force_n, number));
    }
    println!("refused by reason: {counts:?}, {} went through", through.len());
    let worst = tell("torque constant % of those", through);
    assert!(worst < 5.0);
    assert!(tell("force mN", forces) < 1e3 * FORCE_N);
}

#[test]
fn it_goes_from_the_jog_to_the_parameters_as_a_user_would() {
    let finger = drives().finger(1, 7).unwrap_or_else(|errors| panic!("{errors}"));
    let mut host = unconfirmed(&finger);
    let old = params(&mut host);
    // Nothing is to be had without the direction.
    assert_eq!(host.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(host.write(address::COMMISSION_ACCEPT, &[1]), RESULT);
    assert_eq!(host.commission(2), Came::Refused(3));
    assert_eq!(host.commission(1), Came::Directed);
    assert_eq!(host.write(address::COMMISSION_ACCEPT, &[2]), RESULT);
    assert_eq!(params(&mut host), old);
    assert_eq!(host.write(address::COMMISSION_ACCEPT, &[1]), 0);
    assert_eq!(host.commission(2), Came::Measured);
    assert_eq!(params(&mut host)[..3], old[..3], "a proposal is no parameter");
    let measured = [address::MEASURED_TORQUE_CONSTANT, address::MEASURED_INERTIA, address::MEASURED_FRICTION_FORWARD]
        .map(|register| host.read(register));
    assert_eq!(host.write(address::COMMISSION_ACCEPT, &[2]), 0);
    let new = params(&mut host);
    assert_eq!(new[..2], measured[..2]);
    assert!(new[2].abs_diff(measured[2]) <= 10 && new[3] == 1, "{new:?}, {measured:?}");
    assert_eq!(host.write(address::COMMISSION_ACCEPT, &[2]), RESULT, "what was taken is no proposal any more");
    assert_eq!(host.write(address::TORQUE_ENABLE, &[1]), 0);
    assert_eq!(host.write(address::COMMISSION, &[1]), RESULT, "not with torque on");
}

/// At any moment, and in any of the ways in which a host ends it.
#[test]
fn it_can_be_interrupted_at_any_moment() {
    let population = drives();
    let mut travels = Vec::new();
    for number in 0..60 {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let mut host = Host::new(&finger.scene);
        let old = params(&mut host);
        assert_eq!(host.begin(2), 0);
        (0..1 + 400 * number).for_each(|_| host.frame());
        if host.read(address::COMMISSION_STATE) != 1 {
            continue;
        }
        assert_eq!(host.write(param("inertia_ug_m2"), &[1; 4]), ACCESS, "no parameter changes meanwhile");
        assert_eq!(host.write(address::SAVE_PARAMETERS, &[1]), ACCESS);
        assert_eq!(host.write(address::TARE, &[1]), ACCESS);
        assert_eq!(host.write(address::COMMISSION_ACCEPT, &[2]), ACCESS);
        match number % 4 {
            0 => assert_eq!(host.write(address::COMMISSION, &[0]), 0),
            1 => assert_eq!(host.write(address::TORQUE_ENABLE, &[0]), 0),
            2 => assert_eq!(host.write(address::TORQUE_ENABLE, &[1]), 0),
            _ => host.bus.command("fault supply-low").map(drop).expect("a command"),
        }
        assert_eq!(host.outcome(), Came::Refused(1), "drive {number}");
        (0..500).for_each(|_| host.frame());
        assert_eq!(params(&mut host), old);
        travels.push((host.travel_mm, number));
    }
    assert!(travels.len() > 40, "{} were under way", travels.len());
    assert!(tell("travel mm", travels) < TRAVEL_MM);
}

/// Motors that are nothing like the reference's, known as far as their sheets go, and one that is far from its sheet.
#[test]
fn other_motors_are_measured_too() {
    let motors = [
        // A gearless one on a short crank: 12 V, 0.4 rad/mm.
        (
            "ratio",
            "[motor]\nresistance_ohm = 8\ntorque_mnm_per_a = 16\ninertia_g_cm2 = 8\n\
            [transmission]\nratio = 4\ndrum_radius_mm = 10\n[supply]\nsource_v = 8\n\
            [effects.dry_friction]\ntorque_mnm = 0.3\n",
        ),
        // A small quick one with a high gear.
        (
            "small",
            "[motor]\nresistance_ohm = 9\ntorque_mnm_per_a = 3.2\ninertia_g_cm2 = 0.1\n\
            [transmission]\nratio = 150\ndrum_radius_mm = 8\n[effects.dry_friction]\ntorque_mnm = 0.05\n",
        ),
        // Three times the inertia that the controller has.
        (
            "heavy",
            "[motor]\ninertia_g_cm2 = 2.1\n[controller]\ninertia_ug_m2 = 71\n\
            [effects.dry_friction]\ntorque_mnm = 0.12\n",
        ),
        // One whose torque ripples as by 0.2 N at the tip, which might as well be something that it meets.
        ("rippled", "[effects.dry_friction]\ntorque_mnm = 0.12\n[effects.cogging]\ntorque_mnm = 0.06\n"),
    ];
    for (name, tables) in motors {
        let text = format!("about = \"a motor\"\nduration_s = 1.0\n[object]\ndistance_mm = 5\n{tables}");
        let scene = sim::scene::read("motor.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}\n{text}"));
        let mut host = Host::new(&scene);
        let came = host.commission(2);
        let motor = scene.table("motor");
        let k = motor.number("torque_mnm_per_a");
        let found = 1e-3 * f64::from(host.read(address::MEASURED_TORQUE_CONSTANT));
        let inertia = 1e-2 * f64::from(host.read(address::MEASURED_INERTIA));
        println!(
            "{name}: {came:?}, k {found} of {k}, J {inertia} of {}, friction {} and {} uN m; travel {:.2} mm",
            motor.number("inertia_g_cm2"),
            host.read(address::MEASURED_FRICTION_FORWARD),
            host.read(address::MEASURED_FRICTION_BACK),
            host.travel_mm,
        );
        assert!(host.travel_mm < TRAVEL_MM && host.force_n == 0.0);
        if name == "rippled" {
            assert_eq!(came, Came::Refused(8));
            continue;
        }
        assert_eq!(came, Came::Measured, "{name}");
        assert!(
            (found / k - 1.0).abs() < 0.03 && (inertia / motor.number("inertia_g_cm2") - 1.0).abs() < 0.1,
            "{name}"
        );
    }
}

/// Nine in a row, each where the one before ended. The array is a quiet one: an array that is taken for touched ends a
/// measurement on its way.
#[test]
fn the_tip_ends_where_it_began_however_often_it_is_measured() {
    const TIMES: usize = 9;
    let noisy = "rms_codes = { log_uniform = [0.3, 3] }";
    let warming = "warming_k = { uniform = [0, 20] }";
    assert!(DRIVES.contains(noisy) && DRIVES.contains(warming));
    let population = drives_of(&DRIVES.replace(noisy, "rms_codes = 0.3").replace(warming, "warming_k = 0"));
    let (mut each, mut all) = (Vec::new(), Vec::new());
    for number in 0..20 {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let mut host = Host::new(&finger.scene);
        let place = |host: &mut Host| host.bus.truths()[0].0.travel_mm;
        let first = place(&mut host);
        for _ in 0..TIMES {
            let before = place(&mut host);
            assert_eq!(host.commission(2), Came::Measured, "drive {number}");
            assert!(host.travel_mm < TRAVEL_MM, "drive {number}: {} mm", host.travel_mm);
            each.push(((place(&mut host) - before).abs(), number));
        }
        all.push(((place(&mut host) - first).abs(), number));
    }
    let [each, all] = [("away after one mm", each), ("after nine mm", all)].map(|(name, ways)| tell(name, ways));
    assert!(each < 0.2 && all < 0.5, "{each} and {all} mm");
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
