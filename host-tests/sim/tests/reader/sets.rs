//! Setting a key from outside.

use crate::read_it;
use sim::cli::load;
use sim::scene::text::set;

const SCENE: &str = "about = \"a\" # kept\nduration_s = 1.0\n[[script]]\nat_s = 0 # kept too\ngoal_n = 1\n[[script]]\nat_s = 0.5\ngoal_n = 2\n";

#[test]
fn what_is_set_is_read_and_comments_stay() {
    let text = set(SCENE, "script.1.goal_n", "3.5").unwrap();
    let text = set(&text, "seed", "9").unwrap();
    let text = set(&text, "duration_s", "2").unwrap();
    let text = set(&text, "effects.noise.rms_codes", "4").unwrap();
    let text = set(&text, "tip.modulus_kpa", "300").unwrap();
    assert!(text.contains("about = \"a\" # kept\n") && text.contains("at_s = 0 # kept too\n"), "{text}");
    let scene = read_it(&text).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!((scene.seed, scene.duration_s, scene.script[1].goal_n), (9, 2.0, 3.5));
    assert_eq!(scene.effects[0].values.number("rms_codes"), 4.0);
    assert_eq!(scene.table("tip").number("modulus_kpa"), 300.0);
}

#[test]
fn what_cannot_be_set_is_told() {
    for (place, value) in
        [("script.2.goal_n", "1"), ("tip.1.x", "1"), ("about.x", "1"), ("", "1"), ("seed", "1 2"), ("seed", "")]
    {
        assert!(set(SCENE, place, value).is_err(), "{place} = {value}");
    }
    let error = |set: &str| load("wall", &[set.into()], None).expect_err("a mistake");
    assert!(error("tip.radius = 3").contains("did you mean `radius_mm`?"));
    assert!(error("tip.radius_mm").contains("TABLE.KEY=VALUE"));
    assert!(load("wal", &[], None).expect_err("no scene").contains("did you mean `wall`?"));
    assert_eq!(load("wall", &[], Some(12)).unwrap().seed, 12);
}
