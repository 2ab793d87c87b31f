//! The reader of scenes: what it takes, what it says of what it does not take, and that nothing makes it fall over.

mod any_text;
mod errors;
mod keys;

use sim::metrics;
use sim::scene::{self, Scene, SceneErrors, read};

fn library() -> Vec<(String, String)> {
    let names = scene::library::names().unwrap();
    assert!(names.contains(&"wall".into()));
    names
        .into_iter()
        .map(|name| (scene::library::text(&name).unwrap().1, name))
        .map(|(text, name)| (name, text))
        .collect()
}

fn read_it(text: &str) -> Result<Scene, SceneErrors> {
    read("my.toml", text, &metrics::names())
}

#[test]
fn every_scene_of_the_library_reads_and_writes_the_same() {
    for (name, text) in library() {
        let once = read_it(&text).unwrap_or_else(|errors| panic!("{name}: {errors}"));
        let written = scene::text::write(&once);
        let again = read_it(&written).unwrap_or_else(|errors| panic!("{name}: {errors}"));
        assert_eq!(scene::text::write(&again), written);
        let named = |scene: &Scene| {
            scene.effects.iter().map(|named| (named.effect.name, named.values.clone())).collect::<Vec<_>>()
        };
        assert_eq!(named(&again), named(&once));
        assert_eq!((again.tables, again.script), (once.tables, once.script));
        assert_eq!((again.events, again.bounds), (once.events, once.bounds));
        assert_eq!((again.seed, again.duration_s, again.about), (once.seed, once.duration_s, once.about));
    }
}

#[test]
fn events_read_and_write_the_same() {
    let text = "about = \"\"\nduration_s = 1\n[[event]]\nkind = \"encoder_slip\"\nat_s = 0.5\nby_counts = -4\n";
    let once = read_it(text).unwrap_or_else(|errors| panic!("{errors}"));
    let again = read_it(&scene::text::write(&once)).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!((once.events.len(), once.events), (1, again.events));
}

#[test]
fn a_goal_may_come_as_an_inline_table_and_at_the_same_time_as_another() {
    let text = "about = \"\"\nduration_s = 1\nscript = [{ at_s = 1, goal_n = 1.5 }, { at_s = 1, goal_n = 0 }]\n";
    let scene = read_it(text).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(scene.script.len(), 2);
    assert_eq!((scene.script[0].goal_n, scene.script[1].goal_n), (1.5, 0.0));
    assert_eq!(scene.table("tip").number("radius_mm"), 10.0);
}

#[test]
fn the_controller_knows_the_finger_unless_told_otherwise() {
    use fingertip::params::Params;
    let params = |tables: &str| {
        let scene =
            read_it(&format!("about = \"\"\nduration_s = 1\n{tables}")).unwrap_or_else(|errors| panic!("{errors}"));
        scene::controller::params(&scene)
    };
    // The reference finger, but for what only effects bring, and with its direction confirmed.
    assert_eq!(
        params(""),
        Params { row_sag_ppb_per_code: 0, friction_unm: 0, direction_confirmed: 1, ..Params::DEFAULT }
    );
    assert_eq!(params("[effects.row_sag]").row_sag_ppb_per_code, Params::DEFAULT.row_sag_ppb_per_code);
    assert_eq!(params("[tip]\nmodulus_kpa = 400.5").modulus_pa, 400_500);
    assert_eq!(params("[tip]\nmodulus_kpa = 400\n[controller]\nmodulus_pa = 250000").modulus_pa, 250_000);
}
