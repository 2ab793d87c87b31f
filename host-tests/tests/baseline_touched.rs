//! The baseline must not learn the force of an object that touches a released tip: the next press would be too hard.

use crate::common::*;

fn bench(params: &Params) -> Bench {
    let mut board = Bench::of(&Setup::default(), &allowed(*params));
    board.tare();
    board
}

/// Torque off while the tip touches, a linear characteristic again, the object gone for the given time, then a press.
fn after_a_curve(off_s: f64, goal_mn: i32) -> f64 {
    let mut board = bench(&Params { curve_permille: 500, ..Params::DEFAULT });
    board.hold(1_000, 0.5);
    board.command().torque = false;
    board.hold(0, 0.01);
    board.pipeline().configure(&config());
    board.place_object(50.0);
    board.place(0.0);
    board.run(off_s);
    board.place_object(5.0);
    board.command().torque = true;
    board.hold(goal_mn, 2.0)
}

/// `curve_permille` to 0 while the tip touches: the baseline learns the last bent frame's row for ever.
#[test]
fn a_characteristic_that_is_none_any_more_leaves_nothing() {
    for (off_s, goal_mn) in [(0.1, 1_000), (0.3, 1_000), (0.5, 1_000), (0.6, 7_000), (2.0, 1_000)] {
        let largest = after_a_curve(off_s, goal_mn);
        assert!(largest <= 1.02e-3 * f64::from(goal_mn), "off for {off_s} s, goal {goal_mn} mN: {largest:.3} N");
    }
    // No contact, only noise of +-3 codes, which is added up frame by frame.
    let mut rng = fastrand::Rng::with_seed(0);
    let mut board = bench(&Params { curve_permille: 500, ..Params::DEFAULT });
    board.command().torque = false;
    let mut noisy = |board: &mut Bench, frames: u32| {
        for _ in 0..frames {
            let mut noisy = |_, _, code| (i32::from(code) + rng.i32(-3..=3)) as u16;
            board.step_with(|record| recode(&mut record.frame, &mut noisy));
        }
    };
    noisy(&mut board, 200);
    board.pipeline().configure(&config());
    noisy(&mut board, 200_000);
    let picture = *board.pipeline().array().picture();
    // 5.86 uN a sixteenth of a code.
    let off_n = f64::from(picture.sum) * 5.86e-6;
    assert!(off_n.abs() <= 0.015, "noise: {off_n:.3} N after 20 s, peak {}", picture.peak);
}

/// The object is put against the released tip as soon as that is clear of it, and follows.
fn clear(board: &mut Bench, clear_mm: f64) {
    while board.truth().travel_mm > clear_mm {
        board.step();
    }
}

/// `docs/safety.md`, Releasing: a reading that rises above the minimum since the release is a new touch. Here an
/// object presses a released tip for 5 s with more than a quarter of the force held before; then with less.
#[test]
fn what_presses_for_seconds_is_not_left_of_what_was_held() {
    for (goal_mn, first_mm, then_mm) in [(2_000, 0.95, 0.75), (6_000, 1.6, 1.3)] {
        let mut board = bench(&Params::DEFAULT);
        board.hold(goal_mn, 1.0);
        board.command().goal = newtons(0);
        clear(&mut board, 4.1);
        let travel = board.truth().travel_mm;
        board.place_object(travel - first_mm);
        board.run(5.0);
        board.place_object(4.0 - then_mm);
        board.run(3.0);
        let (held, read) = (board.truth().force_n, board.status().contact.force.0.to_num::<f64>());
        board.place_object(5.0);
        board.run(0.05);
        let largest = board.hold(1_000, 1.0);
        let name = format!("after {goal_mn} mN: {held:.3} N read {read:.3} N; goal 1 N then has {largest:.3} N");
        assert!((held - read).abs() <= 0.02 && largest <= 1.02, "{name}");
    }
}

/// Holds 6 N, switches torque off, takes the object away, and puts it back; each after a time, s.
fn lose(board: &mut Bench, [held_s, off_s, gone_s]: [f64; 3]) {
    board.hold(6_000, held_s);
    board.command().torque = false;
    board.hold(0, off_s);
    board.place_object(50.0);
    board.place(0.0);
    board.run(gone_s);
    board.place_object(5.0);
}

#[test]
fn a_tare_forgets_what_was_held() {
    let mut largest = [0.0; 2];
    for (history, largest) in [false, true].into_iter().zip(&mut largest) {
        let mut board = bench(&Params::DEFAULT);
        if history {
            lose(&mut board, [1.0, 0.2, 5.0]);
            board.tare();
        }
        board.hold(200, 1.0);
        board.command().goal = newtons(0);
        clear(&mut board, 4.2);
        board.place_object(3.0);
        board.run(3.0);
        board.place_object(5.0);
        board.run(0.05);
        *largest = board.hold(1_000, 1.0);
    }
    assert!(largest[1] < largest[0] + 0.02, "goal 1 N has {largest:?} N without and with a history");
}

/// A contact at the edge was fitted before a press: its ratio must not be in the force at the end of the press.
#[test]
fn a_press_that_measures_loses_the_fit() {
    let mut board: Bench = Bench::new(&scene(1, 6.8, "")).unwrap();
    board.tare();
    board.hold(2_000, 1.0);
    board.request(Task::Press);
    board.step();
    while board.step().contact.force >= newtons(15) {}
    let travel_mm = board.truth().travel_mm;
    board.exchange(&scene(1, 0.0, "")).unwrap();
    board.place(travel_mm);
    for _ in 0..20_000 {
        let status = board.step();
        let (read, held) = (status.contact.force.0.to_num::<f64>(), board.truth().force_n);
        assert!(status.fault.is_none() && read < 1.1 * held + 0.1, "{}", told(&mut board));
    }
}

/// The object is taken away with torque off; torque is on before another object. What hysteresis and creep left of the
/// first one reads as a contact in the air, which must not be taken for a surface.
#[test]
fn what_is_left_of_a_contact_in_the_air_is_no_surface() {
    for seed in 0..4 {
        let mut swings = [0.0; 2];
        for (history, swing) in [false, true].into_iter().zip(&mut swings) {
            let mut board = ordinary(seed, 6.5, 6, 3);
            if history {
                lose(&mut board, [3.0, 0.3, 0.01]);
                board.command().torque = true;
            }
            board.hold(1_000, 2.0);
            let (mut least, mut most) = (f64::MAX, 0.0_f64);
            for _ in 0..10_000 {
                board.step();
                let force_n = board.truth().force_n;
                (least, most) = (least.min(force_n), most.max(force_n));
            }
            *swing = most - least;
        }
        // From 2 to 3 s after the goal of 1 N.
        assert!(swings[1] <= swings[0] + 0.05, "finger {seed}: {swings:.3?} N without and with a history");
    }
}

/// Six dead taxels are more than allowed; a mask leaves them out. It is given while frames already show them.
#[test]
fn taxels_that_are_masked_are_no_fault_any_more() {
    let mut mask = [0; 10];
    mask[4] = 0b00_1111_1100;
    let calibration = Calibration::new(&[[GAIN_ONE; 10]; 10], &mask).unwrap();
    for frames_before in [0, 5] {
        let mut board = Bench::default();
        board.harm(|faults| (2..8).for_each(|column| faults.array.taxels[4][column] = Taxel::Dead));
        board.frames(frames_before);
        board.pipeline().calibrate(&calibration);
        board.tare();
        board.step();
        let status = board.step();
        let again = board.pipeline().array().picture().bad_again;
        assert_eq!((status.fault, again), (None, 0), "{frames_before} frames before");
    }
}

// A tare on a free tip and one while something touches are told apart, over drawn arrays; torque is refused after it.

struct Finger {
    rng: Rng,
    pipeline: Pipeline,
    command: Command,
    frame: Frame,
    setup: Setup,
    undriven: [f64; COLUMNS],
    preload: [[f64; COLUMNS]; ROWS],
    gain: [[f64; COLUMNS]; ROWS],
    noise_codes: f64,
}

/// About normal, within 3 deviations.
fn normal(rng: &mut Rng) -> f64 {
    crate::common::normal(rng).clamp(-3.0, 3.0)
}

impl Finger {
    /// Gains spread by 10 %, preload by 20 % and uneven by 30 % from side to side, amplifiers by 10 codes, noise of 3
    /// codes; up to five taxels dead, up to three masked.
    fn new(seed: u64, modulus_kpa: f64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let mut setup = Setup::default();
        setup.tip.modulus_kpa = modulus_kpa;
        // Frames have no sag of the row; a few taxels here have less preload than `bad_taxels_max` may lack.
        let modulus_pa = (modulus_kpa * 1e3) as i32;
        let params = Params { modulus_pa, row_sag_ppb_per_code: 0, bad_taxels_max: 20, ..images::CONFIRMED };
        let mut pipeline = Pipeline::new(&allowed(params));
        let mut mask = [0u32; ROWS];
        for _ in 0..rng.usize(..4) {
            mask[rng.usize(..ROWS)] |= 1 << rng.usize(..COLUMNS);
        }
        pipeline.calibrate(&Calibration::new(&[[GAIN_ONE; COLUMNS]; ROWS], &mask).unwrap());
        let (slope_x, slope_y) = (rng.f64() * 0.6 - 0.3, rng.f64() * 0.6 - 0.3);
        let mut preload = [[0.0; COLUMNS]; ROWS];
        let mut gain = preload;
        for (row, column) in places() {
            let uneven = 1.0 + slope_x * (column as f64 / 4.5 - 1.0) / 2.0 + slope_y * (row as f64 / 4.5 - 1.0) / 2.0;
            preload[row][column] = 40.0 * uneven * (1.0 + 0.2 * normal(&mut rng));
            gain[row][column] = 1.0 + 0.1 * normal(&mut rng);
        }
        for _ in 0..rng.usize(..6) {
            let (row, column) = (rng.usize(..ROWS), rng.usize(..COLUMNS));
            (preload[row][column], gain[row][column]) = (0.0, 0.0);
        }
        let undriven = [(); COLUMNS].map(|()| 372.0 + 10.0 * normal(&mut rng));
        let (command, frame) = (Command::default(), Frame::EMPTY);
        Self { rng, pipeline, command, frame, setup, undriven, preload, gain, noise_codes: 3.0 }
    }

    /// Tares under a force; whether it was flagged.
    fn tare(&mut self, force_n: f64, [x_mm, y_mm]: [f64; 2]) -> bool {
        (self.setup.wall.centre_x_mm, self.setup.wall.centre_y_mm) = (x_mm, y_mm);
        let tip = self.setup.tip.flattened(self.setup.tip.indentation_mm(force_n));
        let mut kpa = [[0.0; COLUMNS]; ROWS];
        for (row, column) in places() {
            kpa[row][column] = Cell::of(&self.setup, row, column).mean_kpa(&tip);
        }
        self.command.tare_request += 1;
        let mut limits = Limits::default();
        for _ in 0..TARE_FRAMES + 2 {
            for (slot, column) in (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
                let pressed = kpa
                    .get(slot)
                    .map_or(0.0, |row| self.gain[slot][column] * 24.0 * row[column] + self.preload[slot][column]);
                let code = self.undriven[column] + pressed + self.noise_codes * normal(&mut self.rng);
                self.frame.set_code(slot, column, code.clamp(0.0, 4_095.0) as u16);
            }
            self.frame.sequence += 1;
            let sense = Sense { supply_mv: 6_000, ..Sense::default() };
            let (_, status) = self.pipeline.step(&self.frame, &sense, &self.command);
            limits = status.limits;
        }
        let refused = limits.has(Limits::NOT_TARED);
        assert_eq!((self.pipeline.status().tare, refused), (Taring::Done, false));
        limits.has(Limits::TARED_TOUCHING)
    }

    /// A warmer array: all taxels by 10 %, and each by 3 % of its own.
    fn warm(&mut self) {
        for (row, column) in places() {
            self.preload[row][column] *= 1.1 + 0.03 * normal(&mut self.rng);
        }
    }

    fn anywhere(&mut self) -> [f64; 2] {
        let (angle, distance_mm) = (self.rng.f64() * std::f64::consts::TAU, self.rng.f64() * 5.0);
        [distance_mm * angle.cos(), distance_mm * angle.sin()]
    }
}

#[test]
fn a_tare_under_two_tenths_of_a_newton_and_more_is_flagged_and_a_clean_one_clears_it() {
    for (seed, modulus_kpa) in (0..60).zip([100.0, 250.0, 700.0].into_iter().cycle()) {
        let mut later = Finger::new(seed, modulus_kpa);
        assert!(!later.tare(0.0, [0.0; 2]));
        for force_n in [0.2, 0.3, 0.5, 1.0, 2.0, 4.0, 7.0] {
            let mut first = Finger::new(seed, modulus_kpa);
            let at = first.anywhere();
            assert!(first.tare(force_n, at), "array {seed}, first tare: {force_n} N at {at:?} mm, {modulus_kpa} kPa");
            later.warm();
            let at = later.anywhere();
            assert!(later.tare(force_n, at), "array {seed}, later: {force_n} N at {at:?} mm, {modulus_kpa} kPa");
            assert!(later.tare(force_n, at), "it still touches");
            assert!(!later.tare(0.0, at), "array {seed}: clean again after {force_n} N at {at:?} mm");
        }
    }
}

/// A patch of high readings without a touch is flagged at the tare: torque is refused until the host forces it.
#[test]
fn torque_after_a_flagged_tare_is_refused_unless_it_was_forced() {
    let mut finger = Finger::new(1, 250.0);
    for row in 4..7 {
        for column in 4..7 {
            finger.preload[row][column] = 140.0;
        }
    }
    assert!(finger.tare(0.0, [0.0; 2]));
    finger.command.torque = true;
    let sense = Sense { supply_mv: 6_000, ..Sense::default() };
    for (forced, mode) in [(false, Mode::Off), (false, Mode::Off), (true, Mode::Release), (true, Mode::Release)] {
        finger.command.tare_forced = forced;
        finger.frame.sequence += 1;
        let status = finger.pipeline.step(&finger.frame, &sense, &finger.command).1;
        assert!(status.fault.is_none() && status.limits.has(Limits::TARED_TOUCHING));
        assert_eq!(status.mode, mode);
    }
}
