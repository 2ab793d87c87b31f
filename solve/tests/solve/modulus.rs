//! Young's modulus of drawn tips.

use crate::finger::{DISTANCE_MM, any_place};
use crate::*;
use solve::modulus;
use solve::modulus::Modulus;

/// Draws a tip for each seed, with gains that spread by up to `percent`, presses it, and sums up the errors of the modulus
/// that is solved.
fn errors(name: &str, seeds: Range<u64>, percent: f64, press: impl Fn(&Draw) -> Vec<Press>) -> [f64; 4] {
    let errors = seeds.map(|seed| {
        let draw = Draw::any(seed, [0.0, percent], [0, 2]);
        solved(&draw, &press(&draw)).1
    });
    summary(name, &errors.collect::<Vec<_>>())
}

/// Modulus of a tip, with its error and uncertainty in percent.
fn solved(draw: &Draw, presses: &[Press]) -> (Modulus, [f64; 2]) {
    let found = modulus(presses).unwrap_or_else(|why| panic!("{why:?} {draw:?}"));
    let errors = [100.0 * (found.kpa / draw.modulus_kpa - 1.0), 100.0 * found.sigma_kpa / found.kpa];
    (found, errors)
}

/// Median and largest error, standard uncertainty, and the number of errors within two of it. Prints them, too.
fn summary(name: &str, errors: &[[f64; 2]]) -> [f64; 4] {
    let mut sizes: Vec<f64> = errors.iter().map(|[error, _]| error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let sigma = (errors.iter().map(|[_, sigma]| sigma * sigma).sum::<f64>() / errors.len() as f64).sqrt();
    let within = errors.iter().filter(|[error, sigma]| error.abs() <= 2.0 * sigma).count();
    let summary = [sizes[sizes.len() / 2], sizes[sizes.len() - 1], sigma, within as f64];
    println!("{name}: {} tips, {summary:.2?}", errors.len());
    summary
}

sim::sizes!(three_presses_give_a_better_one, better(200..202), better(200..203));

fn better(seeds: Range<u64>) {
    let three = |draw: &Draw| presses(draw, 3);
    let [median, worst, sigma, within] = errors("three presses", seeds, 10.0, three);
    assert!(median < 1.0 && worst < 4.0 && within >= 2.0 && sigma < 1.4, "{median} {worst} {within} {sigma}");
}

/// A record that ends at the deepest place, as one that filled the memory, shows less than both strokes.
#[test]
fn the_forward_stroke_alone_is_solved_too() {
    let forward = |draw: &Draw| {
        let mut presses = presses(draw, 1);
        let deepest = presses[0].steps.iter().rposition(|step| step.branch == Branch::Loading).expect("a way in");
        presses[0].steps.truncate(deepest + 1);
        presses
    };
    let [median, worst, .., within] = errors("in alone", 300..303, 10.0, forward);
    assert!(median < 6.0 && within >= 2.0, "{median} {worst} {within}");
}

/// Arrays of other shapes, cut out of the one of 10 by 10.
#[test]
fn an_array_of_any_shape_gives_the_modulus() {
    let errors: Vec<[f64; 2]> = [[8, 9], [10, 7], [7, 8]]
        .into_iter()
        .enumerate()
        .map(|(seed, [rows, columns])| {
            let draw = Draw::any(600 + seed as u64, [0.0, 5.0], [0, 0]);
            let mut presses = presses(&draw, 1);
            let whole = gains(&presses).expect("gains").presses[0].pose.axis_mm;
            let press = &mut presses[0];
            (press.array.rows, press.array.columns) = (rows, columns);
            for step in &mut press.steps {
                let [row, column] = [(10 - rows) / 2, (10 - columns) / 2];
                let kept = step.taxels.chunks(10).skip(row).take(rows);
                step.taxels = kept.flat_map(|taxels| taxels[column..column + columns].to_vec()).collect();
            }
            let pitch_mm = press.array.pitch_mm;
            let (found, errors) = solved(&draw, &presses);
            // The middle of an array with an odd number of rows or columns lies half a pitch before that of 10.
            let off = |size: usize| if size % 2 == 1 { 0.5 * pitch_mm } else { 0.0 };
            let axis = found.gains.presses[0].pose.axis_mm;
            for (axis, whole) in axis.into_iter().zip([whole[0] + off(columns), whole[1] + off(rows)]) {
                assert!((axis - whole).abs() < 0.1, "{axis} {whole}");
            }
            // The rim is pressed on the array's border, which must not make it look dead.
            assert!(found.gains.taxels.iter().all(|gain| gain.condition != Condition::Dead), "{found}");
            errors
        })
        .collect();
    let [_, worst, .., within] = summary("other shapes", &errors);
    assert!(worst < 5.0 && within >= 2.0, "{worst} {within}");
}

/// A contact that reaches over the array's edge is measured by what lies on the array.
#[test]
fn an_edge_does_not_refuse_a_press() {
    let edge = Place { centre_mm: [4.5, -2.0], tilt_deg: [1.0, 1.0] };
    let [_, worst, ..] = errors("over the edge", 400..403, 3.0, |draw| vec![Finger::new(draw).press(&edge, 0.0)]);
    assert!(worst < 4.0, "{worst}");
}

/// A radius that is configured wrong: force over travel does not depend on it, and the roundness takes it.
#[test]
fn a_wrong_radius_hardly_matters() {
    for share in [0.98, 1.02] {
        let [_, worst, .., within] = errors("radius", 500..502, 3.0, |draw| {
            let mut presses = presses(draw, 1);
            presses[0].radius_mm *= share;
            presses
        });
        assert!(worst < 3.0 && within >= 2.0, "{worst} {within}");
    }
}

fn drawn(seed: u64, yields_mm_per_n: f64) -> Draw {
    let extra = format!("[effects.object_stiffness]\nyield_mm_per_n = {yields_mm_per_n:?}\n");
    Draw { extra, ..Draw::any(seed, [0.0, 5.0], [0, 2]) }
}

fn press(draw: &Draw, mm_per_s: f64) -> Press {
    Finger::new(draw).press(&any_place(&mut fastrand::Rng::with_seed(draw.seed), 1.5, 2.0), mm_per_s)
}

sim::sizes!(a_soft_plate_is_measured, soft_plates(0..1), soft_plates(1..2));

fn soft_plates(seeds: Range<u64>) {
    for seed in seeds {
        for yields_mm_per_n in [0.0, 0.03, 0.06] {
            let draw = drawn(seed, yields_mm_per_n);
            let (found, [error, _]) = solved(&draw, &[press(&draw, 0.0)]);
            let solve::gains::Posed { yields_mm_per_n: [yields, _], verdict, .. } = found.gains.presses[0];
            assert!((yields - yields_mm_per_n).abs() < 0.003 + 0.1 * yields_mm_per_n, "{yields} {draw:?}");
            assert_eq!(matches!(verdict, Verdict::Soft(_)), yields_mm_per_n > 0.0, "{verdict:?}");
            assert!(error.abs() < 6.0, "{error}");
        }
    }
}

#[test]
fn a_moving_plate_is_refused_with_its_speed() {
    for seed in 0..2 {
        for mm_per_s in [0.02, -0.05, 0.07] {
            let refused = gains(&[press(&drawn(seed, 0.0), mm_per_s)]);
            let Err(NoGains::Judged(Verdict::Moving(speed))) = refused else { panic!("{mm_per_s}: {refused:?}") };
            assert!((speed / mm_per_s - 1.0).abs() < 0.5, "{mm_per_s} {speed}");
        }
    }
}

#[test]
fn a_press_that_counts_is_kept_beside_one_that_does_not() {
    let draw = drawn(5, 0.0);
    let found = gains(&[press(&draw, 0.05), press(&draw, 0.0)]).expect("one counts");
    assert!(matches!(found.left_out.as_slice(), [(0, NoGains::Judged(Verdict::Moving(_)))]), "{:?}", found.left_out);
    assert_eq!(found.presses.len(), 1);
}

#[test]
fn lost_and_shallow_presses_are_refused() {
    let whole = press(&drawn(1, 0.0), 0.0);
    let mut lost = whole.clone();
    let deepest_mm = lost.deepest_mm();
    let away = lost.steps.iter_mut().filter(|step| step.middle_mm() > deepest_mm - 0.3);
    away.flat_map(|step| &mut step.taxels).for_each(|taxel| taxel.mean *= 0.01);
    let refused = modulus(&[lost]);
    let Err(NoGains::Judged(Verdict::Lost(share))) = refused else { panic!("{refused:?}") };
    assert!(share < 0.1, "{share}");
    let shallow = |most_mm: f64| {
        let mut press = whole.clone();
        press.steps.retain(|step| step.branch == Branch::Loading && step.middle_mm() < DISTANCE_MM + most_mm);
        modulus(&[press])
    };
    let refused = shallow(0.25);
    let Err(NoGains::Judged(Verdict::TooLittle(_)) | NoGains::Steps(_) | NoGains::Taxels(_)) = refused else {
        panic!("{refused:?}")
    };
    let air = shallow(-0.1);
    assert!(air.is_err_and(|why| !matches!(why, NoGains::Fit(_))));
    assert_eq!(modulus(&[]), Err(NoGains::NoPress));
}
