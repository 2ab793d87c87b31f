//! Scenes with the flash image: it does what the native board does, and what is made of a run holds.

use crate::common::image;
use sim::cores;
use sim::demo::{missed, table};
use sim::scene::{self, Scene, read};
use sim::watch::{Agreement, BEYOND_MM, BEYOND_N, Step, Summary, Watch};
use virtual_board::demo;
use virtual_board::scene::simulate;

/// Touches a wall 1 mm away.
const WALL: &str = "about = \"wall\"\nduration_s = 0.1\n[object]\ndistance_mm = 1.0\n[effects.dry_friction]\n\
                    [[script]]\nat_s = 0.0\ngoal_n = 1.0\n";
/// Touches, presses harder, gives way, releases; a tare after the one with which every scene starts.
const STEPS: &str = "about = \"steps\"\nduration_s = 0.8\n[object]\ndistance_mm = 1.0\n[effects.dry_friction]\n[effects.row_sag]\n\
                     [[script]]\nat_s = 0.0\ngoal_n = 1.0\n[[script]]\nat_s = 0.2\ngoal_n = 2.0\n\
                     [[script]]\nat_s = 0.35\ngoal_n = 0.5\n[[script]]\nat_s = 0.5\ngoal_n = 0.0\n\
                     [[event]]\nkind = \"tare\"\nat_s = 0.7\n";

fn scene(text: &str) -> Scene {
    read("test.toml", text).unwrap_or_else(|errors| panic!("{errors}"))
}

#[derive(Debug, Default)]
struct Kept {
    steps: u64,
    times_s: Vec<f64>,
    goal_n: f64,
    force_n: f64,
    sensed_n: f64,
    /// Largest difference of the two in the first 0.1 s.
    error_n: f64,
    every_frame: bool,
    /// Duty at the motor at the end of each frame in the air.
    duties: Vec<f64>,
}

impl Watch for Kept {
    fn wants_every_frame(&self) -> bool {
        self.every_frame
    }

    fn step(&mut self, step: &Step) {
        self.steps += 1;
        self.times_s.push(step.time_s);
        self.goal_n = step.command.goal.0.to_num();
        self.force_n = step.truth.force_n;
        self.sensed_n = step.status.contact.force.0.to_num();
        if step.time_s < 0.1 {
            self.error_n = self.error_n.max((self.sensed_n - self.force_n).abs());
        }
        if step.truth.speed_mm_per_s > 0.0 && step.truth.force_n == 0.0 {
            self.duties.push(step.truth.duty);
        }
    }
}

fn run(scene: &Scene, watch: &mut dyn Watch) -> Summary {
    simulate(&image(), scene, watch).expect("the scene runs")
}

/// The path of the native board in a scene, to which another board's is compared.
fn native(of: &Scene) -> Agreement {
    let mut path = sim::watch::Path::default();
    sim::simulate(of, &mut path).expect("the scene runs natively");
    Agreement::new(of, path)
}

#[test]
fn both_boards_do_the_same_and_one_that_does_otherwise_is_noticed() {
    let of = scene(STEPS);
    let (mut same, mut kept) = (native(&of), Kept::default());
    // A tip that is 5 % stiffer than the image's.
    let mut other = native(&scene(&format!("{STEPS}[tip]\nmodulus_kpa = 262.5\n")));
    let watchers: [&mut dyn Watch; 3] = [&mut same, &mut other, &mut kept];
    let summary = run(&of, &mut Vec::from(watchers));
    println!("{same}\n{:.3} times real time", summary.virtual_s / summary.wall_s);
    assert!(same.held(), "{same}");
    // Two boards that do not differ at all would be one board compared with itself.
    let [(force_n, _), (travel_mm, _)] = same.difference;
    assert!(force_n > 1e-4 && travel_mm > 1e-5, "{same}");
    let [(force_n, _), (travel_mm, _)] = other.beyond;
    assert!(!other.held() && (force_n > BEYOND_N || travel_mm > BEYOND_MM), "{other}");
    assert!(kept.force_n == 0.0 && kept.times_s.last().is_some_and(|time_s| *time_s > 0.79), "{kept:?}");
    // A read is answered within a millisecond, or a little later right behind a goal: none is left out.
    assert!((799..=801).contains(&kept.steps), "{} steps", kept.steps);
    let regular = kept.times_s.windows(2).all(|pair| (0.7e-3..1.4e-3).contains(&(pair[1] - pair[0])));
    assert!(regular && kept.times_s[0] < 0.0, "{:?}", kept.times_s);
    // Status and truth belong to the same frame: during the ramp of 120 N/s the force changes by 12 mN a frame.
    assert!(kept.error_n < 0.012, "{} N", kept.error_n);
}

/// Each duty acts for one frame, from the next PWM period on. On a board that applies duties only at the world's steps of
/// 100 us, against frames of 99.8 us, some act for two frames and others never: the guard then takes the air for an object.
#[test]
fn each_duty_acts_for_a_frame_and_every_frame_is_shown() {
    let mut kept = Kept { every_frame: true, ..Kept::default() };
    // In the air for twice the beat. The speed law answers each count of the encoder, so no two duties are equal.
    let far = WALL.replace("distance_mm = 1.0", "distance_mm = 4.0\n[controller]\napproach_um_per_s = 15000");
    run(&scene(&far), &mut kept);
    assert!(kept.times_s.windows(2).all(|pair| (95e-6..105e-6).contains(&(pair[1] - pair[0]))));
    let twice = kept.duties.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!(kept.duties.len() > 950 && twice == 0, "{twice} of {}: {:?}", kept.duties.len(), kept.duties);
}

/// Holds 1 N on a thing along which the hand then moves, with a host that reads this often, or never at 0.
fn along_a_thing(read_ms: f64) -> Scene {
    let text = format!(
        "about = \"along\"\nduration_s = 0.5\n[object]\ndistance_mm = 0.5\n\
         [hand]\nlift_mm = 1.0\nlift_at_s = 0.2\nlift_s = 0.25\n\
         [host]\nread_ms = {read_ms:.1}\ngrip_friction = 0.4\ngrip_n_per_mm = 1.0\n\
         [effects.tangential]\nn_per_mm = 1.0\nstill = 0.8\nslipping = 0.6\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n"
    );
    scene(&text)
}

#[test]
fn the_host_s_grip_acts_on_what_it_reads_over_the_bus() {
    // A lift by 1 mm loads the grip with 1 N; at a trusted friction of 0.4 that needs 2.5 N, or somewhat more.
    let (mut blind, mut gripping, mut native) = (Kept::default(), Kept::default(), Kept::default());
    sim::simulate(&along_a_thing(0.0), &mut blind).expect("the scene runs natively");
    run(&along_a_thing(2.0), &mut gripping);
    sim::simulate(&along_a_thing(2.0), &mut native).expect("the scene runs natively");
    assert_eq!(blind.goal_n, 1.0);
    // Where it asks for more it asks for a tenth more than it must: a reading sooner or later is that much.
    let ratio = gripping.goal_n / native.goal_n;
    assert!((0.9..1.1).contains(&ratio), "{} N and natively {} N asked for", gripping.goal_n, native.goal_n);
    assert!((2.2..3.0).contains(&gripping.goal_n), "{} N asked for", gripping.goal_n);
    assert!((gripping.force_n - gripping.goal_n).abs() < 0.05, "{} N", gripping.force_n);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_two_boards_hold_one_object() {
    let text = "about = \"grasp\"\nduration_s = 0.15\n[hand]\nfingers = 2\n[object]\ndistance_mm = 0.5\n[effects.object_mass]\n\
                [[script]]\nat_s = 0.0\ngoal_n = 1.0\n";
    let mut kept = Kept::default();
    let digest = run(&scene(text), &mut kept).digest;
    assert!((0.9..1.1).contains(&kept.force_n), "{} N", kept.force_n);
    assert_eq!(run(&scene(text), &mut Kept::default()).digest, digest, "boards side by side repeat");
}

// The library of scenes with the flash image: each holds its bounds there, too.

fn broken(name: &str) -> Vec<String> {
    let scene = sim::cli::load(name, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let outcome = sim::run::run(&scene, &|scene, watch| Ok(simulate(&image(), scene, watch)?), &mut []);
    let outcome = outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
    println!("{name}: {:.2} times real time", outcome.summary.virtual_s / outcome.summary.wall_s);
    let verdicts = outcome.verdicts.iter().filter(|verdict| !verdict.held);
    verdicts.map(|verdict| format!("{name}: {verdict:?}")).collect()
}

/// All but the demonstration, which is judged below.
#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_the_library_holds_its_bounds_on_the_image() {
    let mut names = scene::library_names().expect("the library is there");
    assert!(names.len() >= 14, "{names:?}");
    names.retain(|name| name != "demo");
    // The longest begins first: it takes as long as all others together.
    names.sort_by_key(|name| name != "hot_hour");
    let broken = cores::map(&names, |name| broken(name)).concat();
    assert!(broken.is_empty(), "{broken:#?}");
}

// The demonstration on the flash image.

#[test]
fn every_bound_of_the_demonstration_holds() {
    let (figures, run) = demo::run(&image(), true).expect("the demonstration runs");
    assert_eq!(missed(&figures.checks), 0, "\n{}", table(&figures.checks));
    assert_eq!(figures.forces.steps.len(), 4);
    assert_eq!(run.pictures.iter().map(|picture| picture.goal_n).collect::<Vec<_>>(), [1.0, 2.0, 5.0]);

    // What the board senses is what the world has, and the circle is that of the model: r_c^2 = d (2a - d).
    for picture in &run.pictures {
        assert!((picture.force_n - picture.goal_n).abs() < 0.01 * picture.goal_n, "{picture:?}");
        let d = (picture.goal_n / (std::f64::consts::PI * 0.25)).sqrt();
        assert!((picture.map.radius_mm - (d * (20.0 - d)).sqrt()).abs() < 0.05, "{picture:?}");
        let sum_n: f64 = picture.map.pressures_kpa.iter().flatten().sum::<f64>() * 1.5 * 1.5 * 1e-3;
        assert!((sum_n - picture.goal_n).abs() < 0.03 * picture.goal_n, "{sum_n} N in {picture:?}");
    }
}
