//! What is no press onto a hard flat plate: refused with the reason, and nothing of it counts.

use crate::gains::{Judged, PLATES, Plate, judged, press, scene, three};
use fingertip::calibrate::{Proposal, Refusal, State, UNKNOWN};
use fingertip::state::{Fault, Mode};
use sim::effects::set::Named;
use sim::native::bench::Bench;

const BASE: &str = "[effects.gain_spread]\nrms_percent = 8\n[effects.noise]\nrms_codes = 2\n";
const MIDDLE: Plate = Plate { centre_mm: [0.5, 0.3], tilt_deg: [1.0, 0.0] };

fn bench(plate: Plate, tables: &str) -> Bench<Named> {
    Bench::new(&scene(3, plate, &format!("{BASE}{tables}"))).expect("it runs")
}

#[test]
fn each_reason_has_its_number() {
    let off = |x, y| Plate { centre_mm: [x, y], ..MIDDLE };
    let cases: &[(Plate, &str, Refusal)] = &[
        (MIDDLE, "[effects.object_stiffness]\nyield_mm_per_n = 0.05\n", Refusal::Soft),
        (MIDDLE, "[effects.object_stiffness]\nyield_mm_per_n = 0.2\n", Refusal::Soft),
        (MIDDLE, "[effects.object_stiffness]\nyield_mm_per_n = 1\n", Refusal::Soft),
        (MIDDLE, "[effects.sphere]\ncurvature_per_mm = 0.02\n", Refusal::NotFlat),
        (MIDDLE, "[effects.sphere]\ncurvature_per_mm = 0.06\n", Refusal::NotFlat),
        (MIDDLE, "[effects.cylinder]\ncurvature_per_mm = 0.03\naxis_deg = 20\n", Refusal::NotFlat),
        (MIDDLE, "[effects.edge]\noffset_mm = 2\n", Refusal::NotFlat),
        (off(7.0, 0.0), "", Refusal::OffArray),
        (off(-6.5, 6.5), "", Refusal::OffArray),
        (off(0.0, 9.0), "", Refusal::OffArray),
        (MIDDLE, "[controller]\nmodulus_pa = 600000\n", Refusal::Range),
        (MIDDLE, "[controller]\nforce_max_mn = 1000\n", Refusal::TooLittle),
        (MIDDLE, "[controller]\ncurrent_max_ma = 36\n", Refusal::Stalled),
        (MIDDLE, "[controller]\ntravel_max_um = 1500\n", Refusal::NoContact),
        (MIDDLE, "[effects.tangential]\ndrift_mm_per_s = 1\n", Refusal::NotFlat),
        (MIDDLE, "[effects.tangential]\ndrift_mm_per_s = 1\ndrift_from_s = 1.0\n", Refusal::Moving),
    ];
    for (plate, tables, refusal) in cases {
        let mut bench = bench(*plate, tables);
        let state = press(&mut bench);
        println!("{tables:?} at {:?}: {state:?}", plate.centre_mm);
        assert_eq!(state, State::Refused(*refusal), "{tables:?} at {:?} mm", plate.centre_mm);
        assert_eq!(*bench.pipeline().proposal(), Proposal::NONE);
        assert_eq!(bench.pipeline().status().calibration.presses, 0);
    }
}

/// What a hard plate must not be refused for.
#[test]
fn what_an_ordinary_finger_has_is_no_reason() {
    for tables in [
        "[effects.relaxation]\nshare = 0.15\ntau_s = 0.1\n",
        "[effects.relaxation]\nshare = 0.15\ntau_s = 2.0\n",
        "[effects.hysteresis]\nwidth_percent = 10\n",
        "[effects.creep]\nrate_percent_per_decade = 4\n",
        "[effects.dry_friction]\ntorque_mnm = 0.25\n[effects.stribeck]\ntorque_mnm = 0.1\n",
        "[motor]\nencoder_counts_per_turn = 256\n",
        "[controller]\ntip_radius_um = 10200\n",
        "[tip]\nmodulus_kpa = 400\n[controller]\nmodulus_pa = 400000\n",
        "[tip]\nmodulus_kpa = 150\n[controller]\nmodulus_pa = 150000\n",
    ] {
        let mut bench = bench(MIDDLE, tables);
        assert_eq!(press(&mut bench), State::Done, "{tables}");
        if !tables.contains("hysteresis") && !tables.contains("creep") {
            let Judged { rms_apart, reached, .. } = judged(&mut bench);
            println!("{tables:?}: {:.2} % of {reached}", 100.0 * rms_apart);
            assert!(rms_apart < 0.02, "{tables}: {rms_apart}");
        }
    }
}

/// A dead taxel is told as one that no press reached, and spoils no other.
#[test]
fn a_dead_taxel_keeps_its_gain() {
    let mut bench = bench(MIDDLE, "[effects.broken_taxels]\ndead = [[4, 5], [7, 2]]\n");
    assert_eq!(press(&mut bench), State::Done);
    let proposal = *bench.pipeline().proposal();
    assert_eq!((proposal.sigmas[4][5], proposal.sigmas[7][2]), (UNKNOWN, UNKNOWN));
    assert!(proposal.sigmas[4][4] < 10 && proposal.sigmas[5][5] < 10);
    let Judged { rms, reached, .. } = judged(&mut bench);
    assert!(rms < 0.02 && reached > 65, "{rms} of {reached}");
}

/// Whatever ends a press, the proposal of those before stands, and the gains in force.
#[test]
fn what_interrupts_a_press_leaves_what_was() {
    let ends: [fn(&mut Bench<Named>); 4] = [
        |bench| bench.command().torque = false,
        |bench| bench.pipeline().stop(Fault::LostFrames),
        |bench| {
            bench.command().torque = false;
            bench.command().tare_request += 1;
        },
        |bench| bench.command().goal = fingertip::units::Newtons::ZERO,
    ];
    for (number, end) in ends.into_iter().enumerate() {
        for frames in [3, 500, 1_500, 3_000, 9_000, 13_000] {
            let mut bench = bench(PLATES[0], "");
            assert_eq!(press(&mut bench), State::Done);
            let before = *bench.pipeline().proposal();
            bench.tare();
            bench.command().calibrate_request += 1;
            let mut mode = Mode::Off;
            for _ in 0..frames {
                mode = bench.step().mode;
            }
            end(&mut bench);
            let status = bench.step();
            let (ended, was_pressing) = (status.mode != Mode::Press, mode == Mode::Press);
            if ended && was_pressing {
                assert_eq!(status.calibration.state, State::Refused(Refusal::Interrupted), "{number} after {frames}");
                assert_eq!((*bench.pipeline().proposal(), status.calibration.presses), (before, 1));
            }
            assert_eq!(ended, number < 3 || !was_pressing, "{number} after {frames}");
        }
    }
}

/// New gains and new parameters make what was pressed before worth nothing.
#[test]
fn new_gains_and_parameters_forget_all_presses() {
    let mut bench = three(2, PLATES, BASE);
    let proposal = *bench.pipeline().proposal();
    bench.pipeline().calibrate(&fingertip::shipped::Calibration::of(&proposal.gains));
    assert_eq!(*bench.pipeline().proposal(), Proposal::NONE);
    assert_eq!(bench.pipeline().status().calibration.presses, 0);
    // With these gains in force there is nothing left to correct.
    assert_eq!(press(&mut bench), State::Done);
    let again = *bench.pipeline().proposal();
    let off = (0..100)
        .filter(|place| again.sigmas[place / 10][place % 10] < 20)
        .map(|place| (f64::from(again.gains.get(place)) / f64::from(proposal.gains.get(place)) - 1.0).abs());
    let worst = off.fold(0.0, f64::max);
    assert!(worst < 0.04, "{worst}");
}
