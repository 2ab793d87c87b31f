//! What a key of a scene is, told once: the reader checks by it, errors quote it, and the reference page is made from it.

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
    /// Pairs of whole numbers, such as `[[3, 4], [9, 9]]` for taxels by row and column; none where it is not given.
    Pairs {
        /// Each number is below this.
        below: i64,
    },
}

/// The checked values of a table, with every default filled in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values(Vec<(&'static str, Value)>);

/// A checked value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of [`Kind::Number`].
    Number(f64),
    /// Of [`Kind::Whole`].
    Whole(i64),
    /// Of [`Kind::Word`].
    Word(&'static str),
    /// Of [`Kind::Pairs`].
    Pairs(Vec<[i64; 2]>),
}

impl Values {
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

    /// All of them, in the order of the description.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    fn get(&self, name: &str) -> &Value {
        let found = self.0.iter().find(|(known, _)| *known == name);
        &found.unwrap_or_else(|| panic!("no key {name} is described")).1
    }
}
