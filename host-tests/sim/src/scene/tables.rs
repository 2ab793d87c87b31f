//! The tables of a scene, beside those of the effects. The reader, the errors and the reference page all come from
//! here.

use crate::events::{EVENT, KINDS};
use crate::key::{Key, Kind};
use fingertip::params::Params;

/// A table of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
}

impl Table {
    /// Its head, as it stands in a scene.
    pub fn title(&self) -> String {
        match self.name {
            "" => "the scene".into(),
            name if MANY.contains(&name) => format!("[[{name}]]"),
            name if KINDS.iter().any(|kind| kind.name == name) => format!("[[event]] of kind `{name}`"),
            name if TABLES.iter().any(|table| table.name == name) => format!("[{name}]"),
            name => format!("[effects.{name}]"),
        }
    }
}

/// The tables that may stand many times.
pub const MANY: [&str; 3] = [SCRIPT.name, EVENT.name, EXPECT.name];

const fn number(name: &'static str, about: &'static str, min: f64, max: f64, default: f64) -> Key {
    Key::number(name, about, min, max, default)
}

/// What stands before the first table.
pub const ROOT: Table = Table {
    name: "",
    about: "What stands before the first table.",
    keys: &[
        Key { name: "about", about: "What the scene shows, in a line.", kind: Kind::Text },
        Key {
            name: "duration_s",
            about: "Virtual time, from the moment at which the finger is tared and its torque enabled.",
            kind: Kind::Number { min: 0.0, max: 1e6, default: None },
        },
        Key::whole("seed", "Where all randomness comes from.", 0, i64::MAX, 1),
    ],
};

/// An entry of the script.
pub const SCRIPT: Table = Table {
    name: "script",
    about: "What the host asks for, in order of time; may stand many times.",
    keys: &[
        Key { name: "at_s", about: "When, from the start.", kind: Kind::Number { min: 0.0, max: 1e6, default: None } },
        Key {
            name: "goal_n",
            about: "The force asked for from then on; 0 lets go.",
            kind: Kind::Number { min: 0.0, max: 150.0, default: None },
        },
    ],
};

/// What must hold.
pub const EXPECT: Table = Table {
    name: "expect",
    about: "What must hold of a metric: `min`, `max` or both; may stand many times.",
    keys: &[
        Key { name: "metric", about: "The metric's name.", kind: Kind::Text },
        Key { name: "min", about: "The least, in the metric's unit.", kind: ANY },
        Key { name: "max", about: "The largest, in the metric's unit.", kind: ANY },
        Key {
            name: "max_per_goal_n",
            about: "How much larger for each N of the goal, of a metric that has a value for each goal: over_force_mn, over_force_defective_mn, hold_swing_mn, hold_error_mn.",
            kind: Kind::Optional { min: 0.0, max: 1e6, whole: false },
        },
    ],
};
const ANY: Kind = Kind::Optional { min: -1e12, max: 1e12, whole: false };

/// The tables that stand at most once; one that is left out has its defaults.
pub const TABLES: &[Table] = &[
    Table {
        name: "tip",
        about: "The hemispherical soft fingertip.",
        keys: &[
            number("radius_mm", "Radius a.", 4.0, 16.0, 10.0),
            number("modulus_kpa", "Young's modulus Y: F = pi Y d^2.", 20.0, 2000.0, 250.0),
        ],
    },
    Table {
        name: "array",
        about: "The tactile array of 10 x 10 taxels.",
        keys: &[
            number("pitch_mm", "Distance from taxel to taxel.", 0.5, 4.0, 1.5),
            number("preload_codes", "Reading of a taxel without pressure.", 0.0, 1000.0, 40.0),
            number("gain_codes_per_kpa", "What a kPa adds to it.", 1.0, 200.0, 24.0),
        ],
    },
    Table {
        name: "motor",
        about: "The brushed motor with its encoder.",
        keys: &[
            number("resistance_ohm", "Terminal resistance.", 0.05, 200.0, 2.83),
            number("torque_mnm_per_a", "Torque constant; also the back-EMF constant in mV s/rad.", 0.1, 200.0, 5.35),
            number("inertia_g_cm2", "Inertia at the shaft.", 0.01, 200.0, 0.71),
            Key::whole("encoder_counts_per_turn", "Quadrature counts for one turn.", 16, 65_536, 1600),
        ],
    },
    Table {
        name: "transmission",
        about: "Gearhead, drum and tendon.",
        keys: &[
            number("ratio", "Motor turns for one turn of the drum.", 1.0, 1000.0, 43.0),
            number("drum_radius_mm", "Radius on which the tendon winds.", 1.0, 50.0, 12.0),
        ],
    },
    Table {
        name: "supply",
        about: "What feeds the bridge, and the bridge.",
        keys: &[
            number("source_v", "Voltage without load.", 1.0, 60.0, 6.0),
            number("bridge_ohm", "Resistance of the bridge's two switches in the motor's path.", 0.0, 10.0, 0.7),
        ],
    },
    Table {
        name: "object",
        about: "What stands in the tip's way: a rigid plane, where no effect says more.",
        keys: &[
            number("distance_mm", "Travel at which the tip touches.", 0.0, 100.0, 5.0),
            number("centre_x_mm", "Contact centre from the array's middle, along the columns.", -20.0, 20.0, 0.0),
            number("centre_y_mm", "Contact centre from the array's middle, along the rows.", -20.0, 20.0, 0.0),
            number("floor_until_s", "Until when a floor carries an object that can move.", 0.0, 1e6, 1e6),
            number("shake_g", "Acceleration that drives it down for a while, in g.", -1e3, 1e3, 0.0),
            number("shake_at_s", "From when.", 0.0, 1e6, 0.0),
            number("shake_ms", "For how long.", 0.0, 1e6, 20.0),
        ],
    },
    Table {
        name: "hand",
        about: "The fingers: one, or two that press against each other.",
        keys: &[
            Key::whole("fingers", "How many.", 1, 2, 1),
            number("lift_mm", "How far the hand lifts.", 0.0, 1e3, 0.0),
            number("lift_at_s", "From when.", 0.0, 1e6, 0.0),
            number("lift_s", "For how long, from rest to rest.", 1e-3, 1e6, 0.5),
        ],
    },
    Table {
        name: "world",
        about: "How the world is simulated.",
        keys: &[number("step_us", "Longest step of the world; it also ends where a duty changes.", 0.1, 1000.0, 100.0)],
    },
    Table {
        name: "host",
        about: "The host on the bus: it sends its command when the script changes it, and repeats it. With `read_ms` it also reads \
                force and centre of pressure, and asks for more before the contact slips, or when it did.",
        keys: &[
            number("period_ms", "Time from a command to its repetition.", 0.1, 10_000.0, 10.0),
            Key::whole("watchdog_ms", "Bus watchdog that it sets in the controller; 0 is off.", 0, 65_535, 0),
            number("read_ms", "Time from a reading to the next; 0 reads nothing, and does not grip.", 0.0, 1000.0, 0.0),
            number("grip_friction", "Share of the force that the host trusts along the surface.", 0.01, 10.0, 0.5),
            number("grip_n_per_mm", "What it takes for the patch's stiffness along the surface.", 0.001, 1000.0, 1.0),
            number("grip_drop_mm", "A centre that springs back this far has slipped.", 0.001, 20.0, 0.05),
            number("grip_most_n", "The largest force that it asks for by itself.", 0.0, 150.0, 4.0),
            number(
                "centre_n_per_mm",
                "How much less it asks of a finger that went on from where its force first stood: two fingers keep a free thing in \
                 its place.",
                0.0,
                10.0,
                0.0,
            ),
        ],
    },
    Table {
        name: "controller",
        about: "Parameters of the controller. What is left out is what the other tables say, where they say it, or the firmware's \
                default: a controller that knows its finger.",
        keys: &CONTROLLER,
    },
];

/// A key for each parameter of the core.
const CONTROLLER: [Key; Params::COUNT] = {
    let mut keys = [number("", "", 0.0, 0.0, 0.0); Params::COUNT];
    let mut place = 0;
    while place < Params::COUNT {
        let (name, _, min, max) = Params::RANGES[place];
        let kind = Kind::Optional { min: min as f64, max: max as f64, whole: true };
        keys[place] = Key { name, about: Params::DOCS[place], kind };
        place += 1;
    }
    keys
};
