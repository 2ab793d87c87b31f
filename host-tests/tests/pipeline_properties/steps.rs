//! Runs of steps, judged one by one.

use super::{Input, any_inputs, any_params, at_rest, config, next};
use crate::common::*;
use images::record::Digest;
use proptest::test_runner::TestRunner;
use std::cell::RefCell;
use std::collections::BTreeSet;

/// Runs of each test.
const CASES: u32 = 500;

/// A pipeline and its last inputs.
struct Run {
    pipeline: Pipeline,
    arguments: Record,
    before: Status,
    clear_seen: u8,
    /// A force of at least a contact's was read since the last tare began.
    touched: bool,
    digest: Digest,
    seen: Seen,
}

/// The numbers of the modes, faults, tasks and ends of motions that runs came to.
type Seen = [BTreeSet<u8>; 4];

impl Run {
    /// Tared where `tared` says so; a broken array may refuse.
    fn new(params: &Params, tared: bool) -> Self {
        let pipeline = Pipeline::new(&config(params));
        let mut run = Self {
            pipeline,
            arguments: at_rest(),
            before: Status::default(),
            clear_seen: 0,
            touched: false,
            digest: Digest::new(),
            seen: Seen::default(),
        };
        if tared {
            run.arguments.command.tare_request += 1;
            for _ in 0..TARE_FRAMES + 2 {
                run.arguments.frame.sequence += 1;
                run.step();
            }
        }
        run
    }

    fn take(&mut self, inputs: &[Input]) {
        for input in inputs {
            next(&mut self.arguments, input);
            self.step();
        }
    }

    /// A step, with everything that must hold after it.
    fn step(&mut self) -> Status {
        let clear_before = core::mem::replace(&mut self.clear_seen, self.arguments.command.clear_request);
        let tares = self.arguments.command.tare_request != self.before.taken.tare;
        let measures = self.arguments.command.measure_request != self.before.taken.measure;
        let task = Task::of(self.arguments.command.measure_request);
        let strokes = measures && matches!(task, Task::Jog | Task::Strokes);
        let Record { frame, sense, command } = &self.arguments;
        let (duty, &status) = self.pipeline.step(frame, sense, command);
        self.digest.add(duty, &status);

        assert!(duty.0 >= -Duty::FULL, "{duty:?}");
        assert_eq!(duty, status.duty);
        if !drives(status.mode) {
            assert_eq!(duty, Duty::ZERO, "{:?} does not drive", status.mode);
        }
        if !command.torque && status.mode != Mode::Strokes {
            assert!(!drives(status.mode), "{:?} without torque", status.mode);
        }
        assert_eq!(status.mode == Mode::Fault, status.fault.is_some());
        if self.before.mode == Mode::Fault {
            let cleared = command.clear_request != clear_before && !command.torque;
            let sound = match status.mode {
                // What is requested in the same frame may find the next fault.
                Mode::Fault if cleared => tares || strokes,
                Mode::Fault => status.fault == self.before.fault,
                Mode::Tare => cleared && tares,
                Mode::Strokes => cleared && strokes,
                Mode::Off => cleared && (!tares || status.tare == Taring::Refused),
                _ => false,
            };
            assert!(sound, "{:?} {:?} after {:?}", status.mode, status.fault, self.before.fault);
        }
        // A tare begins or is refused, and a measurement that was asked for runs, waits or is refused: nothing is lost.
        assert_eq!((status.taken.tare, status.taken.clear), (command.tare_request, command.clear_request));
        if tares {
            let faulted = status.mode == Mode::Fault;
            // What is pressed refuses a tare; the zero before remains.
            let tared = !self.before.limits.has(Limits::NOT_TARED) && !status.limits.has(Limits::NOT_TARED);
            let pressed = tared && self.touched && !command.tare_forced;
            let expected = if status.mode == Mode::Tare { Taring::Running } else { Taring::Refused };
            assert_eq!(status.tare, expected, "{:?}", status.mode);
            assert!(status.mode == Mode::Tare || faulted || pressed, "{:?} refuses a tare", status.mode);
            if self.before.mode == Mode::Force && !command.tare_forced {
                assert_eq!(status.tare, Taring::Refused, "a contact was held");
            }
        }
        let least = self.pipeline.config().contact_on;
        self.touched = status.mode != Mode::Tare && (self.touched || status.contact.force >= least);
        assert_eq!(status.tare == Taring::Running, status.mode == Mode::Tare);
        let was_running = self.before.measure.state == MeasureState::Running;
        let runs = status.measure.state == MeasureState::Running;
        if measures && status.taken.measure != command.measure_request {
            // For torque, for rest, or for the frame after the one in which a motion was interrupted.
            let torque = task == Task::Press && command.torque;
            let interrupted = was_running && status.measure.ended == Ended::Interrupted;
            let rest = matches!(task, Task::Jog | Task::Strokes) && (self.before.braking || status.braking);
            assert!(torque || rest || interrupted, "{task:?} waits in {:?}", status.mode);
        } else if measures && task != Task::Stop && !was_running {
            assert_eq!(status.measure.task, task);
            // Accepted or refused; a fault may end it in its first frame.
            assert!(runs || status.measure.state == MeasureState::Ended, "{status:?}");
        }
        assert!(!runs || status.mode != Mode::Press || status.measure.task == Task::Press);
        assert!(!runs || matches!(status.mode, Mode::Press | Mode::Strokes), "{status:?}");
        assert!(runs || status.mode != Mode::Strokes);
        let early = status.measure.value != 0 || status.measure.ended != Ended::Complete;
        assert_eq!(early, status.measure.state == MeasureState::Ended);
        if was_running && runs {
            let before = (self.before.mode, self.before.measure.task);
            assert_eq!((status.mode, status.measure.task), before, "another began");
        }
        if status.mode == Mode::Press && !measures {
            assert!(was_running, "a press goes on after its answer: {status:?}");
        }
        // Torque starts from the present goal and touch; a measurement begins only with its request.
        if drives(status.mode) && !drives(self.before.mode) && status.mode != Mode::Strokes {
            let sound = match status.mode {
                Mode::Approach | Mode::Force => command.goal > Newtons::ZERO,
                // With a goal only where the array's signal vanished, or on a silent bus: that is released first.
                Mode::Release => {
                    let silent = command.bus_watchdog_ms != 0 && sense.bus_silent_ms >= command.bus_watchdog_ms;
                    let vanished = status.contact.force < self.pipeline.config().contact_on;
                    command.goal <= Newtons::ZERO || silent || vanished
                }
                _ => measures,
            };
            assert!(sound, "{:?} first after {:?}", status.mode, self.before.mode);
        }
        let contact = status.contact;
        let tip = self.pipeline.config().tip;
        assert!(contact.force >= Newtons::ZERO);
        assert!((0..=tip.depth_max().to_bits()).contains(&contact.indentation.to_bits()));
        assert!((0..=100).contains(&contact.bad_taxels));
        let fault = status.fault.map_or(0, |fault| fault as u8);
        let numbers = [status.mode as u8, fault, status.measure.task as u8, status.measure.ended as u8];
        for (seen, number) in self.seen.iter_mut().zip(numbers) {
            seen.insert(number);
        }
        self.before = status;
        status
    }
}

proptest! {
    #![proptest_config(super::fixed(CASES))]

    #[test]
    fn the_same_run_gives_the_same_bits(params in any_params(), inputs in any_inputs(100)) {
        let digest = || {
            let mut run = Run::new(&params, true);
            run.take(&inputs);
            run.digest.value()
        };
        prop_assert_eq!(digest(), digest());
    }

    /// Whatever was commanded before: nothing drives without torque, and torque on again forgets the old goal.
    #[test]
    fn nothing_commanded_acts_after_torque_off(params in any_params(), inputs in any_inputs(100)) {
        let mut run = Run::new(&params, true);
        run.take(&inputs);
        run.arguments.command.torque = false;
        for _ in 0..10 {
            prop_assert_eq!(run.step().duty, Duty::ZERO);
        }
        run.arguments.command.torque = true;
        run.arguments.command.goal = Newtons::ZERO;
        let mode = run.step().mode;
        prop_assert!(matches!(mode, Mode::Release | Mode::Off | Mode::Tare | Mode::Fault), "{:?}", mode);
    }

    #[test]
    fn a_stop_from_outside_is_latched(params in any_params(), before in any_inputs(60), after in any_inputs(60)) {
        let mut run = Run::new(&params, true);
        run.take(&before);
        run.pipeline.stop(Fault::LostFrames);
            let status = *run.pipeline.status();
        prop_assert_eq!((status.mode, status.duty), (Mode::Fault, Duty::ZERO));
        prop_assert!(status.fault.is_some());
        run.before = status;
        run.take(&after);
    }

    /// New parameters at any time: the bridge is off, and the loop continues with them.
    #[test]
    fn parameters_may_change_at_any_moment(
        first in any_params(),
        second in any_params(),
        before in any_inputs(60),
        after in any_inputs(60),
    ) {
        let mut run = Run::new(&first, true);
        run.take(&before);
        run.pipeline.configure(&config(&second));
        if run.before.mode != Mode::Fault {
            run.before.mode = Mode::Off;
        }
        run.take(&after);
    }
}

/// Any run keeps to the rules. They reach each mode, and each fault that a step can find.
#[test]
fn any_run_keeps_to_the_rules_and_the_runs_come_everywhere() {
    let all = RefCell::new(Seen::default());
    let inputs = (any_params(), prop::bool::weighted(0.9), any_inputs(200));
    let outcome = TestRunner::new(super::fixed(3 * CASES)).run(&inputs, |(params, tared, inputs)| {
        let mut run = Run::new(&params, tared);
        run.take(&inputs);
        for (all, seen) in all.borrow_mut().iter_mut().zip(run.seen) {
            all.extend(seen);
        }
        Ok(())
    });
    outcome.expect("the rules hold");
    let [modes, faults, tasks, ends] = all.into_inner();
    assert_eq!(Vec::from_iter(modes), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(Vec::from_iter(tasks), [0, 1, 2, 3]);
    assert!([0, 1, 2, 3].iter().all(|number| ends.contains(number)), "{ends:?}");
    // Fault 1 is a repeated frame. The others are detected outside of the step.
    assert_eq!(Vec::from_iter(faults), [0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 14, 15]);
}
