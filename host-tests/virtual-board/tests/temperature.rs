//! Temperature and analogue supply as the board measures them, and the drift that it computes from them.

use crate::common::*;
use fingertip::chip::Factory;
use virtual_board::scene::finger::{Clock, Finger};

const GAIN_PPM_PER_K: i32 = 3_600;
const ZERO_PA_PER_K: i32 = 10;
const START_MS: u64 = 60;
const UNMEASURED_MC: i32 = -273_150;

/// The first converter's CR1, bits of it, and SMPR1.
const ADC1_CR1: u64 = 0x4001_2004;
const SCAN: u64 = 1 << 8;
const INJECTED_FOLLOWS: u64 = 1 << 10;
const ADC1_SMPR1: u64 = 0x4001_200c;

fn chip_mc(rig: &mut Rig) -> i32 {
    read_u32(rig, address::CHIP_MC) as i32
}

fn drift_mn(rig: &mut Rig) -> i32 {
    read_u32(rig, address::PRESENT_DRIFT_MN) as i32
}

/// A finger whose array and microcontroller warm by 20 K: an hour in the hot in seconds.
fn warming(factory: Option<Factory>) -> Rig {
    let params = Params {
        direction_confirmed: 1,
        array_gain_ppm_per_k: GAIN_PPM_PER_K,
        array_zero_pa_per_k: ZERO_PA_PER_K,
        ..Params::DEFAULT
    };
    let options = Options { factory, ..Options::stored(&Record { params, ..Record::DEFAULT }) };
    let keys = ["effects.temperature_drift.time_constant_s=1.0".into(), "object.distance_mm=0.5".into()];
    let scene = sim::cli::load("hot_hour", &keys, None).unwrap_or_else(|error| panic!("{error}"));
    let clock = Clock::new(START_MS * 1_000_000);
    let finger = Finger::all(&scene, clock, -0.001).expect("the world is simulated").remove(0);
    let mut rig = Rig::new(&image(), Surroundings::Scene(Box::new(finger)), &options).expect("the image starts");
    rig.run_until_ns(20_000_000).expect("it runs");
    write_u8(&mut rig, address::TARE, 1);
    rig.run_until_ns(START_MS * 1_000_000).expect("it runs");
    drive(&mut rig, 1_000);
    rig
}

fn true_c(rig: &mut Rig) -> f64 {
    let now_ns = rig.now_ns();
    with(rig, move |stand| stand.bench.front_end.lock().world.chip_c(now_ns))
}

#[test]
fn the_board_measures_its_temperature_and_the_force_s_drift() {
    let mut rig = warming(None);
    assert!(matches!(rig.world(|world| world.force_n()), Err(Error::OtherWorld)));
    codes_that_stay_away_are_no_temperature_and_the_finger_holds_on(&mut rig);
    the_means_go_on_where_the_scan_starts_again(&mut rig);
    drive(&mut rig, 1_000);
    the_bus_tells_the_chip_s_temperature_and_the_drift(&mut rig);
    // The emulated converter reports inputs that are sampled for too short a time.
    rig.check_gaps().expect("nothing is missing");
    poke(&mut rig, ADC1_SMPR1, 0);
    rig.run_ms(1).expect("it runs");
    rig.check_gaps().expect_err("3 cycles are too few");
}

fn codes_that_stay_away_are_no_temperature_and_the_finger_holds_on(rig: &mut Rig) {
    rig.run_ms(200).expect("it runs");
    assert!(chip_mc(rig) > 25_000);
    // No injected group behind the supply.
    poke(rig, ADC1_CR1, SCAN);
    rig.run_ms(80).expect("it runs");
    assert_eq!((chip_mc(rig), read_u16(rig, address::ANALOGUE_SUPPLY_MV)), (UNMEASURED_MC, 0));
    assert!((5_900..=6_100).contains(&read_u16(rig, address::SUPPLY_MV)), "the supply is read");
    assert!(read_u32(rig, address::PRESENT_FORCE_MN) > 900, "it holds its goal all the same");
    poke(rig, ADC1_CR1, SCAN | INJECTED_FOLLOWS);
    rig.run_ms(80).expect("it runs");
    assert!(chip_mc(rig) > 25_000);
}

fn the_means_go_on_where_the_scan_starts_again(rig: &mut Rig) {
    write_and_run_ms(rig, address::TORQUE_ENABLE, 0, 40);
    let before = chip_mc(rig);
    write_param(rig, "settle_ns", 2_500);
    rig.run_ms(400).expect("it runs");
    let (true_mc, told) = (1e3 * true_c(rig), chip_mc(rig));
    let follows = told > before + 2_000 && (f64::from(told) - true_mc).abs() < 1_000.0;
    assert!(follows, "{told} after {before}, {true_mc} mC");
}

fn the_bus_tells_the_chip_s_temperature_and_the_drift(rig: &mut Rig) {
    let mut worst_c: f64 = 0.0;
    for _ in 0..15 {
        rig.run_ms(100).expect("it runs");
        let true_c = true_c(rig);
        let told_c = f64::from(chip_mc(rig)) * 1e-3;
        worst_c = worst_c.max((told_c - true_c).abs());
        assert!((told_c - true_c).abs() < 1.0, "{told_c} C of {true_c} C");
    }
    let (told_c, drift) = (f64::from(chip_mc(rig)) * 1e-3, drift_mn(rig));
    // 1 N of 3600 ppm/K, and 225 mm^2 of 10 Pa/K, since 25 C.
    let expected_mn = (told_c - 25.0) * (3.6 + 2.25);
    println!("within {worst_c:.2} C; at {told_c:.2} C {drift} mN, {expected_mn:.1} mN by the coefficients");
    assert!(told_c > 39.0, "it has warmed: {told_c} C");
    // The term goes after a reading by a tenth of a second.
    assert!((f64::from(drift) - expected_mn).abs() < 6.0, "{drift} mN of {expected_mn:.1} mN");
    assert_eq!(read_u16(rig, address::ANALOGUE_SUPPLY_MV), 3_300);
}

#[test]
fn without_the_factory_s_codes_there_is_no_temperature_and_no_term() {
    let rig = &mut warming(Some(Factory { reference: 0xffff, sensor: [0xffff; 2] }));
    rig.run_ms(200).expect("it runs");
    assert_eq!((chip_mc(rig), drift_mn(rig)), (UNMEASURED_MC, 0));
    assert_eq!(read_u16(rig, address::ANALOGUE_SUPPLY_MV), 0);
    assert!(read_u32(rig, address::PRESENT_FORCE_MN) > 900, "it holds its goal all the same");
}
