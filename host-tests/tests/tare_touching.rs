//! A tare while something touches is told from one on a free tip, over arrays as they come. The tare is never
//! refused; torque after it is.

use fastrand::Rng;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Taring;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{COLUMNS, Calibration, Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};
use fingertip::state::{Limits, Mode};
use sim::mechanics::cells::Cell;
use sim::setup::Setup;

/// Arrays of each test.
const ARRAYS: u64 = 120;

/// An array as it comes, and a finger with it.
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
    (0..12).map(|_| rng.f64()).sum::<f64>().clamp(3.0, 9.0) - 6.0
}

impl Finger {
    /// Gains spread by 10 %, preload by 20 % and uneven by 30 % from side to side, amplifiers by 10 codes, noise of 3
    /// codes; up to five taxels dead, up to three masked.
    fn new(seed: u64, modulus_kpa: f64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let mut setup = Setup::default();
        setup.tip.modulus_kpa = modulus_kpa;
        // The frames are made without the row's sag; what little preload a few taxels have here is more than few may
        // lack.
        let params = Params {
            modulus_pa: (modulus_kpa * 1e3) as i32,
            row_sag_ppb_per_code: 0,
            bad_taxels_max: 20,
            ..images::CONFIRMED
        };
        let mut pipeline = Pipeline::new(&Config::shipped(&params).unwrap());
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
        assert_eq!(
            (self.pipeline.status().tare, limits.has(Limits::NOT_TARED)),
            (Taring::Done, false),
            "never refused"
        );
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

fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)))
}

const MODULI_KPA: [f64; 3] = [100.0, 250.0, 700.0];
const FORCES_N: [f64; 7] = [0.2, 0.3, 0.5, 1.0, 2.0, 4.0, 7.0];

#[test]
fn a_tare_on_a_free_tip_is_never_flagged() {
    for seed in 0..ARRAYS {
        let mut finger = Finger::new(seed, 250.0);
        assert!(!finger.tare(0.0, [0.0; 2]), "the first of array {seed}");
        for again in 1..4 {
            finger.warm();
            assert!(!finger.tare(0.0, [0.0; 2]), "number {again} after it, of array {seed}");
        }
    }
}

#[test]
fn a_first_tare_under_two_tenths_of_a_newton_and_more_is_flagged() {
    for seed in 0..ARRAYS {
        let modulus_kpa = MODULI_KPA[seed as usize % 3];
        for force_n in FORCES_N {
            let mut finger = Finger::new(seed, modulus_kpa);
            let at = finger.anywhere();
            assert!(finger.tare(force_n, at), "array {seed}: {force_n} N at {at:?} mm, {modulus_kpa} kPa");
        }
    }
}

#[test]
fn a_later_tare_under_two_tenths_of_a_newton_and_more_is_flagged_and_a_clean_one_clears_it() {
    for seed in 0..ARRAYS {
        let modulus_kpa = MODULI_KPA[seed as usize % 3];
        let mut finger = Finger::new(seed, modulus_kpa);
        assert!(!finger.tare(0.0, [0.0; 2]));
        for force_n in FORCES_N {
            finger.warm();
            let at = finger.anywhere();
            assert!(finger.tare(force_n, at), "array {seed}: {force_n} N at {at:?} mm, {modulus_kpa} kPa");
            assert!(finger.tare(force_n, at), "it still touches");
            assert!(!finger.tare(0.0, at), "array {seed}: clean again after {force_n} N at {at:?} mm");
        }
    }
}

/// An array that is uneven beyond what is usual, by a patch of its own: flagged, so torque is refused until the host
/// insists.
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

/// A tare that was taken with one calibration says nothing of the next.
#[test]
fn a_new_calibration_forgets_the_flag() {
    let mut finger = Finger::new(2, 250.0);
    assert!(finger.tare(1.0, [0.0; 2]));
    finger.pipeline.calibrate(&Calibration::NONE);
    assert!(!finger.tare(0.0, [0.0; 2]));
}
