//! The whole loop in real time: the finger of `bringup::script` in place of array, motor and wall, at the scan's pace.

use bringup::script::{Bench, STEPS};
use cortex_m::peripheral::DWT;
use fingertip::shipped::Pipeline;

use crate::board::guard::Stopwatch;
use crate::board::{scan, trace};
use crate::{CYCLES_PER_US, report, wait_for};

/// Runs the script. The scan's own codes are left where they are.
pub fn run(bench: &mut Bench, pipeline: &mut Pipeline) {
    report::say(format_args!("the loop on the simulated finger: touch, 0.2, 2, 5, 1 N, let go; 2 s"));
    report::flush();
    let frame_ns = pipeline.config().timing.frame_ns;
    let (mut missed, mut answer_most, mut step_most, mut finger_most) = (0, 0, 0, 0);
    let (mut step_sum, mut steps) = (0u64, 0u32);
    let mut seen = scan::newest().sequence;
    let mut answer = Stopwatch::default();
    let mut answers = heapless::Vec::<_, 8>::new();
    while !bench.done() {
        let next = || Some(scan::newest()).filter(|newest| newest.sequence != seen);
        let Some(newest) = wait_for(10, next) else { return report::say(format_args!("the scan has stopped")) };
        // The first may have waited.
        missed += if steps == 0 { 0 } else { newest.sequence.wrapping_sub(seen) - 1 };
        seen = newest.sequence;
        let (frame, sense, command) = bench.inputs();
        trace::Pin::Control.high();
        let begun = DWT::cycle_count();
        pipeline.step(frame, sense, command);
        let stepped = DWT::cycle_count();
        trace::Pin::Control.low();
        if steps > 0 {
            answer = Stopwatch::since(newest.stamp);
            answer_most = answer_most.max(answer.cycles().0);
        }
        let status = *pipeline.status();
        if let Some(done) = bench.pass(&status, frame_ns, answer.cycles()) {
            // As many as there are goals.
            let _ = answers.push(done);
        }
        let passed = DWT::cycle_count();
        step_most = step_most.max(stepped.wrapping_sub(begun));
        step_sum += u64::from(stepped.wrapping_sub(begun));
        finger_most = finger_most.max(passed.wrapping_sub(stepped));
        steps += 1;
        if let Some(fault) = status.fault {
            return report::say(format_args!("the loop stops with fault {}", fault as u8));
        }
    }
    report::figure("loop_missed", missed as f32);
    report::figure("loop_answer_us", answer_most as f32 / CYCLES_PER_US as f32);
    report::figure("step_cycles", step_sum as f32 / steps.max(1) as f32);
    report::figure("step_most_cycles", step_most as f32);
    report::figure("finger_most_cycles", finger_most as f32);
    for done in answers.iter().filter(|done| STEPS.contains(&done.goal)) {
        let step = done.goal - STEPS.start + 1;
        report::figure(format_args!("rise_{step}_ms"), done.rise_ms);
        report::figure(format_args!("overshoot_{step}_percent"), done.overshoot_percent);
        report::figure(format_args!("settled_{step}_ms"), done.settled_ms);
    }
}
