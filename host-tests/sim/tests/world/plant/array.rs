//! Pressures at a point, by the paper, and their means on the taxels. The readout: sag, settling, defects, codes.

use super::{free, pressed};
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use proptest::prelude::*;
use sim::mechanics::decay;
use sim::mechanics::pressures::Cell;
use sim::plant::{Plant, Row, Setup, Taxel};
use sim::setup::Tip;

const ORACLE: &str = include_str!("../../../../oracle/park2003.csv");

#[test]
fn pressure_force_and_radius_are_the_papers() {
    let mut points = 0;
    for line in ORACLE.lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let tip = Tip { radius_mm: v[0], modulus_kpa: v[1] };
        let (d, r, rc, p, f) = (v[2], v[3], v[4], v[6], v[7]);
        let flat = tip.flattened(d);
        let close = |ours: f64, oracle: f64| (ours - oracle).abs() <= 4e-15 * oracle.abs().max(1e-12);
        assert!(close(flat.contact_radius2_mm2().sqrt(), rc), "radius at {line}");
        // The rim: p goes to 0 with r_c^2 - r^2, of which only the sizes' rounding is left.
        let rounding = 4e-16 * tip.modulus_kpa * rc * rc / (tip.radius_mm - d).powi(2);
        assert!((flat.pressure_kpa(r * r) - p).abs() <= 4e-15 * p + 2.0 * rounding, "pressure at {line}");
        assert!(close(tip.force_n(d), f), "force at {line}");
        assert!((tip.indentation_mm(f) - d).abs() <= 1e-14 * d, "indentation at {line}");
        points += 1;
    }
    assert_eq!(points, 400);
}

#[test]
fn what_lies_beyond_the_array_is_lost() {
    // A share of 0.6 % at 4 mm, 4 % at 5 mm for this pitch, by the 40-digit reference of the model.
    assert!((0.004..0.008).contains(&-relative_error_of_sum(4.0, 0.0, 0.0)));
    assert!((0.030..0.045).contains(&-relative_error_of_sum(5.0, 0.0, 0.0)));
}

#[test]
fn means_agree_with_brute_force() {
    // 300 x 300 midpoints per taxel: right to 1e-5 of the peak under the rim.
    let mut worst = 0.0_f64;
    for (d, row, column) in [(1.0, 5, 5), (1.0, 2, 4), (1.0, 2, 3), (2.5, 1, 3), (2.5, 4, 4), (0.2, 5, 6), (0.01, 4, 5)]
    {
        let setup = Setup::default();
        let cell = Cell::of(&setup, row, column);
        let flat = setup.tip.flattened(d);
        let n = 300;
        let at = |ends: [f64; 2], i: usize| ends[0] + (ends[1] - ends[0]) * (i as f64 + 0.5) / f64::from(n);
        let mut sum = 0.0;
        for i in 0..n as usize {
            for j in 0..n as usize {
                let (x, y) = (at(cell.x_mm, i), at(cell.y_mm, j));
                sum += flat.pressure_kpa(x * x + y * y);
            }
        }
        let brute = sum / f64::from(n * n);
        let peak = flat.pressure_kpa(0.0);
        worst = worst.max((cell.mean_kpa(&flat) - brute).abs() / peak);
    }
    assert!(worst < 1e-5, "{worst:e} of the peak");
}

#[test]
fn the_picture_has_the_contacts_symmetry() {
    let mut world = pressed(1.6);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let p = world.pressure_kpa(row, column);
            for q in [world.pressure_kpa(ROWS - 1 - row, column), world.pressure_kpa(column, row)] {
                assert!((p - q).abs() < 1e-5 * 40.0, "({row}, {column}): {p} and {q}");
            }
        }
    }
}

#[test]
fn no_contact_no_pressure() {
    let mut world = Plant::new(&free());
    assert!((0..ROWS).all(|row| (0..COLUMNS).all(|column| world.pressure_kpa(row, column) == 0.0)));
}

#[test]
fn rows_follow_the_indentation_the_wall_and_the_pitch() {
    let felt_kpa = |d_mm: f64, centre_y_mm, pitch_mm| {
        let mut setup = Setup::default();
        (setup.wall.centre_y_mm, setup.array.pitch_mm) = (centre_y_mm, pitch_mm);
        let mut plant = Plant::new(&setup);
        plant.place(setup.wall.distance_mm + d_mm);
        plant.pressure_kpa(3, 5)
    };
    let nearer = felt_kpa(1.1, -1.0, 1.5);
    assert!(felt_kpa(1.0, 0.0, 1.5) < felt_kpa(1.1, 0.0, 1.5) && felt_kpa(1.1, 0.0, 1.5) < nearer);
    assert!(felt_kpa(1.1, -1.0, 3.0) < nearer);
}

proptest! {
    #![proptest_config(super::cases(4096))]

    #[test]
    fn any_contact_inside_the_array_is_wholly_felt(d in 0.001..2.5f64, x in -0.8..0.8f64, y in -0.8..0.8f64) {
        let most = if d < 0.2 { 1e-4 } else { 1e-5 };
        prop_assert!(relative_error_of_sum(d, x, y).abs() < most);
    }
}

fn relative_error_of_sum(d: f64, x: f64, y: f64) -> f64 {
    let mut setup = Setup::default();
    setup.wall.centre_x_mm = x;
    setup.wall.centre_y_mm = y;
    let tip = setup.tip.flattened(d);
    let mut sum_kpa = 0.0;
    for row in 0..ROWS {
        sum_kpa += (0..COLUMNS).map(|column| Cell::of(&setup, row, column).mean_kpa(&tip)).sum::<f64>();
    }
    let felt_n = sum_kpa * 1e-3 * setup.array.pitch_mm * setup.array.pitch_mm;
    felt_n / setup.tip.force_n(d) - 1.0
}

const NONE: [bool; ROWS] = [false; ROWS];

fn only(row: usize) -> [bool; ROWS] {
    std::array::from_fn(|r| r == row)
}

#[test]
fn the_boards_reference_figures() {
    let array = Setup::default().array;
    let codes_ohm = array.feedback_ohm * array.drive_v * 4096.0 / array.reference_v;
    assert!((codes_ohm / 1.8e7 - 1.0).abs() < 1e-12);
    assert!((array.preload_siemens * codes_ohm - 40.0).abs() < 1e-9);
    assert!((array.siemens_per_kpa * codes_ohm - 24.0).abs() < 1e-9);
    assert!((array.row_ohm / codes_ohm - 1.667e-6).abs() < 1e-9);
}

#[test]
fn pressing_one_taxel_shows_in_no_other_row() {
    // Ghosting is nil: undriven rows and all columns sit at the same voltage.
    let mut light = pressed(0.0);
    let mut heavy = pressed(1.0);
    let far = 0;
    assert_eq!(heavy.pressure_kpa(far, 5), 0.0);
    assert_eq!(light.settled_volts(&only(far)), heavy.settled_volts(&only(far)));
    assert_eq!(heavy.settled_volts(&NONE), [0.3; COLUMNS]);
}

#[test]
fn columns_settle_exponentially() {
    let mut world = pressed(1.5);
    let (start, end) = (world.settled_volts(&only(4))[5], world.settled_volts(&only(2))[5]);
    assert!(start - end > 0.1);
    for tau in [0.0_f64, 0.5, 1.0, 3.0, 9.0, 12.0] {
        let expected = end + (start - end) * (-tau).exp();
        let volts = world.settling_volts(&only(2), tau * 0.2e-6, &only(4))[5];
        assert!((volts - expected).abs() < 1e-9, "{volts} V for {expected} V after {tau} tau");
    }
}

#[test]
fn the_decay_factor_is_the_exponential() {
    let mut worst = 0.0_f64;
    for n in 0..=40_000 {
        let x = f64::from(n) * 1e-3;
        worst = worst.max((decay(x) / (-x).exp() - 1.0).abs());
        if n == 12_000 {
            assert!(worst < 1e-12, "{worst:e} up to 12");
        }
    }
    assert!(worst < 1e-11, "{worst:e} up to 40");
    assert_eq!(decay(1e6), 0.0);
    assert_eq!(decay(0.0), 1.0);
}

#[test]
fn codes_are_rounded_down_and_cut() {
    let array = Setup::default().array;
    let lsb = 3.3 / 4096.0;
    assert_eq!(array.code(0.0), 0);
    assert_eq!(array.code(100.999 * lsb), 100);
    assert_eq!(array.code(101.001 * lsb), 101);
    assert_eq!((array.code(3.3), array.code(9.0), array.code(-1.0)), (4095, 4095, 0));
}

#[test]
fn a_frame_holds_every_slot() {
    let mut world = pressed(1.0);
    let mut frame = Frame::EMPTY;
    world.fill_frame(&mut frame);
    world.fill_frame(&mut frame);
    assert_eq!(frame.sequence, 2);
    for slot in 0..SLOTS {
        for column in 0..COLUMNS {
            assert_eq!(frame.code(slot, column), world.slot_codes(slot)[column]);
        }
    }
    // 0.3 V of virtual ground is 372.36 codes; the preload of the undriven slot has settled away.
    assert_eq!(frame.code(ROWS, 5), 372);
    // The middle taxels' mean r^2 is 1.5 mm^2, where p is 23.3 kPa: 559 codes, 40 of preload, 0.4 % of sag, 372 of
    // ground.
    assert!((963..975).contains(&frame.code(5, 5)), "{}", frame.code(5, 5));
}

#[test]
fn a_slot_sampled_at_its_edge_still_shows_the_slot_before() {
    let mut world = pressed(1.0);
    let settled: Vec<_> = (0..SLOTS).map(|slot| world.slot_codes(slot)).collect();
    let mut setup = Setup::default();
    setup.array.sample_after_s = 0.0;
    let mut world = Plant::new(&setup);
    world.place(setup.wall.distance_mm + 1.0);
    for slot in 0..SLOTS {
        assert_eq!(world.slot_codes(slot), settled[(slot + SLOTS - 1) % SLOTS]);
    }
}

#[test]
fn defects_show_where_they_are() {
    let mut sound = pressed(1.0);
    let code = |world: &mut Plant, row, column| f64::from(world.slot_codes(row)[column]);

    let mut dead = pressed(1.0);
    dead.faults.array.taxels[4][5] = Taxel::Dead;
    assert_eq!(dead.slot_codes(4)[5], 372);
    assert_eq!(dead.slot_codes(5)[5], sound.slot_codes(5)[5]);

    let mut shorted = pressed(1.0);
    shorted.faults.array.taxels[4][5] = Taxel::Shorted;
    assert_eq!(shorted.slot_codes(4)[5], 4095);
    // The row's switch carries 100 mS: R_on S = 3, so the others read a quarter.
    let share = (code(&mut shorted, 4, 4) - 372.4) / (code(&mut sound, 4, 4) - 372.4);
    assert!((0.24..0.26).contains(&share), "{share}");

    let mut low = pressed(1.0);
    low.faults.array.rows[4] = Row::StuckLow;
    assert_eq!(low.slot_codes(4)[5], 372);
    assert_eq!(low.slot_codes(5)[5], sound.slot_codes(5)[5]);

    let mut high = pressed(1.0);
    high.faults.array.rows[4] = Row::StuckHigh;
    assert_eq!(high.slot_codes(4)[5], sound.slot_codes(4)[5]);
    assert_eq!(high.slot_codes(ROWS)[5], sound.slot_codes(4)[5]);
    let both = code(&mut sound, 4, 5) + code(&mut sound, 5, 5) - 372.4;
    assert!((code(&mut high, 5, 5) - both).abs() < 2.0);

    let mut saturated = pressed(1.0);
    saturated.faults.array.saturated = true;
    assert!((0..SLOTS).all(|slot| saturated.slot_codes(slot) == [4095; COLUMNS]));
}
