//! What a mistake in a population looks like to the person who made it.

use sim::population;

#[track_caller]
fn says(lines: &str, expected: &[&str]) {
    let text = format!("about = \"a test\"\nduration_s = 0.06\n{lines}");
    let errors = population::read("my.toml", &text).expect_err("this was read").to_string();
    for expected in expected {
        assert!(errors.contains(expected), "`{expected}` is not in:\n{errors}");
    }
}

#[test]
fn keys_that_a_scene_does_not_have() {
    says(
        "[draw]\na = { uniform = [1, 2] }\n[tip]\nmodulus = { is = \"a\" }\n",
        &["my.toml:6:1: `modulus` lacks its unit in [tip]", "did you mean `modulus_kpa`?"],
    );
    says(
        "[effects.nois]\nrms_codes = { uniform = [1, 2] }\n",
        &["my.toml:3:10: unknown effect `nois`", "did you mean `noise`?"],
    );
    says("[objekt]\ndistance_mm = { uniform = [1, 2] }\n", &["unknown table [objekt]", "did you mean `object`?"]);
}

#[test]
fn ranges_that_contradict_themselves_or_the_key() {
    says(
        "[effects.noise]\nrms_codes = { uniform = [3, 0.3] }\n",
        &["my.toml:4:25: the least, 3, is above the largest, 0.3", "allowed: [least, largest]"],
    );
    says(
        "[tip]\nmodulus_kpa = { uniform = [10, 300] }\n",
        &["my.toml:4:15: `tip.modulus_kpa` is drawn from 10 to 300", "allowed: number, 20 to 2000"],
    );
    says(
        "magnitude = 20\n[effects.gain_spread]\nrms_percent = { uniform = [0, 10], follows = \"magnitude\" }\n",
        &["`effects.gain_spread.rms_percent` is drawn from 0 to 200 at a magnitude of 20", "0 to 50"],
    );
    says(
        "[draw]\na = { normal = [0, 10] }\n[object]\ncentre_x_mm = { is = \"a\" }\n",
        &["`object.centre_x_mm` is drawn from -30 to 30"],
    );
    says("[effects.noise]\nrms_codes = { log_uniform = [0, 3] }\n", &["a ratio needs ends above 0"]);
    says("[effects.noise]\nrms_codes = { normal = [1, -1] }\n", &["a deviation of -1"]);
    says("[effects.noise]\nrms_codes = { uniform = [1] }\n", &["two numbers are asked for"]);
    says("magnitude = 0\n", &["my.toml:3:13: `magnitude` is a number above 0"]);
}

#[test]
fn draws_that_are_none() {
    says(
        "[tip]\nmodulus_kpa = { unifrom = [200, 300] }\n",
        &["a draw has one way to be drawn; did you mean `uniform`?"],
    );
    says("[tip]\nmodulus_kpa = { uniform = [200, 300], normal = [250, 10] }\n", &["a draw has one way to be drawn"]);
    says("[tip]\nmodulus_kpa = { uniform = [200, 300], weights = [1] }\n", &["`weights` does not go with `uniform`"]);
    says("[tip]\nmodulus_kpa = { uniform = [200, 300], follows = \"wind\" }\n", &["nothing else can be followed"]);
    says("[tip]\nmodulus_kpa = { choice = [] }\n", &["there is nothing to choose from"]);
    says("[tip]\nmodulus_kpa = { choice = [200, 300], weights = [1] }\n", &["these are no weights", "2 numbers"]);
    says("[tip]\nmodulus_kpa = { choice = [200, \"soft\"] }\n", &["a draw is of words or of numbers"]);
}

#[test]
fn variables_that_are_not_there_not_used_or_of_another_kind() {
    let tip = "[tip]\nmodulus_kpa = { is = \"modulus_kpa\" }\n";
    says(tip, &["no variable `modulus_kpa` stands in [draw] before"]);
    let draw = "[draw]\nmodulus = { uniform = [200, 300] }\n";
    says(&format!("{draw}{tip}"), &["did you mean `modulus`?"]);
    says(draw, &["my.toml:4:1: `modulus` is drawn, and nothing uses it"]);
    let thing = "[draw]\nthing = { choice = [\"wall\", \"ball\"] }\n[tip]\n";
    says(&format!("{thing}modulus_kpa = {{ is = \"thing\" }}\n"), &["`thing` is a word"]);
    says(
        &format!("{thing}modulus_kpa = {{ by = \"thing\", bal = 300, otherwise = 200 }}\n"),
        &["`thing` is never \"bal\"", "wall, ball"],
    );
    says(&format!("{thing}modulus_kpa = {{ by = \"thing\", ball = 300 }}\n"), &["nothing is said for \"wall\""]);
    says("[draw]\na = { is = \"2 *\" }\n[tip]\nmodulus_kpa = { is = \"a\" }\n", &["a number or a variable is missing"]);
    says(
        "[draw]\na = { is = \"a\" }\n[tip]\nmodulus_kpa = { is = \"a\" }\n",
        &["no variable `a` stands in [draw] before"],
    );
}

#[test]
fn events_that_cannot_be_drawn() {
    let events = "[events]\ncount = { uniform = [1, 4] }\nat_s = { uniform = [0, 0.06] }\n";
    says(&format!("{events}[events.torqe_off]\n"), &["`torqe_off` is no kind of event; did you mean `torque_off`?"]);
    says(&format!("{events}[events.torque_off]\n"), &["my.toml:6:1: [events.torque_off] lacks `for_s`"]);
    says(&format!("{events}[events.tare]\nfor_s = 1\n"), &["unknown key `for_s` in [events.tare]", "allowed: weight"]);
    says("[events]\nat_s = 0.1\n", &["my.toml:3:1: [events] lacks `count`", "[events] names no kind"]);
    says(
        &format!("{events}[events.object_move]\nby_mm = {{ uniform = [-99, 1] }}\nspeed_mm_per_s = 10\n"),
        &["`events.object_move.by_mm` is drawn from -99 to 1", "allowed: number, -20 to 100"],
    );
    says("[events]\ncount = 1\nat_s = 7\n[events.tare]\n", &["this never happens: the scene ends at 0.06 s"]);
}

#[test]
fn counts_and_bounds_of_metrics_that_are_not_there() {
    says(
        "[[count]]\nmetric = \"rest_duty\"\nabove = 2\n",
        &["[[count]] is a metric and a number; did you mean `rest_duty_percent`?"],
    );
    says(
        "[[expect]]\nmetric = \"over_force\"\nmax = 1\n",
        &["my.toml:4:10: unknown metric", "did you mean `over_force_mn`?"],
    );
    says(
        "[[expect]]\nmetric = \"runaway_mm\"\nmax = 1\nmax_per_goal_n = 1\n",
        &["`runaway_mm` has no value for each goal"],
    );
    says("[[expect]]\nmetric = \"over_force_mn\"\nmin = 1\nmax_per_goal_n = 1\n", &["`max_per_goal_n` without `max`"]);
}

#[test]
fn files_that_are_not_there() {
    let error = population::load("ordinry").unwrap_err();
    assert!(
        error.contains("did you mean `ordinary`?") && error.contains("careful, handled, ordinary, rough"),
        "{error}"
    );
}

#[test]
fn extending_what_is_not_there_or_extends_itself() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("populations");
    std::fs::create_dir_all(&folder).unwrap();
    let load = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        population::load(path.to_str().unwrap()).map(|_| ())
    };
    assert!(load("none.toml", "extends = \"ordinry\"").unwrap_err().contains("did you mean `ordinary`?"));
    let itself = load("itself.toml", "extends = \"itself\"\nabout = \"\"\nduration_s = 1").unwrap_err();
    assert!(itself.contains("itself extends another itself"), "{itself}");
    for known in ["careful", "rough"] {
        let chained = load("chained.toml", &format!("extends = \"{known}\"")).unwrap_err();
        assert!(chained.contains(&format!("{known} extends another itself")), "{chained}");
    }
    std::fs::write(folder.join("broken.toml"), "about =").unwrap();
    let broken = load("over.toml", "extends = \"broken\"").unwrap_err();
    assert!(
        broken.contains("over.toml extends broken: ") && broken.contains("broken.toml:1:8: this is not TOML"),
        "{broken}"
    );
    assert_eq!(load("fine.toml", "extends = \"ordinary\"\nmagnitude = 0.1"), Ok(()));
    let wrong = load("wrong.toml", "extends = \"ordinary\"\n[tip]\nradius = 9").unwrap_err();
    assert!(wrong.contains("wrong.toml over ordinary") && wrong.contains("radius_mm"), "{wrong}");
}
