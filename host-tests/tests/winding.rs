//! The winding's temperature in the controller: bounded, never lower than the true one, and its effect on the current.

use crate::common::*;
use fingertip::control::Winding;

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

#[test]
fn without_resistances_it_is_as_warm_as_its_surroundings_and_takes_nothing_away() {
    let config = allowed(Params { winding_k_per_w: 0, housing_k_per_w: 0, ..images::CONFIRMED });
    let mut winding = Winding::new();
    for _ in 0..100_000 {
        winding.observe(i32::MAX, &config);
    }
    assert_eq!(winding.share(), 256);
    assert!((degrees(&winding, &config) - 40.0).abs() < 1e-3);
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
        println!("{warmest:.1} C at most, truly {truly:.1}, held back in {held} frames");
        assert!(warmest <= f64::from(params.winding_max_c) && truly < warmest && held > 10_000);
        assert!(truly > 0.6 * f64::from(params.winding_max_c), "it is used");
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
                let net = driven(&config, volts / 3.53);
                (0..256).for_each(|_| winding.observe(net, &config));
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
