//! The finger on the chip answers as the demonstration's does.

use bringup::script::{Bench, STEPS};
use bringup::steps;
use fingertip::params::Params;
use fingertip::shipped::{Config, Pipeline};
use fingertip::units::CoreCycles;

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
    let checks = steps::checks();
    for (answer, of_step) in answers[STEPS].iter().zip(checks.chunks(3)) {
        let ours = [answer.rise_ms, answer.overshoot_percent, answer.settled_ms];
        for (ours, check) in ours.into_iter().zip(of_step) {
            let [least, most] = check.within;
            assert!((least..=most).contains(&f64::from(ours)), "{}: {ours}, {least} to {most}", check.what);
        }
    }
}
