//! Codes to contact: the plant's electrical model against what the core reads back.

mod characteristic;

use fingertip::config::ConfigError;
use fingertip::contact::Contact;
use fingertip::contact::from_sums;
use fingertip::params::Params;
use fingertip::shipped::{Array, Config, Frame, ROWS, SLOTS, TARE_FRAMES};
use fingertip::touch::Touch;
use fingertip::units::Newtons;
use sim::plant::{Plant, Setup};

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
        let config = Config::shipped(params).unwrap();
        let mut bench = Self { world: Plant::new(setup), array: Array::new(), config, frame: Frame::EMPTY };
        bench.tare();
        bench
    }

    fn tare(&mut self) {
        self.array.start_tare();
        for _ in 0..TARE_FRAMES {
            self.read();
            self.array.continue_tare();
        }
    }

    fn read(&mut self) -> Contact {
        self.world.fill_frame(&mut self.frame);
        from_sums(self.array.read(&self.frame, &self.config), &self.config)
    }

    fn press(&mut self, indentation_mm: f64) -> Contact {
        self.world.place(self.world.setup().wall.distance_mm + indentation_mm);
        self.read()
    }
}

/// Weight with which the baseline learns a row while nothing touches.
fn drift_weight() -> u32 {
    let config = Config::shipped(&Params::DEFAULT).unwrap();
    Touch::default().learns(Newtons::ZERO, ROWS as u32, &config).expect("it learns")
}

#[test]
fn the_sum_of_the_taxels_is_the_force() {
    let mut bench = Bench::new(&Setup::default());
    for step in 2..=28 {
        let contact = bench.press(f64::from(step) * 0.1);
        let truth = bench.world.force_n();
        let sensed: f64 = contact.force.0.to_num();
        assert!((sensed - truth).abs() <= 0.002 * truth + 0.003, "{truth} N read as {sensed} N");
        let depth: f64 = contact.indentation.0.to_num();
        assert!((depth - bench.world.indentation_mm()).abs() < 0.005, "{depth} mm");
    }
}

#[test]
fn the_sag_of_the_driven_row_is_taken_out() {
    let setup = Setup::default();
    let mut bench = Bench::new(&setup);
    let with = bench.press(2.5);
    bench.config.sag_q32 = 0;
    bench.world.place(0.0);
    bench.tare();
    let without = bench.press(2.5);
    let truth = bench.world.force_n();
    let lost = 1.0 - without.force.0.to_num::<f64>() / truth;
    assert!((0.003..0.05).contains(&lost), "the sag matters: {lost}");
    assert!((with.force.0.to_num::<f64>() / truth - 1.0).abs() < 0.002);
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
fn without_force_the_centre_is_the_middle() {
    let contact = Bench::new(&Setup::default()).read();
    assert_eq!((contact.force.to_bits(), contact.centre_x.to_bits(), contact.centre_y.to_bits()), (0, 0, 0));
}

#[test]
fn dead_and_saturated_taxels_are_counted_and_left_out() {
    let mut bench = Bench::new(&Setup::default());
    bench.press(1.0);
    bench.frame.set_code(4, 4, 0);
    bench.frame.set_code(5, 7, 4095);
    let picture = bench.array.read(&bench.frame, &bench.config);
    assert_eq!(picture.bad_count, 2);
    assert_eq!((picture.taxels[4][4], picture.taxels[5][7]), (0, 0));
    assert_eq!((picture.bad[4], picture.bad[5]), (1 << 4, 1 << 7));
}

#[test]
fn a_row_that_is_never_driven_is_ten_dead_taxels() {
    let mut bench = Bench::new(&Setup::default());
    for column in 0..10 {
        let undriven = bench.frame.code(ROWS, column);
        bench.frame.set_code(3, column, undriven);
    }
    assert_eq!(bench.array.read(&bench.frame, &bench.config).bad_count, 10);
}

#[test]
fn the_undriven_slot_takes_out_a_common_offset() {
    let mut bench = Bench::new(&Setup::default());
    let before = bench.press(1.0);
    for slot in 0..SLOTS {
        for column in 0..10 {
            let code = bench.frame.code(slot, column);
            bench.frame.set_code(slot, column, code + 25);
        }
    }
    assert_eq!(from_sums(bench.array.read(&bench.frame, &bench.config), &bench.config), before);
}

#[test]
fn the_baseline_follows_drift_only_when_told() {
    let mut bench = Bench::new(&Setup::default());
    bench.read();
    for column in 0..10 {
        for row in 0..ROWS {
            let code = bench.frame.code(row, column);
            bench.frame.set_code(row, column, code + 2);
        }
    }
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

#[test]
fn any_frame_is_taken() {
    let mut bench = Bench::new(&Setup::default());
    for pattern in [0, 0xffff, 4095, 4089, 1, 0x1000] {
        for alternate in [pattern, 0, 4095] {
            let mut frame = Frame::EMPTY;
            for slot in 0..SLOTS {
                for column in 0..10 {
                    frame.set_code(slot, column, if (slot + column) % 2 == 0 { pattern } else { alternate });
                }
            }
            let contact = from_sums(bench.array.read(&frame, &bench.config), &bench.config);
            assert!(contact.force.to_bits() >= 0);
            bench.array.continue_tare();
            bench.array.follow_drift(drift_weight());
        }
    }
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
        let params = Params {
            tip_radius_um: (radius_mm * 1e3) as i32,
            modulus_pa: (modulus_kpa * 1e3) as i32,
            ..Params::DEFAULT
        };
        let config = Config::shipped(&params).unwrap();
        let seen_n: f64 = config.force_seen.0.to_num();
        let mut world = Plant::new(&setup);
        let indentation_mm = setup.tip.indentation_mm(seen_n);
        world.place(setup.wall.distance_mm + indentation_mm);
        let mut frame = Frame::EMPTY;
        world.fill_frame(&mut frame);
        let highest = (0..ROWS).flat_map(|row| (0..10).map(move |column| (row, column)));
        let highest = highest.map(|(row, column)| frame.code(row, column)).max().unwrap();
        println!("{radius_mm} mm, {modulus_kpa} kPa: {seen_n} N at {indentation_mm} mm, code {highest}");
        let share = f64::from(highest) / f64::from(config.saturated_codes);
        assert!(share <= 0.951, "{highest}");
        // A taxel averages over a peak that may be small.
        assert!(share >= 0.733, "{highest}: more could be seen");
    }
}

/// What a set of parameters may hold: never beyond the model, never below zero.
#[test]
fn the_force_that_is_seen_whole_is_one_of_the_tips() {
    for undriven_max_codes in [0, 700, 4_000] {
        for codes_per_kpa_milli in [1_000, 24_000, 200_000] {
            for modulus_pa in [20_000, 2_000_000] {
                let params = Params { undriven_max_codes, codes_per_kpa_milli, modulus_pa, ..Params::DEFAULT };
                match Config::shipped(&params) {
                    Ok(config) => {
                        assert!(config.force_seen.0 > 0 && config.force_seen <= config.tip.force_max(), "{params:?}");
                    }
                    Err(ConfigError::Seen { seen_mn, least_mn, .. }) => assert!((0..least_mn).contains(&seen_mn)),
                    Err(error) => panic!("{error}"),
                }
            }
        }
    }
}
