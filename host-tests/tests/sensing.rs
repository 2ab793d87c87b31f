//! From codes to contact: the plant's electrical model against the readings of the core.

use crate::common::*;
use fingertip::touch::Touch;

struct Bench {
    world: Plant,
    array: Array,
    config: Config,
    frame: Frame,
}

impl Bench {
    fn new(setup: &Setup) -> Self {
        Self::with(setup, &Params::DEFAULT)
    }

    fn with(setup: &Setup, params: &Params) -> Self {
        let (mut world, config, mut frame) = (Plant::new(setup), allowed(*params), Frame::EMPTY);
        world.fill_frame(&mut frame);
        let array = tared(&Calibration::NONE, &frame, &config);
        Self { world, array, config, frame }
    }

    fn read(&mut self) -> Contact {
        self.world.fill_frame(&mut self.frame);
        from_sums(self.array.read(&self.frame, &self.config), &self.config)
    }

    fn press(&mut self, indentation_mm: f64) -> Contact {
        self.world.place(self.world.finger().setup.wall.distance_mm + indentation_mm);
        self.read()
    }
}

/// Weight with which the baseline learns a row while nothing touches.
fn drift_weight() -> u32 {
    Touch::default().learns(Newtons::ZERO, ROWS as u32, &allowed(Params::DEFAULT)).expect("it learns")
}

/// On a line, and by the curve of a saturating array.
#[test]
fn the_sum_of_the_taxels_is_the_force() {
    let line = (Bench::new(&Setup::default()), 0.002, 0.003, 0.005);
    for (mut bench, share, offset_n, depth_mm) in [line, (curved(GROWTH, 3_300), 0.003, 0.006, 0.02)] {
        for step in 2..=28 {
            let contact = bench.press(f64::from(step) * 0.1);
            let truth = bench.world.force_n();
            let sensed: f64 = contact.force.0.to_num();
            assert!((sensed - truth).abs() <= share * truth + offset_n, "{truth} N read as {sensed} N");
            let depth: f64 = contact.indentation.0.to_num();
            assert!((depth - bench.world.indentation_mm()).abs() < depth_mm, "{depth} mm");
        }
    }
}

#[test]
fn the_centre_follows_the_contact() {
    for (x, y) in [(0.0, 0.0), (1.0, -0.5), (-1.2, 0.9), (0.75, 0.75)] {
        let mut setup = Setup::default();
        setup.wall.centre_x_mm = x;
        setup.wall.centre_y_mm = y;
        let contact = Bench::new(&setup).press(1.5);
        let read = (contact.centre_x.0.to_num::<f64>(), contact.centre_y.0.to_num::<f64>());
        assert!((read.0 - x).abs() < 0.02 && (read.1 - y).abs() < 0.02, "({x}, {y}) read as {read:?}");
    }
}

#[test]
fn the_baseline_follows_drift_only_when_told() {
    let mut bench = Bench::new(&Setup::default());
    bench.read();
    recode(&mut bench.frame, |_, _, code| code + 2);
    let drifted = bench.array.read(&bench.frame, &bench.config).sum;
    assert!((3_100..3_300).contains(&drifted), "100 taxels, 2 codes, 16ths: {drifted}");
    // One time constant of the baseline, 1024 visits to each row.
    for _ in 0..10_240 {
        bench.array.read(&bench.frame, &bench.config);
        bench.array.follow_drift(drift_weight());
    }
    let left = f64::from(bench.array.read(&bench.frame, &bench.config).sum) / f64::from(drifted);
    assert!((0.33..0.42).contains(&left), "1/e is left, not {left}");
}

/// The highest code of a centred contact, as the plant's electrical model has it, stays where it is said to.
#[test]
fn the_force_that_is_seen_whole_leaves_the_converter_room() {
    for (radius_mm, modulus_kpa) in [(10.0, 250.0), (4.0, 250.0), (10.0, 2_000.0), (16.0, 700.0), (4.0, 2_000.0)] {
        let mut setup = Setup::default();
        (setup.tip.radius_mm, setup.tip.modulus_kpa) = (radius_mm, modulus_kpa);
        // The middle of a taxel.
        (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (0.75, 0.75);
        // Without the sag, which lets the converter see more.
        setup.array.row_ohm = 0.0;
        let [tip_radius_um, modulus_pa] = [radius_mm, modulus_kpa].map(|value| (value * 1e3) as i32);
        let config = allowed(Params { tip_radius_um, modulus_pa, ..Params::DEFAULT });
        let seen_n: f64 = config.force_seen.0.to_num();
        let mut world = Plant::new(&setup);
        world.place(setup.wall.distance_mm + setup.tip.indentation_mm(seen_n));
        let mut frame = Frame::EMPTY;
        world.fill_frame(&mut frame);
        let highest = places().map(|(row, column)| frame.code(row, column)).max().unwrap();
        let share = f64::from(highest) / f64::from(config.saturated_codes);
        // A taxel averages over a peak that may be small, so that not all is seen.
        assert!((0.733..=0.951).contains(&share), "{radius_mm} mm, {modulus_kpa} kPa: {seen_n} N, code {highest}");
    }
}

// An array with a nonlinear characteristic: codes to force, drift and bad taxels.

/// Ratio of the pressure per code at full range to that at zero.
const GROWTH: f64 = 3.3;

/// An array of this growth, and a configuration of this one.
fn curved(growth: f64, curve_permille: i32) -> Bench {
    let mut setup = Setup::default();
    setup.array.growth = growth;
    // Such an array is steeper at small pressures.
    setup.array.siemens_per_kpa *= 3.0;
    Bench::with(&setup, &Params { curve_permille, codes_per_kpa_milli: 72_000, ..Params::DEFAULT })
}

#[test]
fn the_baseline_follows_drift_as_by_a_line() {
    let (mut curve, mut line) = (curved(GROWTH, 3_300), curved(GROWTH, 0));
    for bench in [&mut curve, &mut line] {
        recode(&mut bench.frame, |_, _, code| code + 10);
        for _ in 0..30_000 {
            bench.array.read(&bench.frame, &bench.config);
            bench.array.follow_drift(drift_weight());
        }
    }
    let tares = |bench: &Bench| -> Vec<i32> { bench.array.tare().flatten().copied().collect() };
    assert_eq!(tares(&curve), tares(&line));
    let moved = tares(&curve)[0] >> TARE_BITS;
    assert!((45..=60).contains(&moved), "{moved}");
}

#[test]
fn a_dead_taxel_moves_no_baseline() {
    let mut bench = curved(GROWTH, 3_300);
    bench.press(2.0);
    bench.frame.set_code(4, 4, 0);
    let tares = |array: &Array| array.tare().map(|row| row[4]).collect::<Vec<i32>>();
    let before = tares(&bench.array);
    for _ in 0..ROWS {
        bench.array.read(&bench.frame, &bench.config);
        bench.array.follow_drift(1 << 14);
    }
    let after = tares(&bench.array);
    assert_eq!(before[4], after[4]);
    assert_ne!(before[5], after[5]);
}

#[test]
fn less_force_is_seen_where_the_characteristic_saturates() {
    let seen = |curve_permille, codes_per_kpa_milli| {
        allowed(Params { curve_permille, codes_per_kpa_milli, ..Params::DEFAULT }).force_seen
    };
    assert!(seen(3_300, 72_000) > seen(0, 72_000), "the same codes reach farther");
    assert!(seen(3_300, 72_000) < seen(0, 72_000 * 10 / 43), "but not as far as a line through the full range");
}
