//! What a scene does not name costs nothing, and what has no magnitude changes nothing.

mod common;

use common::{Last, scene};
use sim::effects::set::{Named, Set};
use sim::native::simulate_with;
use sim::registry;
use sim::scene::text;
use sim::watch::Summary;

/// Touches, changes its goal, lets go; the tables of effects come behind.
fn run<E: Set>(tables: &str) -> Summary {
    let script = [(0.0, 1.0), (0.2, 2.0), (0.3, 0.0)]
        .map(|(at_s, goal_n)| format!("[[script]]\nat_s = {at_s}\ngoal_n = {goal_n}\n"));
    let text = format!("duration_s = 0.35\n[object]\ndistance_mm = 2\n{}{tables}", script.concat());
    simulate_with::<E>(&scene(&text), &mut Last::default()).unwrap()
}

#[test]
fn compiled_in_but_not_named_changes_no_bit_and_is_never_called() {
    let unnamed = run::<Named>("");
    assert_eq!(unnamed.digest, run::<()>("").digest);
    assert_eq!(unnamed.ledger, []);
    // The digest sees what changes.
    assert_ne!(unnamed.digest, run::<Named>("[effects.noise]\n").digest);
}

#[test]
fn each_effect_without_magnitude_changes_no_bit() {
    let plain = run::<()>("").digest;
    let mut changed = Vec::new();
    for effect in registry::all() {
        let zero = run::<Named>(&text::zero(effect));
        changed.extend((zero.digest != plain).then_some(effect.name));
        assert_eq!(zero.ledger.len(), 1);
        assert!(zero.ledger[0].evaluations > 0, "{} was not called", effect.name);
    }
    assert!(changed.is_empty(), "these change bits: {changed:?}");
}

#[test]
fn all_effects_without_magnitude_change_no_bit_and_cost_the_sum_of_each() {
    let all: String = registry::all().map(text::zero).collect();
    let all = run::<Named>(&all);
    assert_eq!(all.digest, run::<()>("").digest);
    assert_eq!(all.ledger.len(), registry::all().count());
    // Calls of one do not depend on which others are named: cost is linear in their number, to the call.
    for cost in &all.ledger {
        let effect = registry::all().find(|effect| effect.name == cost.effect).unwrap();
        assert_eq!(run::<Named>(&text::zero(effect)).ledger[0].evaluations, cost.evaluations, "{}", effect.name);
    }
}

#[test]
fn every_effect_by_its_default_runs_to_the_end_and_alike_each_time() {
    for effect in registry::all() {
        let table = format!("[effects.{}]\n", effect.name);
        let once = run::<Named>(&table);
        assert_eq!(once.digest, run::<Named>(&table).digest, "{}", effect.name);
    }
}
