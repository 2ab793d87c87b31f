//! Each effect of clock, bus and host against its closed form, the host that repeats its command, and virtual time.

use crate::*;
use sim::effects::stream;
use sim::host::Host;
use sim::native::Clock;

fn long_scene(tables: &str) -> Scene {
    scene(&format!("duration_s = 1000\n{tables}"))
}

#[test]
fn a_fast_clock_has_short_seconds() {
    let mut fast = parts("[effects.clock_tolerance]\nfast_ppm = 10000", 1).link;
    assert!((fast.second_s() - 1.0 / 1.01).abs() < 1e-15);
    let mut slow = parts("[effects.clock_tolerance]\nfast_ppm = -50", 1).link;
    assert!((slow.second_s() - (1.0 + 50e-6)).abs() < 1e-8);
}

/// The share of many packets that arrives.
fn arriving(tables: &str) -> f64 {
    let mut stages = parts(tables, 4).link;
    (0..40_000).filter(|_| stages.pass(1.0).is_some()).count() as f64 / 40_000.0
}

#[test]
fn packets_are_lost_and_corrupted_as_often_as_asked() {
    for (tables, share) in [
        ("[effects.lost_packets]\nlost_percent = 20", 0.8),
        ("[effects.lost_packets]\nlost_percent = 100", 0.0),
        ("[effects.corrupted_packets]\nbit_error_ppm = 1000", f64::powi(1.0 - 1e-3, 128)),
        // Every bit flips: the sum of the flipped is not the flipped sum.
        ("[effects.corrupted_packets]\nbit_error_ppm = 1000000", 0.0),
        (
            "[effects.lost_packets]\nlost_percent = 20\n[effects.corrupted_packets]\nbit_error_ppm = 1000",
            0.8 * f64::powi(1.0 - 1e-3, 128),
        ),
    ] {
        // 40,000 draws know a share to 0.0025; 3 deviations.
        assert!((arriving(tables) - share).abs() < 0.0075, "{tables}: {} for {share}", arriving(tables));
    }
    // Noise alone passes a CRC of 16 bits once in 65,536.
    assert!(arriving("[effects.corrupted_packets]\nbit_error_ppm = 500000") < 4.0 / 40_000.0);
}

#[test]
fn hosts_are_late_by_their_distribution() {
    for (distribution, mean, square) in [("uniform", 0.5, 1.0 / 3.0), ("normal", (2.0 / PI).sqrt(), 1.0)] {
        let tables = format!("[effects.host_jitter]\ndelay_ms = 4\ndistribution = \"{distribution}\"");
        let mut stages = parts(&tables, 3).link;
        let late: Vec<f64> = (0..40_000).map(|_| (stages.pass(7.0).unwrap() - 7.0) / 4e-3).collect();
        let of = |power: i32| late.iter().map(|late| late.powi(power)).sum::<f64>() / late.len() as f64;
        assert!(late.iter().all(|late| *late >= 0.0));
        assert!((of(1) - mean).abs() < 0.01, "{distribution}: mean {}", of(1));
        assert!((of(2) - square).abs() < 0.025, "{distribution}: square {}", of(2));
    }
}

#[test]
fn bursts_come_and_last_as_asked() {
    let burst = "[effects.burst]\nrate_per_s = 50\nlength_us = 2000\namplitude_codes = 100";
    let mut burst = parts(burst, 9).sensor;
    let (mut noisy, mut begun, mut was) = (0, 0, false);
    let steps = 2_000_000;
    for step in 0..steps {
        let mut codes = [1000.0; COLUMNS];
        burst.codes.each(|part| part(step % SLOTS, step as f64 * 1e-4, &mut codes));
        let is = codes != [1000.0; COLUMNS];
        assert!(codes.iter().all(|code| (code - 1000.0).abs() <= 100.0));
        noisy += usize::from(is);
        begun += usize::from(is && !was);
        was = is;
    }
    // 200 s, 10,000 bursts: a Poisson process covers 1 - exp(-rate length) of the time, and restarts from quiet.
    let (share, exact) = (noisy as f64 / steps as f64, 1.0 - f64::exp(-0.1));
    assert!((share / exact - 1.0).abs() < 0.04, "{share} for {exact}");
    let begins = 50.0 * 200.0 * f64::exp(-0.1);
    // Sampled every 0.1 ms, a quiet shorter than that is not seen: 0.5 %.
    assert!((begun as f64 / begins - 1.0).abs() < 0.04, "{begun} for {begins}");
}

#[test]
fn a_lost_goal_arrives_with_the_next_repetition() {
    let scene =
        long_scene("[host]\nperiod_ms = 10\n[[script]]\nat_s = 0.0\ngoal_n = 1\n[[script]]\nat_s = 0.025\ngoal_n = 2");
    // Sent at 0, 10, 20, 25, 35, 45 ms. Those at 25 and 35 ms get lost.
    let mut host = Host::new(&scene);
    let mut numbers = 0..;
    let mut loses = |sent_s| (![3, 4].contains(&numbers.next().unwrap())).then_some(sent_s);
    for (ms, goal_n, silent_ms) in [(-1.0, 0.0, 0), (0.0, 1.0, 0), (24.9, 1.0, 4), (44.9, 1.0, 24), (45.1, 2.0, 0)] {
        assert_eq!(host.goal_n(ms * 1e-3, &mut loses), goal_n, "at {ms} ms");
        assert_eq!(host.silent_ms(ms * 1e-3), silent_ms, "at {ms} ms");
    }
    assert_eq!((host.sent, host.lost), (6, 2));
}

#[test]
fn the_last_of_simultaneous_events_counts_and_late_packets_keep_their_order() {
    let scene = long_scene("[[script]]\nat_s = 0.5\ngoal_n = 1\n[[script]]\nat_s = 0.5\ngoal_n = 2\n");
    let mut host = Host::new(&scene);
    assert_eq!(host.goal_n(0.499, &mut Some), 0.0);
    assert_eq!(host.goal_n(0.5, &mut Some), 2.0);
    for seed in 0..50 {
        let mut host = Host::new(&scene);
        let mut stages = parts("[effects.host_jitter]\ndelay_ms = 300", seed).link;
        let mut last = 0.0;
        for ms in 0..2000 {
            let goal_n = host.goal_n(f64::from(ms) * 1e-3, &mut |sent_s| stages.pass(sent_s));
            assert!(goal_n >= last, "an older goal overtook");
            let silent_ms = host.silent_ms(f64::from(ms) * 1e-3);
            assert!(goal_n == last || silent_ms <= 1, "a goal came {silent_ms} ms before it arrived");
            last = goal_n;
        }
        assert_eq!(last, 2.0);
    }
}

#[test]
fn streams_differ_by_seed_name_and_finger() {
    let streams = [stream(1, "noise", 0), stream(2, "noise", 0), stream(1, "burst", 0), stream(1, "noise", 1)];
    for (place, one) in streams.iter().enumerate() {
        assert!(!streams[..place].contains(one));
    }
}

const DAY_S: f64 = 86_400.0;

/// Ticks of the timer in a slot, and in a second.
const SLOT_TICKS: f64 = 1523.0;
const TIMER_HZ: f64 = 168e6;

fn after(steps: u32, step_s: f64) -> Clock {
    let mut clock = Clock::default();
    (0..steps).for_each(|_| clock.go_on(step_s));
    clock
}

// In as many slots as there are ticks in a second, 1523 s are whole. In six times as many frames, of 11 slots, 28 hours.
sim::sizes!(
    after_more_than_a_day_of_frames_it_is_what_the_timer_says_to_the_last_bit,
    is_after(168_000_000, 1.0, 1523.0),
    is_after(6 * 168_000_000, 11.0, 100_518.0)
);

fn is_after(frames: u32, slots: f64, seconds: f64) {
    let clock = after(frames, slots * SLOT_TICKS / TIMER_HZ);
    assert_eq!((clock, clock.time_s()), (after(seconds as u32, 1.0), seconds));
}

#[test]
fn a_step_that_is_no_whole_number_of_units_counts_as_the_nearest() {
    // 21e15 units are a second.
    for (units, counted) in [(2.9, 3.0), (3.1, 3.0)] {
        assert_eq!(after(1_000, units / 21e15), after(1, 1_000.0 * counted / 21e15));
    }
}

#[test]
fn the_host_repeats_itself_all_day_at_its_period() {
    let scene = scene("duration_s = 90000.0\n[host]\nperiod_ms = 10.0\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n");
    let mut host = Host::new(&scene);
    let mut last_s = 0.0;
    while let Some((at_s, _)) = host.arrival(DAY_S + 0.005, &mut Some) {
        last_s = at_s;
    }
    assert_eq!(host.sent, 8_640_001);
    assert!((last_s - DAY_S).abs() < 1e-9, "{last_s:?} s");
}

const ROW: usize = 4;
/// Full drive into a wall.
const DRIVE: Bridge = Bridge::Driven { duty: 1.0 };

fn running_in() -> World {
    let mut world = world("[object]\ndistance_mm = 0.0\n");
    world.fingers[0].place(1.0);
    world.fingers[0].launch(50.0);
    world
}

#[test]
fn what_lies_between_two_steps_is_what_shorter_steps_come_to() {
    let mut coarse = running_in();
    run(&mut coarse, 100e-6, 1, DRIVE);
    for (off_s, short_steps) in [(-60e-6, 4), (-10e-6, 9), (0.0, 10), (40e-6, 14), (100e-6, 20)] {
        let mut fine = running_in();
        run(&mut fine, 10e-6, short_steps, DRIVE);
        let (row, there) = (coarse.row_off_kpa(0, off_s, ROW), fine.row_kpa(0, f64::INFINITY, ROW));
        for (here, there) in row.into_iter().zip(there) {
            // 10 us of motion change the pressure by 0.05 %.
            assert!((here - there).abs() < 5e-5 * there.max(1.0), "{here} and {there} kPa at {off_s} s");
        }
        if off_s >= 0.0 {
            assert_eq!(coarse.fingers[0].count_ahead(off_s), fine.fingers[0].count_ahead(0.0), "at {off_s} s");
        }
    }
}

#[test]
fn before_the_first_step_nothing_moves() {
    let mut world = running_in();
    assert_eq!(world.row_off_kpa(0, -1.0, ROW), world.row_kpa(0, f64::INFINITY, ROW));
}
