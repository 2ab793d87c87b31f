//! Messages about mistakes in scenes.

use crate::read_it;

/// A scene with these lines in it, from line 3 on.
fn error(lines: &str) -> String {
    match read_it(&format!("about = \"a test\"\nduration_s = 1\n{lines}")) {
        Ok(_) => panic!("this was read:\n{lines}"),
        Err(errors) => errors.to_string(),
    }
}

#[track_caller]
fn says(lines: &str, expected: &str) {
    let error = error(lines);
    assert_eq!(error, expected.trim_start_matches('\n'), "\n{error}\n");
}

#[test]
fn a_missing_unit() {
    says(
        "[object]\ndistance = 5",
        "
my.toml:4:1: `distance` lacks its unit in [object]
  4 | distance = 5
    | ^^^^^^^^
  allowed: distance_mm: number, 0 to 100, default 5
  did you mean `distance_mm`?",
    );
}

#[test]
fn another_unit() {
    says(
        "[object]\n  distance_cm = 5",
        "
my.toml:4:3: unknown key `distance_cm` in [object]
  4 |   distance_cm = 5
    |   ^^^^^^^^^^^
  allowed: distance_mm: number, 0 to 100, default 5
  did you mean `distance_mm`?",
    );
}

#[test]
fn an_unknown_key() {
    says(
        "[tip]\ncolour = \"red\"",
        "
my.toml:4:1: unknown key `colour` in [tip]
  4 | colour = \"red\"
    | ^^^^^^
  allowed: radius_mm, modulus_kpa",
    );
}

#[test]
fn an_unknown_table() {
    let error = error("[transmision]\nratio = 1");
    assert!(
        error.starts_with("my.toml:3:2: unknown table [transmision]\n  3 | [transmision]\n    |  ^^^^^^^^^^^\n"),
        "{error}"
    );
    assert!(error.ends_with("did you mean `transmission`?"), "{error}");
}

#[test]
fn an_unknown_effect() {
    let error = error("[effects.hysterisis]");
    assert!(error.starts_with("my.toml:3:10: unknown effect `hysterisis`\n"), "{error}");
    assert!(error.contains("allowed: clock_tolerance, ") && error.ends_with("did you mean `hysteresis`?"), "{error}");
}

#[test]
fn a_wrong_type() {
    says(
        "[tip]\nradius_mm = \"10\"  # no text",
        "
my.toml:4:13: `radius_mm` cannot be \"10\"
  4 | radius_mm = \"10\"  # no text
    |             ^^^^
  allowed: number, 4 to 16, default 10",
    );
    says(
        "[motor]\nencoder_counts_per_turn = 1600.5",
        "
my.toml:4:27: `encoder_counts_per_turn` cannot be 1600.5
  4 | encoder_counts_per_turn = 1600.5
    |                           ^^^^^^
  allowed: whole number, 16 to 65536, default 1600",
    );
}

#[test]
fn a_value_out_of_range() {
    says(
        "[effects.noise]\nrms_codes = -1",
        "
my.toml:4:13: `rms_codes` of -1 is out of its range
  4 | rms_codes = -1
    |             ^^
  allowed: number, 0 to 500, default 1.5",
    );
    for strange in ["nan", "inf", "-inf", "1e300", "1e-300"] {
        assert!(error(&format!("[tip]\nradius_mm = {strange}")).contains("allowed: number, 4 to 16"), "{strange}");
    }
}

#[test]
fn a_word_that_is_not_known() {
    says(
        "[effects.host_jitter]\ndistribution = \"gaussian normal\"",
        "
my.toml:4:16: `distribution` does not know \"gaussian normal\"
  4 | distribution = \"gaussian normal\"
    |                ^^^^^^^^^^^^^^^^^
  allowed: \"uniform\" or \"normal\", default \"uniform\"",
    );
    assert!(error("[effects.host_jitter]\ndistribution = \"unifrom\"").ends_with("did you mean `uniform`?"));
}

#[test]
fn taxels_beyond_the_array_or_twice() {
    for pairs in ["[[3, 10]]", "[[3]]", "[[3, 4], [3, 4]]", "[3, 4]", "[[3, 4, 5]]", "[[-1, 0]]"] {
        says(
            &format!("[effects.broken_taxels]\ndead = {pairs}"),
            &format!(
                "
my.toml:4:8: `dead` cannot be {pairs}
  4 | dead = {pairs}
    |        {}
  allowed: pairs [row, column], each 0 to 9, default none",
                "^".repeat(pairs.len())
            ),
        );
    }
}

#[test]
fn a_key_twice() {
    let error = error("[tip]\nradius_mm = 9\nradius_mm = 10");
    assert!(error.starts_with("my.toml:5:1: this is not TOML: duplicate key\n  5 | radius_mm = 10\n"), "{error}");
}

#[test]
fn no_toml() {
    let error = error("[tip\nradius_mm = 9");
    assert!(error.starts_with("my.toml:3:5: this is not TOML: "), "{error}");
}

#[test]
fn a_script_out_of_order() {
    says(
        "[[script]]\nat_s = 0.5\ngoal_n = 1\n[[script]]\nat_s = 0.25\ngoal_n = 2",
        "
my.toml:7:8: the script is not in order of time: 0.25 s after 0.5 s
  7 | at_s = 0.25
    |        ^^^^
  allowed: at_s of 0.5 or later",
    );
    says(
        "[[script]]\nat_s = 1.5\ngoal_n = 1",
        "
my.toml:4:8: this never happens: the scene ends at 1 s
  4 | at_s = 1.5
    |        ^^^
  allowed: at_s of 0 to 1",
    );
}

#[test]
fn events_that_cannot_be() {
    let unknown = error("[[event]]\nat_s = 0.5\nkind = \"torqe_off\"");
    assert!(unknown.starts_with("my.toml:5:8: unknown kind of event `torqe_off`\n"), "{unknown}");
    assert!(unknown.contains("allowed: object_move, ") && unknown.ends_with("did you mean `torque_off`?"), "{unknown}");
    says(
        "[[event]]\nat_s = 0.5\nkind = \"object_move\"\nby = 1\nspeed_mm_per_s = 10",
        "
my.toml:6:1: `by` lacks its unit in [[event]] of kind `object_move`
  6 | by = 1
    | ^^
  allowed: by_mm: number, -20 to 100, required
  did you mean `by_mm`?",
    );
    let tare = |at_s: f64| format!("[[event]]\nat_s = {at_s}\nkind = \"tare\"\n");
    let order = error(&(tare(0.5) + &tare(0.25)));
    assert!(order.starts_with("my.toml:7:8: the events are not in order of time: 0.25 s after 0.5 s"), "{order}");
    assert!(error(&tare(1.5)).starts_with("my.toml:4:8: this never happens: the scene ends at 1 s"));
    assert!(error("[[event]]\nat_s = 0.5").starts_with("my.toml:3:1: [[event]] lacks `kind`"));
    assert!(error(&(tare(0.5) + "for_s = 1")).contains("unknown key `for_s` in [[event]] of kind `tare`"));
    let removed = "[[event]]\nat_s = 0.5\nkind = \"object_removed\"\nfor_s = 0.1\n[effects.object_mass]";
    assert!(error(removed).starts_with("my.toml:5:8: `object_removed` cannot act on an object that the fingers move"));
}

#[test]
fn a_missing_key() {
    says(
        "[[script]]\nat_s = 0.5",
        "
my.toml:3:1: [[script]] lacks `goal_n`
  3 | [[script]]
    | ^^^^^^^^^^
  allowed: goal_n: number, 0 to 150, required",
    );
}

#[test]
fn bounds_that_cannot_be() {
    says(
        "[[expect]]\nmetric = \"peak_force_n\"\nmin = 2\nmax = 1",
        "
my.toml:5:7: min of 2 is above max of 1
  5 | min = 2
    |       ^
  allowed: min <= max",
    );
    let error = |lines: &str| error(lines);
    let unknown = error("[[expect]]\nmetric = \"peak_force\"\nmax = 1");
    assert!(unknown.starts_with("my.toml:4:10: unknown metric `peak_force`\n"), "{unknown}");
    assert!(
        unknown.contains("allowed: peak_force_n, ") && unknown.ends_with("did you mean `peak_force_n`?"),
        "{unknown}"
    );
    assert!(error("[[expect]]\nmetric = \"rise_ms\"").contains("`rise_ms` without a bound"));
    let bound = "[[expect]]\nmetric = \"rise_ms\"\nmax = 5\n";
    assert!(error(&bound.repeat(2)).starts_with("my.toml:7:10: bounds of `rise_ms` for the second time"));
}

#[test]
fn a_controller_that_contradicts_itself() {
    let error = error("[controller]\ncontact_on_mn = 10");
    assert!(
        error.starts_with(
            "my.toml:3:2: the controller refuses its parameters: contact_off_mn of 15: below contact_on_mn"
        ),
        "{error}"
    );
}

#[test]
fn a_table_where_a_value_belongs_and_the_other_way_round() {
    assert!(error("[[tip]]\nradius_mm = 9").contains("`tip` is a table\n"));
    assert!(error("[script]\nat_s = 0\ngoal_n = 1").contains("`script` is a list of tables\n"));
    assert!(error("[tip.radius_mm]").contains("`radius_mm` cannot be"));
    assert!(error("effects = 3").contains("`effects` is a table of tables"));
    assert!(error("[effects]\nnoise = 3").contains("the effect `noise` is a table"));
}

#[test]
fn all_mistakes_come_at_once_in_the_order_of_the_text() {
    let text =
        "about = 3\nseeds = 4\n[tip]\nradius_mm = 100\n[effects.noise]\nrms = 1\n[[expect]]\nmetric = \"x\"\nmin = 1\n";
    let errors = read_it(text).expect_err("six mistakes").0;
    let places: Vec<_> = errors.iter().map(|error| (error.line, error.column)).collect();
    // `duration_s` is missing: reported at the beginning.
    assert_eq!(places, [(1, 1), (1, 9), (2, 1), (4, 13), (6, 1), (8, 10)]);
}

#[test]
fn columns_count_characters() {
    says(
        "[effects.noise]\n\"größe\" = 1",
        "
my.toml:4:1: unknown key `größe` in [effects.noise]
  4 | \"größe\" = 1
    | ^^^^^^^
  allowed: rms_codes",
    );
}
