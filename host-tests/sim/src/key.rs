//! What a key of a scene is, told once: the reader checks by it, errors quote it, and the reference page is made from
//! it.

use std::fmt;

/// A key of a table of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Its name, with its unit as a suffix where it has one: `rms_codes`, `radius_mm`.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// What it may hold.
    pub kind: Kind,
}

/// What a key may hold. A default of `None` makes it required.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number within bounds.
    Number {
        /// The least.
        min: f64,
        /// The largest.
        max: f64,
        /// Where it is not given.
        default: Option<f64>,
    },
    /// A whole number within bounds.
    Whole {
        /// The least.
        min: i64,
        /// The largest.
        max: i64,
        /// Where it is not given.
        default: Option<i64>,
    },
    /// One of these words.
    Word {
        /// All of them.
        words: &'static [&'static str],
        /// Where it is not given.
        default: Option<&'static str>,
    },
    /// A number within bounds, which may be left out: [`Values::optional`].
    Optional {
        /// The least.
        min: f64,
        /// The largest.
        max: f64,
        /// Whether only whole numbers are allowed.
        whole: bool,
    },
    /// Any text in a line; required.
    Text,
    /// Pairs of whole numbers, such as `[[3, 4], [9, 9]]` for taxels by row and column; none where it is not given.
    Pairs {
        /// Each number is below this.
        below: i64,
    },
}

impl Key {
    /// A number within bounds, with a default.
    pub const fn number(name: &'static str, about: &'static str, min: f64, max: f64, default: f64) -> Self {
        Self { name, about, kind: Kind::Number { min, max, default: Some(default) } }
    }

    /// A whole number within bounds, with a default.
    pub const fn whole(name: &'static str, about: &'static str, min: i64, max: i64, default: i64) -> Self {
        Self { name, about, kind: Kind::Whole { min, max, default: Some(default) } }
    }

    /// What it may hold, in words: "number, 0 to 5, default 1".
    pub fn allowed(&self) -> String {
        let default = |value: Option<String>| value.map_or("required".into(), |value| format!("default {value}"));
        match self.kind {
            Kind::Number { min, max, default: value } => {
                format!("number, {min} to {max}, {}", default(value.map(|value| value.to_string())))
            }
            Kind::Whole { min, max, default: value } => {
                format!("whole number, {min} to {max}, {}", default(value.map(|value| value.to_string())))
            }
            Kind::Word { words, default: value } => {
                format!(
                    "{}, {}",
                    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or "),
                    default(value.map(|value| format!("\"{value}\"")))
                )
            }
            Kind::Optional { min, max, whole } => {
                format!("{}number, {min} to {max}, may be left out", if whole { "whole " } else { "" })
            }
            Kind::Text => "text, required".into(),
            Kind::Pairs { below } => format!("pairs [row, column], each 0 to {}, default none", below - 1),
        }
    }

    /// What it holds where it is not given; none where it is required or may be left out.
    pub fn default(&self) -> Option<Value> {
        match self.kind {
            Kind::Number { default, .. } => default.map(Value::Number),
            Kind::Whole { default, .. } => default.map(Value::Whole),
            Kind::Word { default, .. } => default.map(Value::Word),
            Kind::Pairs { .. } => Some(Value::Pairs(Vec::new())),
            Kind::Optional { .. } | Kind::Text => None,
        }
    }

    /// The unit that its name ends with; none where it is a plain number, a word or a text.
    pub fn unit(&self) -> Option<String> {
        output::units::of(self.name)
    }
}

/// The checked values of a table, with every default filled in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values(Vec<(&'static str, Value)>);

/// A checked value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of [`Kind::Number`] and [`Kind::Optional`].
    Number(f64),
    /// Of [`Kind::Whole`].
    Whole(i64),
    /// Of [`Kind::Word`].
    Word(&'static str),
    /// Of [`Kind::Text`].
    Text(String),
    /// Of [`Kind::Pairs`].
    Pairs(Vec<[i64; 2]>),
}

impl fmt::Display for Value {
    /// As TOML writes it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // The shortest digits that read as the same number.
            Self::Number(value) if value.fract() == 0.0 && value.abs() < 1e15 => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::Whole(value) => write!(f, "{value}"),
            Self::Word(word) => toml_edit::Value::from(*word).fmt(f),
            Self::Text(text) => toml_edit::Value::from(text).fmt(f),
            Self::Pairs(pairs) => write!(f, "{pairs:?}"),
        }
    }
}

impl Values {
    /// Those of a table that is not given; what is required or may be left out is not among them.
    pub fn defaults(keys: &[Key]) -> Self {
        Self(keys.iter().filter_map(|key| Some((key.name, key.default()?))).collect())
    }

    /// Takes a value in; a key comes once.
    pub fn insert(&mut self, name: &'static str, value: Value) {
        self.0.retain(|(known, _)| *known != name);
        self.0.push((name, value));
    }

    /// A number.
    ///
    /// # Panics
    /// Where the table's description has no such number: a mistake in the code that asks, not in the scene.
    pub fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Value::Number(number) => *number,
            Value::Whole(number) => *number as f64,
            other => panic!("{name} is no number but {other:?}"),
        }
    }

    /// A whole number.
    ///
    /// # Panics
    /// As [`Values::number`].
    pub fn whole(&self, name: &str) -> i64 {
        match self.get(name) {
            Value::Whole(number) => *number,
            other => panic!("{name} is no whole number but {other:?}"),
        }
    }

    /// A word.
    ///
    /// # Panics
    /// As [`Values::number`].
    pub fn word(&self, name: &str) -> &'static str {
        match self.get(name) {
            Value::Word(word) => word,
            other => panic!("{name} is no word but {other:?}"),
        }
    }

    /// Pairs.
    ///
    /// # Panics
    /// As [`Values::number`].
    pub fn pairs(&self, name: &str) -> &[[i64; 2]] {
        match self.get(name) {
            Value::Pairs(pairs) => pairs,
            other => panic!("{name} holds no pairs but {other:?}"),
        }
    }

    /// A number that may be left out.
    pub fn optional(&self, name: &str) -> Option<f64> {
        self.0.iter().any(|(known, _)| *known == name).then(|| self.number(name))
    }

    /// A text.
    ///
    /// # Panics
    /// As [`Values::number`].
    pub fn text(&self, name: &str) -> &str {
        match self.get(name) {
            Value::Text(text) => text,
            other => panic!("{name} is no text but {other:?}"),
        }
    }

    /// All of them, in the order of the description.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    fn get(&self, name: &str) -> &Value {
        let found = self.0.iter().find(|(known, _)| *known == name);
        &found.unwrap_or_else(|| panic!("no key {name} is described")).1
    }
}
