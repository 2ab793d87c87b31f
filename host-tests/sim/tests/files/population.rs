//! Populations: shards must equal the whole, and the scenes of the worst fingers repeat their results; range and
//! distribution of draws, and populations that extend another one.

use crate::*;
use sim::population::budget::{Budget, CAUSES, GOALS_N};
use sim::population::{self, Drawn, Population, Report, fingers, load, write_worst};
use sim::shards::Shard;

/// Population of this text, preceded by the keys that every scene needs.
fn population(lines: &str) -> Population {
    let text = format!("about = \"a test\"\nduration_s = 0.06\n{lines}");
    population::read("test.toml", &text).unwrap_or_else(|errors| panic!("{errors}"))
}

const FINGERS: usize = 7;

fn touching() -> Population {
    population::read("touching.toml", include_str!("touching.toml")).unwrap_or_else(|errors| panic!("{errors}"))
}

fn report(population: &Population, shard: Shard) -> Report {
    let fingers = fingers(population, 3, FINGERS, shard, &native::board).unwrap_or_else(|error| panic!("{error}"));
    Report::new(population, "native", 3, FINGERS, fingers)
}

#[test]
fn shards_put_together_are_the_whole_byte_for_byte() {
    let population = touching();
    let folder = folder("population/shards");
    let whole = report(&population, Shard::WHOLE);
    let shard = |number: usize| {
        let path = folder.join(format!("{number}.json"));
        fs::write(&path, report(&population, Shard { number, of: 3 }).json().unwrap()).unwrap();
        path
    };
    // The order of the files does not count.
    let shards = [3, 1, 2].map(shard);
    let merged = Report::merge(&shards).unwrap();
    assert_eq!(merged, whole);
    assert_eq!(merged.summary["counted"].as_array().unwrap().len(), 2, "two counts of one metric are two");
    assert_eq!(merged.json().unwrap(), whole.json().unwrap());

    let [other, none] = ["other.json", "none.json"].map(|name| folder.join(name));
    let report = Report::new(&population, "native", 4, FINGERS, Vec::new());
    fs::write(&other, report.json().unwrap()).unwrap();
    fs::write(&none, "{}").unwrap();
    for (files, expected) in [
        (vec![&shards[1], &shards[2]], "2 of 7 fingers are missing, finger 3 the first"),
        (vec![&shards[0], &shards[0]], "is there twice"),
        (vec![&shards[0], &other], "is of the population"),
        (vec![&none], "is no population's JSON"),
        (vec![], "no files"),
    ] {
        let files: Vec<PathBuf> = files.into_iter().cloned().collect();
        let refused = Report::merge(&files).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn the_worst_run_again_as_they_did() {
    let population = touching();
    let report = report(&population, Shard::WHOLE);
    let inside = report.inside();
    assert!(inside > 0 && inside < FINGERS, "{inside}");
    let paths = write_worst(&population, &report, FINGERS, &folder("population/worst")).unwrap();
    assert_eq!(paths.len(), FINGERS);
    // Those that broke a promise come first; the others are as near to a bound as they come, and say so.
    let worst = report.worst();
    assert!(worst.is_sorted_by_key(|ran| ran.inside));
    let nearest: Vec<f64> = worst.iter().filter_map(|ran| ran.nearest()).map(Verdict::excess).collect();
    let sorted = nearest.is_sorted_by(|a, b| a >= b);
    assert!(nearest.len() == FINGERS && sorted && nearest[FINGERS - 1] < 0.0, "{nearest:?}");
    for (path, ran) in paths.iter().zip(worst) {
        let text = fs::read_to_string(path).unwrap();
        assert!(ran.broken().all(|promise| text.contains(&promise.metric)), "{text}");
        assert_eq!(ran.inside, text.contains("broke no promise, nearest to its bound is "), "{text}");
        let outcome = sim::run::run(&scene(path.to_str().unwrap(), &[], None), &native::board, &mut []).unwrap();
        assert_eq!(outcome.summary.digest, ran.digest);
        let again = outcome.verdicts.iter().map(|verdict| verdict.held);
        assert!(again.eq(ran.promises.iter().map(|promise| promise.held)));
    }
}

#[test]
fn a_finger_that_cannot_be_run_is_named() {
    let population = population(
        "[tip]\nmodulus_kpa = { uniform = [1500, 2000] }\n[motor]\ninertia_g_cm2 = 0.01\n[world]\nstep_us = { uniform = [900, 1000] }\n",
    );
    let error = fingers(&population, 1, 2, Shard::WHOLE, &native::board).unwrap_err().to_string();
    assert!(error.contains("test.toml: finger ") && error.contains("step_us"), "{error}");
}

const DRAWN: usize = 4_000;

/// A key's values over many fingers, sorted.
fn values(population: &Population, key: &str) -> Vec<f64> {
    let number = |finger: usize| {
        let drawn = population.finger(7, finger).unwrap_or_else(|errors| panic!("{errors}")).drawn;
        drawn.iter().find(|(name, _)| name == key).and_then(|(_, value)| value.number()).expect("a number")
    };
    let mut values: Vec<f64> = (0..DRAWN).map(number).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quartiles(values: &[f64]) -> [f64; 5] {
    [0, DRAWN / 4, DRAWN / 2, 3 * DRAWN / 4, DRAWN - 1].map(|rank| values[rank])
}

#[track_caller]
fn near(values: [f64; 5], expected: [f64; 5], tolerance: f64) {
    let close = values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() <= tolerance);
    assert!(close, "{values:?} is not {expected:?} within {tolerance}");
}

#[test]
fn each_way_to_draw_spreads_as_it_says() {
    let population = population(
        r#"
        [object]
        distance_mm = { uniform = [2, 10] }
        centre_x_mm = { normal = [1, 2] }
        [effects.noise]
        rms_codes = { log_uniform = [1, 16] }
        [motor]
        encoder_counts_per_turn = { choice = [256, 512, { uniform = [1000, 2000] }], weights = [1, 2, 1] }
        "#,
    );
    near(quartiles(&values(&population, "object.distance_mm")), [2.0, 4.0, 6.0, 8.0, 10.0], 0.25);
    near(quartiles(&values(&population, "effects.noise.rms_codes")), [1.0, 2.0, 4.0, 8.0, 16.0], 0.4);
    // The quartiles of a normal distribution are 0.674 deviations off its mean; it is cut at 3.
    near(quartiles(&values(&population, "object.centre_x_mm")), [-5.0, -0.35, 1.0, 2.35, 7.0], 0.4);
    let counts = values(&population, "motor.encoder_counts_per_turn");
    let share = |of: fn(f64) -> bool| counts.iter().filter(|count| of(**count)).count() as f64 / DRAWN as f64;
    assert!((share(|count| count == 256.0) - 0.25).abs() < 0.03);
    assert!((share(|count| count == 512.0) - 0.5).abs() < 0.03);
    assert!((share(|count| count.fract() == 0.0 && (1000.0..=2000.0).contains(&count)) - 0.25).abs() < 0.03);
}

#[test]
fn keys_follow_what_was_drawn_once() {
    let population = population(
        r#"
        [draw]
        thing = { choice = ["wall", "ball"] }
        modulus_kpa = { uniform = [200, 300] }
        off = { uniform = [-0.1, 0.1] }
        [tip]
        modulus_kpa = { is = "modulus_kpa" }
        [controller]
        modulus_pa = { is = "1000 * modulus_kpa * (1 + off)" }
        [effects.sphere]
        curvature_per_mm = { by = "thing", ball = { uniform = [0.02, 0.05] }, otherwise = 0 }
        "#,
    );
    let mut balls = 0;
    for number in 0..200 {
        let finger = population.finger(3, number).unwrap();
        let drawn = |name: &str| finger.drawn.iter().find(|(known, _)| known == name).map(|(_, value)| value).unwrap();
        let [true_kpa, off] = ["modulus_kpa", "off"].map(|name| drawn(name).number().unwrap());
        assert_eq!(finger.scene.table("tip").number("modulus_kpa"), true_kpa);
        let known_pa = finger.scene.table("controller").optional("modulus_pa").unwrap();
        assert!((known_pa - 1e3 * true_kpa * (1.0 + off)).abs() <= 0.5);
        let ball = *drawn("thing") == Drawn::Word("ball".into());
        let curvature = finger.scene.effects[0].values.number("curvature_per_mm");
        assert_eq!(ball, (0.02..=0.05).contains(&curvature));
        assert!(ball || curvature == 0.0);
        balls += usize::from(ball);
    }
    assert!((70..130).contains(&balls), "{balls}");
}

#[test]
fn the_magnitude_scales_what_follows_it_and_nothing_else() {
    let at = |magnitude: &str| {
        population(&format!(
            "magnitude = {magnitude}\n[object]\ndistance_mm = {{ uniform = [2, 10] }}\n[effects.noise]\n\
             rms_codes = {{ uniform = [1, 3], follows = \"magnitude\" }}\n[motor]\n\
             encoder_counts_per_turn = {{ uniform = [256, 4096], follows = \"1 / magnitude\" }}\n"
        ))
    };
    let [one, half] = ["1", "0.5"].map(at);
    for number in 0..50 {
        let [one, half] = [&one, &half].map(|population| population.finger(1, number).unwrap().scene);
        let noise = |scene: &Scene| scene.effects[0].values.number("rms_codes");
        assert!((noise(&half) - 0.5 * noise(&one)).abs() < 1e-5);
        let counts = |scene: &Scene| scene.table("motor").number("encoder_counts_per_turn");
        assert!((counts(&half) - 2.0 * counts(&one)).abs() <= 2.0);
        let distance = |scene: &Scene| scene.table("object").number("distance_mm");
        assert_eq!(distance(&half), distance(&one));
    }
}

/// Another draw before a key's and events behind it leave that key's draw as it is.
#[test]
fn events_are_drawn_by_weight_in_order_and_leave_the_other_draws_as_they_are() {
    let plain = "[object]\ndistance_mm = { uniform = [2, 10] }\n";
    let few = population(plain);
    let more = population(&format!(
        "[tip]\nmodulus_kpa = {{ uniform = [200, 300] }}\n{plain}[events]\ncount = {{ uniform = [1, 4] }}\nat_s = {{ uniform = [0, 0.06] }}\n[events.tare]\nweight = 3\n\
         [events.encoder_slip]\nby_counts = {{ uniform = [-9, 9] }}\n"
    ));
    let mut kinds = [0; 2];
    for number in 0..500 {
        let [few, more] = [&few, &more].map(|population| population.finger(5, number).unwrap());
        assert_eq!((&few.drawn[0], few.scene.seed), (&more.drawn[1], more.scene.seed));
        let events = &more.scene.events;
        assert!((1..=4).contains(&events.len()) && events.is_sorted_by_key(|event| event.at_s));
        let slips = events.iter().filter(|event| event.values.optional("by_counts").is_some()).count();
        (kinds[0], kinds[1]) = (kinds[0] + events.len() - slips, kinds[1] + slips);
    }
    let share = kinds[1] as f64 / (kinds[0] + kinds[1]) as f64;
    assert!((share - 0.25).abs() < 0.04, "{share}");
}

#[test]
fn draws_are_the_same_for_ever() {
    let population = population(
        "[draw]\na = { normal = [0, 1] }\n[tip]\nmodulus_kpa = { log_uniform = [100, 400] }\n\
        [object]\ndistance_mm = { uniform = [2, 10] }\ncentre_x_mm = { is = \"a + 1\" }\n\
        [motor]\nencoder_counts_per_turn = { choice = [256, 512, 1024] }\n",
    );
    let mut digest = CRC.digest();
    for finger in (0..100).map(|number| population.finger(1, number).unwrap()) {
        digest.update(format!("{:?} {}\n", finger.drawn, finger.scene.seed).as_bytes());
    }
    assert_eq!(format!("{:016x}", digest.finalize()), "79a0cef24d1e5169");
    assert_ne!(population.finger(2, 0).unwrap().drawn, population.finger(1, 0).unwrap().drawn);
}

#[test]
fn every_finger_of_those_that_come_with_the_project_is_a_scene() {
    for (name, bounds) in [("careful", 9), ("handled", 11), ("ordinary", 9), ("rough", 9)] {
        let population = load(name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(population.name, name);
        for number in 0..500 {
            let finger = population.finger(11, number).unwrap_or_else(|errors| panic!("{name}: {errors}"));
            assert_eq!(finger.scene.bounds.len(), bounds, "{name}");
            let events = finger.scene.events.len();
            assert!(if name == "handled" { (3..=8).contains(&events) } else { events == 0 }, "{events} events");
        }
    }
}

#[test]
fn what_extends_another_says_only_what_is_other() {
    let bound = |name: &str| {
        let scene = load(name).unwrap().finger(1, 0).unwrap().scene;
        let bound = scene.bounds.iter().find(|bound| bound.metric == "hold_error_mn").unwrap().clone();
        (bound.max, bound.max_per_goal_n)
    };
    assert_eq!(bound("careful"), (Some(50.0), Some(100.0)));
    assert_eq!(bound("ordinary"), (Some(100.0), Some(150.0)));
    assert_eq!(bound("rough"), bound("ordinary"));
    // What is counted is added to what the other counts.
    let path = folder("counting").join("counting.toml");
    let count = "[[count]]\nmetric = \"rest_duty_percent\"\nabove = 5.0\n";
    fs::write(&path, format!("extends = \"ordinary\"\n{count}")).unwrap();
    let above = |name: &str| {
        let of_duty = load(name).unwrap().counted.into_iter().filter(|counted| counted.metric == "rest_duty_percent");
        of_duty.map(|counted| counted.above).collect::<Vec<f64>>()
    };
    assert_eq!(above("ordinary"), [2.0]);
    let mut both = above(path.to_str().unwrap());
    both.sort_by(f64::total_cmp);
    assert_eq!(both, [2.0, 5.0]);
}

#[test]
fn the_pages_example_is_a_population() {
    let page = include_str!("../../../../docs/population.md");
    let example = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let population = sim::population::read("docs/population.md", example).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(population.finger(1, 0).unwrap().drawn.len(), 7);
    let handled = load("handled").unwrap().finger(1, 0).unwrap().scene;
    assert!(handled.bounds.iter().all(|bound| page.contains(&format!("`{}`", bound.metric))));
}

#[test]
fn what_is_taken_out_is_zero_and_the_rest_as_it_was() {
    let all = load("budget").unwrap();
    let less = all.clone().without(&["effects.hysteresis.width_percent", "gain_off"]).unwrap();
    for number in 0..5 {
        let [whole, less] = [&all, &less].map(|population| population.finger(3, number).unwrap().drawn);
        let mut zeros = 0;
        for ((name, value), (same, now)) in whole.iter().zip(&less) {
            assert_eq!(name, same);
            match name.as_str() {
                "effects.hysteresis.width_percent" | "gain_off" => {
                    assert!(value.number() != Some(0.0) && now.number() == Some(0.0), "{name}: {value:?}, {now:?}");
                    zeros += 1;
                }
                // What is worked out of the gain.
                "controller.codes_per_kpa_milli" => assert_eq!(now.number(), Some(24_000.0)),
                _ => assert_eq!(value, now, "{name}"),
            }
        }
        assert_eq!(zeros, 2);
    }
    let undrawn = all.without(&["effects.hysteresis.width"]).unwrap_err();
    assert!(undrawn.contains("effects.hysteresis.width"), "{undrawn}");
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_what_makes_the_force_wrong_is_larger_than_what_is_left() {
    let budget = Budget::of(1, &native::board, &native::calibrated::board).unwrap();
    for (goal, goal_n) in GOALS_N.into_iter().enumerate() {
        let largest = budget.changes.iter().map(|changes| changes[goal]).fold(0.0, f64::max);
        // The error of a finger comes from the variation of its parts, and the causes explain all of it.
        assert!((0.02..0.25).contains(&(budget.all[goal] / goal_n)), "{budget:?}");
        assert!(largest > 10.0 * budget.none[goal] && budget.none[goal] > 0.0, "{budget:?}");
    }
    assert!((1..GOALS_N.len()).all(|goal| budget.calibrated[goal] < 0.5 * budget.all[goal]), "{budget:?}");
    assert_eq!((budget.changes.len(), budget.left.len()), (CAUSES.len(), CAUSES.len()));
    let page = budget.page();
    assert!(CAUSES.iter().all(|(about, ..)| page.contains(about)), "{page}");
}

#[test]
fn extending_what_is_not_there_or_extends_itself() {
    let folder = folder("extending");
    let load = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        load(path.to_str().unwrap()).map(drop)
    };
    assert_eq!(load("fine.toml", "extends = \"ordinary\"\nmagnitude = 0.1"), Ok(()));
    let error = population::load("ordinry").unwrap_err();
    let all = "careful, handled, ordinary, rough";
    assert!(error.contains("did you mean `ordinary`?") && error.contains(all), "{error}");
    fs::write(folder.join("broken.toml"), "about =").unwrap();
    for (name, text, expected) in [
        ("none.toml", "extends = \"ordinry\"", "did you mean `ordinary`?"),
        ("itself.toml", "extends = \"itself\"\nabout = \"\"\nduration_s = 1", "itself extends another itself"),
        ("chained.toml", "extends = \"careful\"", "careful extends another itself"),
        ("chained.toml", "extends = \"rough\"", "rough extends another itself"),
        ("over.toml", "extends = \"broken\"", "over.toml extends broken: "),
        ("over.toml", "extends = \"broken\"", "broken.toml:1:8: this is not TOML"),
        ("wrong.toml", "extends = \"ordinary\"\n[tip]\nradius = 9", "wrong.toml over ordinary"),
        ("wrong.toml", "extends = \"ordinary\"\n[tip]\nradius = 9", "radius_mm"),
    ] {
        let error = load(name, text).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}
