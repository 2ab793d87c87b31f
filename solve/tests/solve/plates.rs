//! Plates that yield, move or are left, and presses that are too shallow.

use crate::finger::{Draw, Finger, Part, Place, plan};
use solve::gains::NoGains;
use solve::judge::Verdict;
use solve::modulus::NoModulus;
use solve::press::Press;
use solve::{gains, modulus};

fn drawn(seed: u64, yields_mm_per_n: f64) -> Draw {
    let extra = format!("[effects.object_stiffness]\nyield_mm_per_n = {yields_mm_per_n:?}\n");
    Draw { extra, ..Draw::any(seed, [0.0, 5.0], [0, 2]) }
}

fn press(draw: &Draw, moves_mm_per_s: f64, plan: &[Part]) -> Press {
    let mut finger = Finger::new(draw);
    finger.go(&Place::any(&mut fastrand::Rng::with_seed(draw.seed), 1.5, 2.0));
    finger.tare();
    finger.carry(moves_mm_per_s);
    finger.press(plan, 8.0)
}

#[test]
fn a_soft_plate_is_measured() {
    for seed in 0..2 {
        for yields_mm_per_n in [0.0, 0.03, 0.06] {
            let draw = drawn(seed, yields_mm_per_n);
            let found = modulus(&[press(&draw, 0.0, &plan())]).unwrap_or_else(|why| panic!("{why:?} {draw:?}"));
            let judgement = found.gains.presses[0].judgement;
            let [yields, sigma] = judgement.yields_mm_per_n;
            let error = found.kpa / draw.modulus_kpa - 1.0;
            println!(
                "{:.0} kPa yields {yields_mm_per_n}: {yields:.4} +- {sigma:.4} {:?}, modulus {:.1} %",
                draw.modulus_kpa,
                judgement.verdict,
                100.0 * error
            );
            assert!((yields - yields_mm_per_n).abs() < 0.003 + 0.1 * yields_mm_per_n, "{yields}");
            assert_eq!(matches!(judgement.verdict, Verdict::Soft(_)), yields_mm_per_n > 0.0, "{judgement:?}");
            assert!(error.abs() < 0.06, "{error}");
        }
    }
}

#[test]
fn a_moving_plate_is_refused_with_its_speed() {
    for seed in 0..2 {
        for mm_per_s in [0.02, -0.05, 0.07] {
            let refused = gains(&[press(&drawn(seed, 0.0), mm_per_s, &plan())]);
            let Err(NoGains::Judged(Verdict::Moving(speed))) = refused else { panic!("{mm_per_s}: {refused:?}") };
            println!("moves {mm_per_s}: {speed:.3}");
            assert!((speed / mm_per_s - 1.0).abs() < 0.5, "{mm_per_s} {speed}");
        }
    }
}

#[test]
fn a_press_that_counts_is_kept_beside_one_that_does_not() {
    let draw = drawn(5, 0.0);
    let found = gains(&[press(&draw, 0.05, &plan()), press(&draw, 0.0, &plan())]).expect("one counts");
    assert!(matches!(found.left_out.as_slice(), [(0, NoGains::Judged(Verdict::Moving(_)))]), "{:?}", found.left_out);
    assert_eq!(found.presses.len(), 1);
}

#[test]
fn lost_and_shallow_presses_are_refused() {
    let draw = drawn(1, 0.0);
    let mut lost = press(&draw, 0.0, &plan());
    let deepest_mm = lost.deepest_mm();
    let away = lost.steps.iter_mut().filter(|step| step.middle_mm() > deepest_mm - 0.3);
    away.flat_map(|step| &mut step.taxels).for_each(|taxel| taxel.mean *= 0.01);
    let refused = modulus(&[lost]);
    assert!(
        matches!(refused, Err(NoModulus::Gains(NoGains::Judged(Verdict::Lost(share)))) if share < 0.1),
        "{refused:?}"
    );
    let shallow = [
        Part::Ramp { to_mm: 0.2, mm_per_s: 2.0, step_mm: 0.02 },
        Part::Ramp { to_mm: -0.3, mm_per_s: 2.0, step_mm: 0.02 },
    ];
    let refused = modulus(&[press(&draw, 0.0, &shallow)]);
    println!("{refused:?}");
    assert!(
        matches!(
            refused,
            Err(NoModulus::Gains(NoGains::Judged(Verdict::TooLittle(_)) | NoGains::Steps(_) | NoGains::Taxels(_)))
        ),
        "{refused:?}"
    );
    let air = modulus(&[press(&draw, 0.0, &[Part::Ramp { to_mm: -0.1, mm_per_s: 2.0, step_mm: 0.1 }])]);
    assert!(matches!(air, Err(NoModulus::Gains(_))), "{air:?}");
    assert_eq!(modulus(&[]), Err(NoModulus::Gains(NoGains::NoPress)));
}
