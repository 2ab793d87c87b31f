//! Gains of drawn arrays, apart from the factor that all have in common.

use crate::finger::{Draw, plan, presses};
use solve::gains;
use solve::gains::Condition;

#[test]
fn three_presses_give_the_gains() {
    drawn_arrays(100..104);
}

#[test]
#[ignore = "takes a minute"]
fn three_presses_give_the_gains_of_thirty_arrays() {
    drawn_arrays(100..130);
}

fn drawn_arrays(seeds: std::ops::Range<u64>) {
    let mut all = Vec::new();
    for seed in seeds {
        let draw = Draw::any(seed, [15.0, 25.0], [1, 3]);
        let truth = draw.gains();
        let found = gains(&presses(&draw, 3, &plan())).unwrap_or_else(|why| panic!("{why:?} {draw:?}"));
        let known = || found.taxels.iter().zip(&truth).filter(|(gain, _)| gain.condition == Condition::Sound);
        let count = known().count() as f64;
        let factor = known().map(|(gain, truth)| truth / gain.reads).sum::<f64>() / count;
        let off = || known().map(|(gain, truth)| gain.reads * factor / truth - 1.0);
        let rms = 100.0 * (off().map(|off| off * off).sum::<f64>() / count).sqrt();
        let worst = 100.0 * off().map(f64::abs).fold(0.0, f64::max);
        let sigmas = known().map(|(gain, truth)| ((gain.reads - truth / factor) / gain.sigma).powi(2));
        let sigmas = (sigmas.sum::<f64>() / count).sqrt();
        let listed = |condition| {
            let taxels = found.taxels.iter().enumerate().filter(|(_, gain)| gain.condition == condition);
            taxels.map(|(taxel, _)| [taxel / 10, taxel % 10]).collect::<Vec<_>>()
        };
        println!(
            "{seed} {:.0} kPa, gains {:.0} %: {count} known, rms {rms:.2} %, worst {worst:.2} %, {sigmas:.2} sigmas; common {:.1} of {:.1} %; dead {:?}",
            draw.modulus_kpa,
            draw.gains_percent,
            100.0 * (factor - 1.0),
            100.0 * found.common,
            listed(Condition::Dead),
        );
        // What is found dead reads nothing or less than half, and what is dead is never taken for sound.
        assert!(listed(Condition::Dead).iter().all(|[row, column]| truth[row * 10 + column] < 0.5));
        assert!(known().all(|(_, truth)| *truth > 0.0));
        assert!(listed(Condition::Odd).is_empty());
        all.push([rms, sigmas]);
    }
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (median, worst) = (all[all.len() / 2][0], all[all.len() - 1][0]);
    println!("rms: median {median:.2} %, worst {worst:.2} %");
    // A finger whose noise is 1 code cannot be better than 0.05 %.
    assert!((0.05..0.4).contains(&median) && worst < 1.5, "{median} {worst}");
    assert!(all.iter().all(|[_, sigmas]| *sigmas < 2.5));
}

/// Taxels whose readings do not follow the model are left out and named, and move nothing else.
#[test]
fn odd_taxels_are_named() {
    let draw = Draw { gains_percent: 5.0, creep_percent: 2.0, ..Draw::plain(250.0) };
    let mut presses = presses(&draw, 2, &plan());
    let before = gains(&presses).expect("gains");
    for step in presses.iter_mut().flat_map(|press| &mut press.steps) {
        // One conducts as the square, one is read from its neighbour, one was counted as bad by the chip.
        let mean = step.taxels[44].mean;
        step.taxels[44].mean = mean * mean.abs() / 400.0;
        step.taxels[67].mean = step.taxels[34].mean;
        step.taxels[55].bad = true;
    }
    // A single step decides nothing.
    let glitch = &mut presses[0].steps[20].taxels;
    glitch[45].bad = true;
    (glitch[36].mean, glitch[54].mean) = (0.0, 4000.0);
    let found = gains(&presses).expect("gains");
    assert_eq!(found.taxels[44].condition, Condition::Odd);
    assert_eq!(found.taxels[67].condition, Condition::Odd);
    assert_eq!(found.taxels[55].condition, Condition::Dead);
    assert!([36, 45, 54].into_iter().all(|taxel| found.taxels[taxel].condition == Condition::Sound));
    for (taxel, (one, other)) in found.taxels.iter().zip(&before.taxels).enumerate() {
        if one.condition == Condition::Sound {
            assert!((one.reads / other.reads - 1.0).abs() < 0.02, "{taxel}: {one:?} {other:?}");
        }
    }
}
