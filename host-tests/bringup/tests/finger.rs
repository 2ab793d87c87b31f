//! The finger on the chip answers as the demonstration's does.

use bringup::script::{Bench, STEPS};
use fingertip::params::Params;
use fingertip::shipped::{Config, Pipeline};
use fingertip::units::CoreCycles;
use serde_json::Value;

#[test]
fn its_steps_are_within_a_tenth_of_the_demonstrations() {
    let config = Config::shipped(&Params::DEFAULT).expect("the defaults make a configuration");
    let (mut pipeline, mut bench) = (Pipeline::new(&config), Bench::new());
    bench.finger.make_table();
    let mut answers = Vec::new();
    while !bench.done() {
        let (frame, sense, command) = bench.inputs();
        pipeline.step(frame, sense, command);
        let status = pipeline.status();
        assert_eq!(status.fault, None, "at {} mm", bench.finger.travel_mm());
        answers.extend(bench.pass(status, config.timing.frame_ns, CoreCycles(0)));
    }
    let demo: Value = serde_json::from_str(include_str!("../../../docs/demo.json")).expect("it is JSON");
    for (answer, step) in answers[STEPS].iter().zip(demo["steps"].as_array().expect("steps")) {
        println!("{answer:?}\n  {}", step);
        for (ours, name, least) in [
            (answer.rise_ms, "rise_ms", 0.0),
            (answer.overshoot_percent, "overshoot_percent", 0.2),
            (answer.settled_ms, "settling_ms", 0.0),
        ] {
            let theirs = step[name].as_f64().expect("a figure");
            let allowed = f64::max(theirs * 0.1, least);
            assert!((f64::from(ours) - theirs).abs() <= allowed, "goal {}: {name} {ours}, {theirs} there", answer.goal);
        }
    }
}
