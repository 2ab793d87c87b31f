//! The trace pins show what `docs/board.md` says that they show, as wide as it says.

use crate::common::{running, write_param};
use fingertip::params::Params;
use fingertip::shipped::Config;
use sim::plant::Setup;
use virtual_board::measure::PinEdge;
use virtual_board::{Fault, Options, Rig};

const GUARD: usize = 10;
const FRAME: usize = 13;
const CONTROL: usize = 15;
/// 11 slots of 1524 ticks of 168 MHz.
const FRAME_NS: u64 = 11 * 1_524 * 1_000 / 168;
const SLOT_NS: u64 = 1_524 * 1_000 / 168;

/// Runs on for some ms and takes the edges of these pins.
fn edges(rig: &mut Rig, ms: u64) -> Vec<PinEdge> {
    rig.with(|stand| stand.bench.front_end.lock().pin_edges = Some(Vec::new())).expect("it runs");
    rig.run_ms(ms).expect("it runs");
    rig.with(|stand| stand.bench.front_end.lock().pin_edges.take()).expect("it runs").expect("they were asked for")
}

/// Times from each rise of a pin to its fall, and to the next rise, ns.
fn widths_ns(edges: &[PinEdge], pin: usize) -> Vec<[u64; 2]> {
    let own: Vec<_> = edges.iter().filter(|edge| edge.pin == pin).skip_while(|edge| !edge.high).collect();
    own.windows(3).step_by(2).map(|three| [three[1].at_ns - three[0].at_ns, three[2].at_ns - three[0].at_ns]).collect()
}

#[test]
fn the_frame_pin_is_high_for_a_slot_in_each_frame() {
    let mut rig = running(&Setup::default(), &Options::default());
    let widths = widths_ns(&edges(&mut rig, 10), FRAME);
    assert!(widths.len() >= 98, "{} frames", widths.len());
    for [high, period] in widths {
        assert!(high.abs_diff(SLOT_NS) <= 2 && period.abs_diff(FRAME_NS) <= 2, "{high} of {period} ns");
    }
}

/// Two turns a frame: a short one when half of the rows are driven, and the step.
#[test]
fn the_control_pin_is_high_while_control_is_busy() {
    let mut rig = running(&Setup::default(), &Options::default());
    let widths: Vec<u64> = widths_ns(&edges(&mut rig, 10), CONTROL).into_iter().map(|[high, _]| high).collect();
    assert!((198..=202).contains(&widths.len()), "{} turns in 10 ms", widths.len());
    let steps: Vec<_> = widths.iter().filter(|width| **width > 5_000).collect();
    let [least, most] = [steps.iter().min(), steps.iter().max()].map(|width| **width.expect("there are steps"));
    println!("{} steps of {least} to {most} ns", steps.len());
    assert!(steps.len().abs_diff(100) <= 2, "{} of them are steps", steps.len());
    assert!(most < 75_000 && least > 10_000, "{least} to {most} ns");
}

#[test]
fn the_guard_pin_pulses_where_the_guard_trips() {
    let mut rig = running(&Setup::default(), &Options::default());
    assert_eq!(edges(&mut rig, 5).iter().filter(|edge| edge.pin == GUARD).count(), 0, "a sound board");
    rig.inject(Fault::ConvertersStall).expect("it runs");
    let widths = widths_ns(&edges(&mut rig, 2), GUARD);
    assert!(widths.len() >= 8, "{} trips in 2 ms", widths.len());
    for [high, period] in widths {
        // It trips again each 1.75 frames.
        assert!((100..30_000).contains(&high) && period.abs_diff(FRAME_NS * 7 / 4) < 5_000, "{high} of {period} ns");
    }
}

/// The edges of a duty come at the same places of each frame, whatever the scan.
#[test]
fn the_bridge_keeps_step_with_the_scan() {
    let mut rig = running(&Setup::default(), &Options::default());
    for settle_ns in [2_400, 1_001, 7_777, 60_000] {
        write_param(&mut rig, "settle_ns", settle_ns);
        let params = Params { settle_ns: settle_ns as i32, ..Params::DEFAULT };
        let frame = Config::shipped(&params).expect("a scan").timing.frame().0;
        let period = rig
            .with(|stand| {
                let (timer, registers) = stand.session.board_mut().part.pwm_timer();
                timer.period_ticks(registers) as u32
            })
            .expect("it runs");
        assert!(
            frame.is_multiple_of(period) && (4_200..=8_400).contains(&period),
            "{period} ticks in a frame of {frame}"
        );
    }
}
