//! What effects cost that are compiled in but not named: runs a scene without its effects, by turns with none compiled
//! and with all, and prints the ratios of the times: the pairs' median, and of the quickest run of each, which a busy
//! machine disturbs least. Then names effects without magnitude, each alone and all together: together they cost at
//! most the sum, or cost grew faster than their number.
//!
//! `cargo run --profile host -p sim --example unnamed-cost -- [SCENE] [PAIRS]`

use sim::cli;
use sim::effects::{self, Description, Named, Set};
use sim::native::simulate_with;
use sim::scene::{self, Scene, read};
use sim::watch::{Step, Watch};
use std::error::Error;
use std::time::Instant;

struct Nobody;

impl Watch for Nobody {
    fn step(&mut self, _step: &Step) {}
}

fn seconds<E: Set>(scene: &Scene) -> Result<f64, Box<dyn Error>> {
    let begun = Instant::now();
    simulate_with::<E>(scene, &mut Nobody)?;
    Ok(begun.elapsed().as_secs_f64())
}

/// The scene with these effects alone, without magnitude.
fn named(scene: &Scene, effects: &[&'static Description]) -> Result<Scene, Box<dyn Error>> {
    let tables: String = effects.iter().map(|effect| scene::zero(effect)).collect();
    let effects = read("named.toml", &format!("about = \"\"\nduration_s = 1\n{tables}"), &[])?.effects;
    Ok(Scene { effects, ..scene.clone() })
}

/// Median of the additional run time of a scene relative to one without effects; the runs alternate.
fn more(scene: &Scene, bare: &Scene, pairs: usize) -> Result<f64, Box<dyn Error>> {
    let mut more = Vec::new();
    for _ in 0..pairs {
        let without = seconds::<Named>(bare)?;
        more.push(seconds::<Named>(scene)? / without - 1.0);
    }
    more.sort_by(f64::total_cmp);
    Ok(more[pairs / 2])
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut scene = cli::load(&arguments.next().unwrap_or_else(|| "wall".into()), &[], None)?;
    let pairs: usize = arguments.next().map_or(Ok(100), |pairs| pairs.parse())?;
    scene.effects.clear();
    let mut ratios = Vec::new();
    let mut quickest = [f64::INFINITY; 2];
    for pair in 0..pairs.max(1) {
        // Who goes first changes with each pair, so a clock that slows down favours neither.
        let (none, all) = if pair % 2 == 0 {
            let none = seconds::<()>(&scene)?;
            (none, seconds::<Named>(&scene)?)
        } else {
            let all = seconds::<Named>(&scene)?;
            (seconds::<()>(&scene)?, all)
        };
        ratios.push(all / none);
        quickest = [quickest[0].min(none), quickest[1].min(all)];
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share) as usize];
    println!(
        "{}, {} pairs: with all compiled in and none named it takes {:.4} of the time without (quartiles {:.4} and {:.4}); \
         quickest to quickest {:.4}",
        scene.name,
        ratios.len(),
        at(0.5),
        at(0.25),
        at(0.75),
        quickest[1] / quickest[0]
    );
    let all: Vec<_> = effects::all().collect();
    let mut sum = 0.0;
    for effect in &all {
        sum += more(&named(&scene, &[effect])?, &scene, pairs.div_ceil(5))?;
    }
    println!(
        "without magnitude: all {} named take {:.2} of that time more, each alone {sum:.2} in sum",
        all.len(),
        more(&named(&scene, &all)?, &scene, pairs.div_ceil(5))?
    );
    Ok(())
}
