//! Temperatures: the winding's in the controller is bounded, never lower than the true one, and limits the current; the
//! array's drift with the microcontroller's is compensated.

use crate::common::*;
use fingertip::chip::{Chip, FRAMES, Factory};
use fingertip::control::{Creep, TemperatureDrift, Winding};

/// Parameters with the thermal lag of a winding only, of a small motor: enough for these tests.
const QUICK: Params = Params { housing_k_per_w: 0, winding_k_per_w: 46, winding_time_ms: 2_000, ..images::CONFIRMED };

/// g R i of a current, Q8 mm/s^2.
fn driven(config: &Config, amperes: f64) -> i32 {
    let most = f64::from(config.params.current_max_ma) * 1e-3;
    (f64::from(config.current_max_q8_mm_per_s2) * amperes / most) as i32
}

fn degrees(winding: &Winding, config: &Config) -> f64 {
    winding.temperature(config).0.to_num()
}

/// True properties of a motor, as opposed to its controller's parameters.
#[derive(Clone, Copy, Debug)]
struct Truth {
    ohm: f64,
    k_per_w: [f64; 2],
    tau_s: [f64; 2],
    ambient_c: f64,
    above_k: [f64; 2],
}

impl Truth {
    fn of(p: &Params) -> Self {
        let milli = |value: i32| f64::from(value) * 1e-3;
        Self {
            ohm: milli(p.resistance_mohm),
            k_per_w: [p.winding_k_per_w.into(), p.housing_k_per_w.into()],
            tau_s: [milli(p.winding_time_ms), milli(p.housing_time_ms)],
            ambient_c: p.ambient_c.into(),
            above_k: [0.0; 2],
        }
    }

    fn degrees(&self) -> f64 {
        self.ambient_c + self.above_k[0] + self.above_k[1]
    }

    /// Applies a voltage to a motor at rest: a warm winding draws less current.
    fn pass(&mut self, volts: f64, seconds: f64) {
        let warm_ohm = self.ohm * (1.0 + 0.0039 * (self.degrees() - 25.0));
        let watts = volts * volts / warm_ohm;
        for ((above, k_per_w), tau_s) in self.above_k.iter_mut().zip(self.k_per_w).zip(self.tau_s) {
            *above += (k_per_w * watts - *above) * (1.0 - (-seconds / tau_s).exp());
        }
    }
}

#[test]
fn a_steady_current_warms_it_by_a_quarter_more_than_the_parameters_say() {
    for (params, amperes) in [(QUICK, 0.1), (QUICK, 0.35), (Params { resistance_mohm: 12_000, ..QUICK }, 0.05)] {
        let config = allowed(params);
        let mut winding = Winding::new();
        for _ in 0..(16.0 / frame_s(&config)) as u32 {
            winding.observe(driven(&config, amperes), &config);
        }
        let rise = degrees(&winding, &config) - f64::from(params.ambient_c);
        let expected = 1.25 * 46.0 * 1e-3 * f64::from(params.resistance_mohm) * amperes * amperes;
        assert!((rise / expected - 1.0).abs() < 0.005, "{amperes} A: {rise} K of {expected}");
    }
}

/// Who leaves the model out by new parameters has not to wait until its heat is gone.
#[test]
fn what_is_left_out_later_holds_no_heat_of_before() {
    let mut winding = Winding::new();
    let warm = allowed(images::CONFIRMED);
    (0..10_000).for_each(|_| winding.observe(driven(&warm, 0.3), &warm));
    assert!(degrees(&winding, &warm) > 80.0);
    let hot = allowed(Params { winding_max_c: 85, ambient_c: 60, ..images::CONFIRMED });
    (0..256).for_each(|_| winding.observe(0, &hot));
    assert_eq!(winding.share(), 0);
    let left_out = allowed(Params { winding_k_per_w: 0, housing_k_per_w: 0, ..hot.params });
    (0..256).for_each(|_| winding.observe(0, &left_out));
    assert_eq!(winding.share(), 256);
    assert!((degrees(&winding, &left_out) - 60.0).abs() < 1e-3);
}

#[test]
fn after_a_reset_it_is_as_warm_as_a_housing_can_be_and_cools() {
    let config = allowed(images::CONFIRMED);
    let mut winding = Winding::new();
    let mut observe = |seconds: f64| {
        (0..(seconds / frame_s(&config)) as u32).for_each(|_| winding.observe(0, &config));
        (degrees(&winding, &config), winding.share())
    };
    let (begins, share) = observe(0.1);
    // 85 K by 26 of 46 K/W.
    assert!((begins - 88.0).abs() < 0.1 && share == 256, "{begins}");
    let (later, _) = observe(400.0);
    // A fall is a quarter slower.
    assert!((later - 40.0 - 48.04 * (-0.8_f64).exp()).abs() < 0.1, "{later}");
}

/// The current that the controller allows heats the motor model: full load until the temperature has settled.
#[test]
fn it_never_passes_its_largest_temperature() {
    for params in [images::CONFIRMED, QUICK, Params { current_max_ma: 20_000, winding_max_c: 85, ..images::CONFIRMED }]
    {
        let config = allowed(params);
        let mut motion = SpeedLoop::new();
        let mut truth = Truth::of(&params);
        // The housing temperature after hours at the limit.
        let room_k = f64::from(params.winding_max_c - params.ambient_c);
        truth.above_k[1] = (room_k * truth.k_per_w[1] / (truth.k_per_w[0] + truth.k_per_w[1])).min(room_k - 24.0);
        let (mut warmest, mut truly, mut held) = (0.0_f64, 0.0_f64, 0);
        for _ in 0..(60.0 / frame_s(&config)) as u32 {
            motion.winding.observe(motion.drive.acceleration(), &config);
            let mut limits = Limits::default();
            motion.apply_voltage(config.voltage_max_q8_mm_per_s2, 8_000, &config, &mut limits);
            held += u32::from(limits.has(Limits::WINDING));
            let amperes = f64::from(motion.drive.acceleration()) / f64::from(config.current_max_q8_mm_per_s2)
                * f64::from(params.current_max_ma)
                * 1e-3;
            truth.pass(amperes * truth.ohm, frame_s(&config));
            warmest = warmest.max(degrees(&motion.winding, &config));
            truly = truly.max(truth.degrees());
        }
        let told = format!("{warmest:.1} C at most, truly {truly:.1}, held back in {held} frames");
        let most = f64::from(params.winding_max_c);
        assert!(warmest <= most && truly < warmest && held > 10_000 && truly > 0.6 * most, "{told}");
    }
}

proptest! {
    #![proptest_config(seeded(64, 5))]

    /// Motors as they come, under any pattern of voltage.
    #[test]
    fn it_is_never_lower_than_the_truth_of_an_ordinary_build(
        ohm in 0.93..1.1, k_per_w in 0.8..1.15, tau in 0.85..1.2, colder in 0.0..5.0, housed: bool,
        pattern in proptest::collection::vec((0.0..1.0, 0.02..4.0), 3..12),
    ) {
        // A warm housing hides errors of the winding model; a motor without a housing model hides none.
        let params = if housed { images::CONFIRMED } else { QUICK };
        let config = allowed(params);
        let mut truth = Truth::of(&params);
        truth.ohm *= ohm;
        truth.k_per_w = truth.k_per_w.map(|value| value * k_per_w);
        truth.tau_s = truth.tau_s.map(|value| value * tau);
        truth.ambient_c -= colder;
        let mut winding = Winding::new();
        let step_s = 256.0 * frame_s(&config);
        for (share, seconds) in pattern {
            let volts = 6.0 * share;
            for _ in 0..(seconds / step_s) as u32 + 1 {
                (0..256).for_each(|_| winding.observe(driven(&config, volts / 3.53), &config));
                truth.pass(volts, step_s);
                let estimate = degrees(&winding, &config);
                prop_assert!(estimate >= truth.degrees(), "{estimate} for {}", truth.degrees());
            }
        }
    }

    #[test]
    fn it_is_bounded_and_monotone(
        values in proptest::array::uniform9(0.0..=1.0),
        currents in proptest::collection::vec((any::<i32>(), 0..1 << 20, 1_u32..2_000), 1..20),
    ) {
        let names = [
            "winding_max_c", "winding_k_per_w", "winding_time_ms", "housing_k_per_w", "housing_time_ms", "ambient_c",
            "current_max_ma", "resistance_mohm", "torque_constant_unm_per_a",
        ];
        let mut params = images::CONFIRMED.to_array();
        for (name, value) in names.into_iter().zip(values) {
            let place = Params::RANGES.iter().position(|(known, ..)| *known == name).unwrap();
            let (_, _, min, max) = Params::RANGES[place];
            params[place] = min + (f64::from(max - min) * f64::powi(value, 3)) as i32;
        }
        let params = Params::from_array(&params);
        let config = allowed(params);
        let (mut less, mut more) = (Winding::new(), Winding::new());
        for (net, beside, frames) in currents {
            for _ in 0..frames {
                less.observe(net, &config);
                more.observe(if net < 0 { net.saturating_sub(beside) } else { net.saturating_add(beside) }, &config);
            }
            let [low, high] = [&less, &more].map(|winding| degrees(winding, &config));
            prop_assert!(low >= f64::from(params.ambient_c) && high <= 8_192.0 + 61.0);
            prop_assert!(low <= high + 1e-3, "{low} {high}");
            prop_assert!((0..=256).contains(&less.share()) && more.share() <= less.share() + 1);
        }
    }
}

/// A limited current brakes the tip less, so the tip must also be driven less. Without that the force overshot to 5.2 N
/// for a goal of 3 N, and the contact was lost after a step to a lower goal.
#[test]
fn a_motor_that_may_hardly_be_driven_presses_no_harder_and_lets_go_no_farther() {
    let hot = Params { winding_max_c: 85, ambient_c: 60, winding_time_ms: 2_000, ..images::CONFIRMED };
    for (k_per_w, goals_n) in [([500, 500], [3.0, 0.3]), ([200, 0], [6.0, 1.0]), ([200, 0], [6.0, 0.2])] {
        let [winding_k_per_w, housing_k_per_w] = k_per_w;
        let mut board = Bench::of(&Setup::default(), &allowed(Params { winding_k_per_w, housing_k_per_w, ..hot }));
        board.tare();
        let [mut held_back, mut peak_n, mut least_n] = [0.0_f64, 0.0, f64::MAX];
        let [first_n, then_n] = goals_n;
        for goal_n in goals_n {
            board.command().goal = newtons((goal_n * 1e3) as i32);
            for _ in 0..60_000 {
                held_back += f64::from(u8::from(board.step().limits.has(Limits::WINDING)));
                let force_n = board.truth().force_n;
                peak_n = peak_n.max(force_n);
                least_n = if goal_n == then_n { least_n.min(force_n) } else { least_n };
            }
        }
        let (mode, ends_n) = (board.status().mode, board.truth().force_n);
        assert!(held_back > 100.0 && mode == Mode::Force, "{goals_n:?}: {held_back} frames, {mode:?}");
        assert!((0.3 * first_n..1.03 * first_n).contains(&peak_n), "{goals_n:?}: up to {peak_n} N");
        assert!(least_n > 0.97 * then_n && (ends_n / then_n - 1.0).abs() < 0.02, "{goals_n:?}: {least_n}, {ends_n} N");
    }
}

fn celsius(degrees: i32) -> Option<Celsius> {
    Some(Celsius::from_bits(degrees << 16))
}

/// Steps with the microcontroller at a temperature. Returns the last status.
fn run(board: &mut Bench, frames: u32, degrees: i32) -> Status {
    (0..frames).map(|_| board.step_with(|record| record.sense.chip = celsius(degrees))).last().unwrap()
}

/// A finger that was tared at 45 C and holds a goal at a temperature, and its last frame without torque.
fn held(config: &Config, goal_mn: i32, degrees: i32) -> (Bench, Frame, Status) {
    let mut board = Bench::of(&Setup::default(), config);
    board.command().tare_request = 1;
    run(&mut board, TARE_FRAMES + 2, 45);
    let quiet = *board.frame();
    (board.command().torque, board.command().goal) = (true, newtons(goal_mn));
    let status = run(&mut board, 30_000, degrees);
    assert_eq!(status.mode, Mode::Force);
    (board, quiet, status)
}

/// Contact lost for a frame, after the array has cooled since its tare: the baseline has learnt almost nothing.
#[test]
fn a_frame_without_contact_does_not_forget_the_drift() {
    let (mut board, quiet, held) = held(&allowed(Params { array_zero_pa_per_k: 10, ..images::CONFIRMED }), 1_000, 25);
    let lost = |record: &mut Record| (record.sense.chip, record.frame.codes) = (celsius(25), quiet.codes);
    let after = (0..40).map(|_| board.step_with(lost)).last().unwrap();
    assert_ne!(after.mode, Mode::Force);
    let [before, after]: [f64; 2] = [held, after].map(|status| status.drift.0.to_num());
    assert!((before + 0.045).abs() < 6e-3 && (after - before).abs() < 0.02 * 0.045, "{before} {after}");
}

/// Bits of a force: those of a finger, or any.
fn any_force() -> impl Strategy<Value = i32> {
    prop_oneof![0..10 << 16, any::<i32>()]
}

proptest! {
    #![proptest_config(seeded(256, 7))]

    /// A force F reads F (1 + a (T - T_gain)) + b A (T - T_zero), with T filtered over 1024 readings, and T_zero moved by
    /// the share of the baseline that is learnt. Nothing before the first reading since the correction is on; half of
    /// the force at most, by the gain and in all.
    #[test]
    fn the_drift_is_the_documented_one(
        parts in proptest::collection::vec((
            prop_oneof![Just(None), (-64 << 16..192 << 16).prop_map(Some), any::<i32>().prop_map(Some)],
            1_u32..3_000, prop::sample::select(vec![0, 655, 1 << 15, 1 << 16]), prop::bool::weighted(0.9),
        ), 1..12),
        held in any_force(), array_gain_ppm_per_k in -10_000..=10_000, array_gain_at_c in -40..=125,
        array_zero_pa_per_k in -1_000..=1_000, pitch_um in 500..=4_000,
    ) {
        let base = Params { pitch_um, array_gain_at_c, ..images::CONFIRMED };
        let on = allowed(Params { array_gain_ppm_per_k, array_zero_pa_per_k, ..base });
        let off = allowed(base);
        let [gain_per_k, newtons_per_k] =
            [1e-6 * f64::from(array_gain_ppm_per_k), f64::from(array_zero_pa_per_k) * 100.0 * (1e-6 * f64::from(pitch_um)).powi(2)];
        let held_n = f64::from(held.max(0)) / 65_536.0;
        let (mut drift, mut exact) = (TemperatureDrift::default(), None);
        for (chip, frames, share, is_on) in parts {
            let config = if is_on { &on } else { &off };
            for _ in 0..frames {
                drift.observe(chip.map(Celsius::from_bits), config);
                let read = chip.map(|bits| (f64::from(bits) / 65_536.0).clamp(-64.0, 192.0));
                exact = match (exact, read) {
                    _ if !is_on => None,
                    (Some((chip, zero)), Some(read)) => Some((chip + (read - chip) / 1_024.0, zero)),
                    (None, Some(read)) => Some((read, read)),
                    (known, None) => known,
                };
            }
            drift.zero(share);
            exact = exact.map(|(chip, zero)| (chip, zero + (chip - zero) * f64::from(share) / 65_536.0));
            let found = drift.force(Newtons::from_bits(held), config);
            prop_assert!(i64::from(found.to_bits()).abs() <= i64::from(held.max(0)) / 2);
            let expected = exact.map_or(0.0, |(chip, zero)| {
                held_n * (gain_per_k * (chip - f64::from(array_gain_at_c))).clamp(-0.5, 0.5) + newtons_per_k * (chip - zero)
            });
            let (found, expected) = (found.0.to_num::<f64>(), expected.clamp(-held_n / 2.0, held_n / 2.0));
            prop_assert!((found - expected).abs() < 1e-3 + 1e-6 * held_n, "{found} N, {expected} N expected");
        }
    }
}

/// Temperature that is reported after the given number of frames with repeating codes.
fn told(factory: Factory, codes: &[(u16, u16)], frames: u32) -> (u16, Option<f64>) {
    let mut chip = Chip::new(factory);
    for (_, (reference, sensor)) in (0..frames).zip(codes.iter().cycle()) {
        chip.observe(Some([*reference, *sensor]));
    }
    (chip.analogue_mv(), chip.temperature().map(|chip| chip.0.to_num()))
}

proptest! {
    #[test]
    fn any_codes_are_believed_within_bounds_or_not_at_all(
        reference in any::<u16>(),
        sensor in any::<[u16; 2]>(),
        near in any::<bool>(),
        codes in proptest::collection::vec(any::<(u16, u16)>(), 1..20),
        frames in 0..1_000_u32,
    ) {
        // Hardly any drawn codes could be a factory's, so half of the cases are drawn near real ones.
        let sensible = Factory { reference: 1_300 + reference % 400, sensor: [900 + sensor[0] % 100, 1_150 + sensor[1] % 200] };
        let (mv, chip) = told(if near { sensible } else { Factory { reference, sensor } }, &codes, frames);
        prop_assert!(mv == 0 || (1_600..=4_000).contains(&mv));
        prop_assert!(chip.is_none_or(|chip| (-60.0..=160.0).contains(&chip)));
        prop_assert!(mv != 0 || chip.is_none());
        prop_assert!(frames >= FRAMES || (mv, chip) == (0, None));
    }

    #[test]
    fn a_sound_board_tells_its_temperature_and_supply(
        chip_c in -40.0..125.0_f64,
        supply_v in 1.8..3.6_f64,
        (reference_v, sensor_v, volts_per_k) in (1.18..1.24_f64, 0.70..0.82_f64, 0.0022..0.0028_f64),
        noise in proptest::collection::vec((-1.5..1.5_f64, -1.5..1.5_f64), 64),
    ) {
        let volts = |chip_c: f64| sensor_v + volts_per_k * (chip_c - 25.0);
        let code = |volts: f64, supply_v: f64| (volts / supply_v * 4096.0) as u16;
        let factory = Factory { reference: code(reference_v, 3.3), sensor: [30.0, 110.0].map(|chip_c| code(volts(chip_c), 3.3)) };
        let noisy = |volts: f64, noise: f64| (volts / supply_v * 4096.0 + noise) as u16;
        let codes: Vec<_> = noise.iter().map(|(a, b)| (noisy(reference_v, *a), noisy(volts(chip_c), *b))).collect();
        let (mv, found) = told(factory, &codes, FRAMES);
        let found = found.expect("it is sound");
        // The mean noise of 64 draws, the factory's truncated codes (a code is 0.4 K), and that of the ratio.
        prop_assert!((found - chip_c).abs() < 1.5, "{found} C of {chip_c} C");
        prop_assert!((f64::from(mv) - 1e3 * supply_v).abs() < 6.0, "{mv} mV of {supply_v} V");
    }
}

// Compensation of the creep of a held force: result, bounds, and parts that must not depend on it.

fn creeping(creep_permille: i32, creep_time_ms: i32) -> Config {
    allowed(Params { creep_permille, creep_time_ms, ..images::CONFIRMED })
}

proptest! {
    #![proptest_config(seeded(256, 3))]

    /// A part c of a held reading S creeps: c' = (k (S - c) - c) / tau. Nothing where nothing is held.
    #[test]
    fn the_creep_is_the_documented_one(
        parts in proptest::collection::vec((prop::bool::weighted(0.8), any_force(), 1_u32..10_000), 1..12),
        permille in prop_oneof![1 => Just(0), 9 => 0..=300], time_ms in prop_oneof![50..=1_000, 50..=600_000],
    ) {
        let config = creeping(permille, time_ms);
        let (rate, tau_s) = (f64::from(permille) / 1e3, f64::from(time_ms) / 1e3);
        let (mut creep, mut exact_n, mut most_n) = (Creep::default(), 0.0, 0.0_f64);
        for (held, force, frames) in parts {
            let target_n = f64::from(force.max(0)) / 65_536.0 * rate / (1.0 + rate);
            most_n = most_n.max(target_n);
            for _ in 0..frames {
                creep.observe(held, Newtons::from_bits(force), &config);
                exact_n += (target_n - exact_n) * (1.0 + rate) * frame_s(&config) / tau_s;
                exact_n = if held { exact_n } else { 0.0 };
                let found_n: f64 = creep.force().0.to_num();
                prop_assert!((0.0..=most_n + 1e-4).contains(&found_n), "{found_n} N of at most {most_n} N");
                prop_assert!((found_n - exact_n).abs() <= 2e-3 * most_n + 1e-4, "{found_n} N, {exact_n} N expected");
            }
            prop_assert!(held || creep == Creep::default());
        }
    }
}

/// A board that holds so much for a time, s; its true force and status.
fn hold(config: &Config, goal_mn: i32, seconds: f64) -> (f64, Bench) {
    let mut board = Bench::of(&Setup::default(), config);
    board.tare();
    board.hold(goal_mn, seconds - board.time_s());
    (board.truth().force_n, board)
}

#[test]
fn it_never_leads_beyond_the_largest_force() {
    let params = Params { creep_permille: 300, creep_time_ms: 50, force_max_mn: 3_000, ..images::CONFIRMED };
    let (force, board) = hold(&allowed(params), 3_000, 3.0);
    assert!((2.98..3.02).contains(&force), "{force}");
    assert_eq!(board.status().fault, None);
}

#[test]
fn over_force_is_judged_by_the_reading() {
    // 2.6 N are read; 2 N are taken for true.
    let params = Params { force_max_mn: 2_650, force_fault_mn: 2_700, ..creeping(300, 50).params };
    let (_, mut board) = hold(&allowed(params), 2_000, 4.0);
    assert_eq!(board.status().fault, None);
    let travel = board.truth().travel_mm;
    board.place(travel + 0.2);
    board.frames(50);
    assert_eq!(board.status().fault, Some(Fault::OverForce));
}
