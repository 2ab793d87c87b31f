//! Tables and keys of a scene other than those of the effects. Reader, errors and reference page use these
//! descriptions.

use crate::events::{EVENT, KINDS};
use fingertip::params::Params;
use fingertip::shipped::ROWS;
use std::fmt;

#[derive(Clone, Copy, Debug)]
pub struct Table {
    pub name: &'static str,
    pub about: &'static str,
    pub keys: &'static [Key],
}

impl Table {
    /// Head of the table in a scene.
    pub fn title(&self) -> String {
        match self.name {
            "" => "the scene".into(),
            name if MANY.contains(&name) || name == COUNT.name => format!("[[{name}]]"),
            name if KINDS.iter().any(|kind| kind.name == name) => format!("[[event]] of kind `{name}`"),
            name if TABLES.iter().any(|table| table.name == name) => format!("[{name}]"),
            name => format!("[effects.{name}]"),
        }
    }
}

/// Tables that may occur many times.
pub const MANY: [&str; 3] = [SCRIPT.name, EVENT.name, EXPECT.name];

const fn number(name: &'static str, about: &'static str, min: f64, max: f64, default: f64) -> Key {
    Key::number(name, about, min, max, default)
}

pub const ROOT: Table = Table {
    name: "",
    about: "Keys before the first table.",
    keys: &[
        Key::new("about", "Description of the scene in one line.", Kind::Text),
        Key::required("duration_s", "Virtual time from the end of the tare, when torque is enabled.", 0.0, 1e6),
        Key::whole("seed", "Seed of all random numbers.", 0, i64::MAX, 1),
    ],
};

pub const SCRIPT: Table = Table {
    name: "script",
    about: "Goals of the host, in order of time; may occur many times.",
    keys: &[
        Key::required("at_s", "Time from the start.", 0.0, 1e6),
        Key::required("goal_n", "Requested force from then on; 0 releases the object.", 0.0, 150.0),
    ],
};

pub const EXPECT: Table = Table {
    name: "expect",
    about: "Bound on a metric by `min`, `max` or both; may occur many times.",
    keys: &[
        Key::new("metric", "Name of the metric.", Kind::Text),
        Key::new("min", "Lower limit, in the unit of the metric.", ANY),
        Key::new("max", "Upper limit, in the unit of the metric.", ANY),
        Key::new(
            "max_per_goal_n",
            "Increase of `max` per N of the goal, for over_force_mn, over_force_defective_mn, hold_swing_mn and hold_error_mn.",
            Kind::Optional { min: 0.0, max: 1e6, whole: false },
        ),
    ],
};
/// Table of a population.
pub(crate) const COUNT: Table = Table {
    name: "count",
    about: "Count of the fingers whose metric is above a value.",
    keys: &[EXPECT.keys[0], Key::required("above", "Value that is not counted.", -1e12, 1e12)],
};
const ANY: Kind = Kind::Optional { min: -1e12, max: 1e12, whole: false };

/// Tables that occur at most once. A missing one has its defaults.
pub const TABLES: &[Table] = &[
    Table {
        name: "tip",
        about: "Hemispherical soft fingertip.",
        keys: &[
            number("radius_mm", "Radius a.", 4.0, 16.0, 10.0),
            number("modulus_kpa", "Young's modulus Y: F = pi Y d^2.", 20.0, 2000.0, 250.0),
        ],
    },
    Table {
        name: "array",
        about: "Tactile array of 10 x 10 taxels.",
        keys: &[
            number("pitch_mm", "Distance from taxel to taxel.", 0.5, 4.0, 1.5),
            number("preload_codes", "Reading of a taxel without pressure.", 0.0, 1000.0, 40.0),
            number("gain_codes_per_kpa", "Increase of the reading per kPa.", 1.0, 200.0, 24.0),
        ],
    },
    Table {
        name: "motor",
        about: "Brushed motor with its encoder.",
        keys: &[
            number("resistance_ohm", "Terminal resistance.", 0.05, 200.0, 2.83),
            number("torque_mnm_per_a", "Torque constant; also the back-EMF constant in mV s/rad.", 0.1, 200.0, 5.35),
            number("inertia_g_cm2", "Inertia at the shaft.", 0.01, 200.0, 0.71),
            Key::whole("encoder_counts_per_turn", "Quadrature counts per turn.", 16, 65_536, 1600),
        ],
    },
    Table {
        name: "transmission",
        about: "Gearhead, drum and tendon.",
        keys: &[
            number("ratio", "Turns of the motor per turn of the drum.", 1.0, 1000.0, 43.0),
            number("drum_radius_mm", "Radius on which the tendon winds.", 1.0, 50.0, 12.0),
        ],
    },
    Table {
        name: "supply",
        about: "Supply of the bridge, and the bridge.",
        keys: &[
            number("source_v", "Voltage without load.", 1.0, 60.0, 6.0),
            number("bridge_ohm", "Resistance of the bridge's two switches in the motor's path.", 0.0, 10.0, 0.7),
        ],
    },
    Table {
        name: "object",
        about: "Object in front of the tip: a rigid plane without effects.",
        keys: &[
            number("distance_mm", "Travel at which the tip touches.", 0.0, 100.0, 5.0),
            number("centre_x_mm", "Contact centre from the array's middle, along the columns.", -20.0, 20.0, 0.0),
            number("centre_y_mm", "Contact centre from the array's middle, along the rows.", -20.0, 20.0, 0.0),
            number("floor_until_s", "Time until which a floor carries an object that can move.", 0.0, 1e6, 1e6),
            number("shake_g", "Acceleration of a shaking downwards, in g.", -1e3, 1e3, 0.0),
            number("shake_at_s", "Start of the shaking.", 0.0, 1e6, 0.0),
            number("shake_ms", "Duration of the shaking.", 0.0, 1e6, 20.0),
        ],
    },
    Table {
        name: "hand",
        about: "Fingers: one, or two that press against each other.",
        keys: &[
            Key::whole("fingers", "Number of fingers.", 1, 2, 1),
            number("lift_mm", "Height of the lift.", 0.0, 1e3, 0.0),
            number("lift_at_s", "Start of the lift.", 0.0, 1e6, 0.0),
            number("lift_s", "Duration of the lift, from rest to rest.", 1e-3, 1e6, 0.5),
        ],
    },
    Table {
        name: "world",
        about: "Simulation of the world.",
        keys: &[number("step_us", "Longest step; it also ends where a duty changes.", 0.1, 1000.0, 100.0)],
    },
    Table {
        name: "host",
        about: "Host on the bus. It sends its command when the script changes it, and repeats it. With `read_ms` it also reads \
                force and centre of pressure, and increases the goal before the contact slips, or after a slip.",
        keys: &[
            number("period_ms", "Time from a command to its repetition.", 0.1, 10_000.0, 10.0),
            Key::whole("watchdog_ms", "Bus watchdog of the controller; 0 is off.", 0, 65_535, 0),
            Key::whole("fit_level", "Requested fit level, 0 to 5.", 0, 5, 2),
            number("read_ms", "Time between readings; 0 reads nothing and does not grip.", 0.0, 1000.0, 0.0),
            number("grip_friction", "Friction coefficient that the host trusts.", 0.01, 10.0, 0.5),
            number("grip_n_per_mm", "Assumed stiffness of the patch along the surface.", 0.001, 1000.0, 1.0),
            number("grip_drop_mm", "Distance of a returning centre that counts as a slip.", 0.001, 20.0, 0.05),
            number("grip_most_n", "Largest force that the grip requests.", 0.0, 150.0, 4.0),
            number("centre_n_per_mm", "Decrease of the goal per travel, to centre a free object.", 0.0, 10.0, 0.0),
        ],
    },
    Table {
        name: "controller",
        about: "Parameters of the controller. A missing one follows from the other tables, or has the default of the firmware: the \
                controller knows its finger.",
        keys: &CONTROLLER,
    },
];

const CONTROLLER: [Key; Params::COUNT] = {
    let mut keys = [number("", "", 0.0, 0.0, 0.0); Params::COUNT];
    let mut place = 0;
    while place < Params::COUNT {
        let (name, _, min, max) = Params::RANGES[place];
        let kind = Kind::Optional { min: min as f64, max: max as f64, whole: true };
        keys[place] = Key::new(name, Params::DOCS[place], kind);
        place += 1;
    }
    keys
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name, with its unit as a suffix if it has one: `rms_codes`, `radius_mm`.
    pub name: &'static str,
    pub about: &'static str,
    pub kind: Kind,
    /// Value at which an effect changes nothing, if all such keys of the effect have theirs. Other keys may have any value.
    pub idle: Option<f64>,
}

/// Allowed values of a key. A default of `None` makes the key required.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Number {
        min: f64,
        max: f64,
        default: Option<f64>,
    },
    Whole {
        min: i64,
        max: i64,
        default: Option<i64>,
    },
    Word {
        words: &'static [&'static str],
        default: Option<&'static str>,
    },
    /// A number within bounds, which may be left out: [`Values::optional`].
    Optional {
        min: f64,
        max: f64,
        /// True if only whole numbers are allowed.
        whole: bool,
    },
    /// Text in one line; required.
    Text,
    /// Taxels by row and column, such as `[[3, 4], [9, 9]]`; empty if it is missing.
    Taxels,
}

impl Key {
    pub const fn new(name: &'static str, about: &'static str, kind: Kind) -> Self {
        Self { name, about, kind, idle: None }
    }

    /// A number within bounds, required.
    pub const fn required(name: &'static str, about: &'static str, min: f64, max: f64) -> Self {
        Self::new(name, about, Kind::Number { min, max, default: None })
    }

    /// A number within bounds, with a default.
    pub const fn number(name: &'static str, about: &'static str, min: f64, max: f64, default: f64) -> Self {
        Self::new(name, about, Kind::Number { min, max, default: Some(default) })
    }

    /// A whole number within bounds, with a default.
    pub const fn whole(name: &'static str, about: &'static str, min: i64, max: i64, default: i64) -> Self {
        Self::new(name, about, Kind::Whole { min, max, default: Some(default) })
    }

    /// Adds the value at which the effect of the key changes nothing.
    pub const fn idle(self, value: f64) -> Self {
        Self { idle: Some(value), ..self }
    }

    /// Describes the allowed values: "number, 0 to 5, default 1".
    pub fn allowed(&self) -> String {
        let values = match self.kind {
            Kind::Number { min, max, .. } => format!("number, {min} to {max}"),
            Kind::Whole { min, max, .. } => format!("whole number, {min} to {max}"),
            Kind::Word { words, .. } => words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or "),
            Kind::Optional { min, max, whole: true } => format!("whole number, {min} to {max}, may be left out"),
            Kind::Optional { min, max, whole: false } => format!("number, {min} to {max}, may be left out"),
            Kind::Text => "text".into(),
            Kind::Taxels => format!("pairs [row, column], each 0 to {}, default none", ROWS - 1),
        };
        match (self.kind, self.default()) {
            (Kind::Optional { .. } | Kind::Taxels, _) => values,
            (_, Some(default)) => format!("{values}, default {default}"),
            (_, None) => format!("{values}, required"),
        }
    }

    /// Returns the value of a missing key; none if the key is required or optional.
    pub fn default(&self) -> Option<Value> {
        match self.kind {
            Kind::Number { default, .. } => default.map(Value::Number),
            Kind::Whole { default, .. } => default.map(Value::Whole),
            Kind::Word { default, .. } => default.map(Value::Word),
            Kind::Taxels => Some(Value::Pairs(Vec::new())),
            Kind::Optional { .. } | Kind::Text => None,
        }
    }
}

/// Checked values of a table, with all defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values(Vec<(&'static str, Value)>);

#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    Whole(i64),
    Word(&'static str),
    Text(String),
    Pairs(Vec<[i64; 2]>),
}

impl fmt::Display for Value {
    /// Formats the value as TOML.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // The shortest text that reads as the same number.
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
    /// Values of a missing table, without required and optional keys.
    pub fn defaults(keys: &[Key]) -> Self {
        Self(keys.iter().filter_map(|key| Some((key.name, key.default()?))).collect())
    }

    /// Sets a value. Each key occurs once.
    pub fn insert(&mut self, name: &'static str, value: Value) {
        self.0.retain(|(known, _)| *known != name);
        self.0.push((name, value));
    }

    /// Returns a number.
    ///
    /// # Panics
    /// The table has no such number: a mistake in the code, not in the scene. The other types panic alike.
    pub fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Value::Number(number) => *number,
            Value::Whole(number) => *number as f64,
            other => panic!("{name} is no number but {other:?}"),
        }
    }

    pub fn whole(&self, name: &str) -> i64 {
        self.of(name, "whole number", |value| if let Value::Whole(number) = value { Some(*number) } else { None })
    }

    pub fn word(&self, name: &str) -> &'static str {
        self.of(name, "word", |value| if let Value::Word(word) = value { Some(*word) } else { None })
    }

    pub fn pairs(&self, name: &str) -> &[[i64; 2]] {
        self.of(name, "list of pairs", |value| if let Value::Pairs(pairs) = value { Some(&pairs[..]) } else { None })
    }

    pub fn text(&self, name: &str) -> &str {
        self.of(name, "text", |value| if let Value::Text(text) = value { Some(text.as_str()) } else { None })
    }

    fn of<'a, T>(&'a self, name: &str, kind: &str, value: impl FnOnce(&'a Value) -> Option<T>) -> T {
        let found = self.get(name);
        value(found).unwrap_or_else(|| panic!("{name} is no {kind} but {found:?}"))
    }

    /// Returns a number that may be missing.
    pub fn optional(&self, name: &str) -> Option<f64> {
        self.0.iter().any(|(known, _)| *known == name).then(|| self.number(name))
    }

    /// Returns all values, in the order of the description.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    fn get(&self, name: &str) -> &Value {
        let found = self.0.iter().find(|(known, _)| *known == name);
        &found.unwrap_or_else(|| panic!("no key {name} is described")).1
    }
}
