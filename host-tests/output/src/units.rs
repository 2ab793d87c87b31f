//! The unit of a quantity by the end of its name: `torque_constant_unm_per_a` is in uN m/A.
//!
//! A name ends with its unit word by word, `per` standing for what it is divided by. So a unit that is made of others
//! needs no entry.

/// Words of a unit's name that are shown as they are.
const PLAIN: [&str; 18] = [
    "code", "codes", "counts", "cycles", "g", "mm", "mrad", "ms", "ns", "permille", "ppb", "ppm", "rad", "s", "turn",
    "ug", "um", "us",
];
/// Other words of a unit's name, each with its printed form.
const WORDS: [(&str, &str); 23] = [
    ("a", "A"),
    ("c", "degrees Celsius"),
    ("cm2", "cm^2"),
    ("decade", "decade of time"),
    ("deg", "degrees"),
    ("hz", "Hz"),
    ("j", "J"),
    ("k", "K"),
    ("kpa", "kPa"),
    ("m2", "m^2"),
    ("ma", "mA"),
    ("mn", "mN"),
    ("mnm", "mN m"),
    ("mohm", "mOhm"),
    ("mv", "mV"),
    ("n", "N"),
    ("ohm", "Ohm"),
    ("pa", "Pa"),
    ("percent", "%"),
    ("uh", "uH"),
    ("unm", "uN m"),
    ("v", "V"),
    ("w", "W"),
];
/// Divided by these in words: "counts a turn".
const IN_WORDS: [&str; 3] = ["code", "decade", "turn"];
/// Word for the reference quantity, between `per` and the unit.
const OF_WHAT: &str = "goal";
/// Suffix of a unit for thousandths of it.
const THOUSANDTHS: &str = "_milli";

/// The unit that a name ends with; `None` for a plain number.
pub fn of(name: &str) -> Option<String> {
    if let Some(whole) = name.strip_suffix(THOUSANDTHS) {
        return of(whole).map(|unit| format!("0.001 {unit}"));
    }
    let words: Vec<&str> = name.split('_').collect();
    let ends =
        words[before_unit(&words)..].iter().skip_while(|word| **word == OF_WHAT).filter(|word| **word != OF_WHAT);
    let mut unit = String::new();
    let mut divides = false;
    for word in ends {
        match shown(word) {
            None => divides = true,
            Some(shown) if divides => {
                let by = if IN_WORDS.contains(word) { " a " } else { "/" };
                unit = format!("{}{by}{shown}", if unit.is_empty() { "1" } else { &unit });
                divides = false;
            }
            Some(shown) => unit = if unit.is_empty() { shown.into() } else { format!("{unit} {shown}") },
        }
    }
    (!unit.is_empty()).then_some(unit)
}

/// Number of words before the unit.
fn before_unit(words: &[&str]) -> usize {
    words.iter().rposition(|word| shown(word).is_none() && !["per", OF_WHAT].contains(word)).map_or(0, |last| last + 1)
}

/// A name as the label of an axis: `tip.modulus_kpa` is "tip modulus, kPa".
pub fn label(name: &str) -> String {
    let words: Vec<&str> = name.trim_end_matches(THOUSANDTHS).split('_').collect();
    let quantity = words[..before_unit(&words)].join(" ").replace('.', " ");
    of(name).map_or(quantity.clone(), |unit| format!("{quantity}, {unit}"))
}

fn shown(word: &str) -> Option<&'static str> {
    let plain = PLAIN.into_iter().find(|known| *known == word);
    plain.or_else(|| WORDS.iter().find(|(known, _)| *known == word).map(|(_, shown)| *shown))
}

/// One step of a whole number in a unit: `1 code` where the unit is codes.
pub fn step(unit: &str) -> String {
    let one = ["codes", "counts", "cycles"].iter().find_map(|many| Some((many, unit.strip_prefix(many)?)));
    match one {
        _ if unit.starts_with("0.") => unit.into(),
        Some((many, rest)) => format!("1 {}{rest}", many.trim_end_matches('s')),
        None => format!("1 {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_all_that_the_name_ends_with() {
        for (name, unit) in [
            ("torque_constant_unm_per_a", "uN m/A"),
            ("curvature_per_mm", "1/mm"),
            ("speed_rad_per_s", "rad/s"),
            ("voltage_slew_mv_per_ms", "mV/ms"),
            ("modulus_pa", "Pa"),
            ("damping_n_s_per_mm", "N s/mm"),
            ("k_per_w", "K/W"),
            ("inertia_ug_m2", "ug m^2"),
            ("encoder_counts_per_turn", "counts a turn"),
            ("rate_percent_per_decade", "% a decade of time"),
            ("codes_per_kpa_milli", "0.001 codes/kPa"),
            ("max_per_goal_n", "1/N"),
            ("goal_n", "N"),
        ] {
            assert_eq!(of(name).as_deref(), Some(unit), "{name}");
        }
        for plain in ["ratio", "baseline_follows", "fingers", "min"] {
            assert_eq!(of(plain), None, "{plain}");
        }
    }

    #[test]
    fn a_label_has_words_and_the_unit() {
        for (name, expected) in [
            ("tip.modulus_kpa", "tip modulus, kPa"),
            ("settling_s", "settling, s"),
            ("drive.torque_constant_unm_per_a", "drive torque constant, uN m/A"),
            ("params.gain_milli", "params gain"),
            ("slips", "slips"),
        ] {
            assert_eq!(label(name), expected);
        }
    }

    #[test]
    fn a_step_is_one_of_them() {
        let steps = ["codes", "counts a turn", "mV/ms", "0.001 codes/kPa"].map(step);
        assert_eq!(steps, ["1 code", "1 count a turn", "1 mV/ms", "0.001 codes/kPa"]);
    }
}
