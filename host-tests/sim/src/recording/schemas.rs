//! What the messages look like, as JSON schemas. Frames and images share theirs with the recordings of `fingertip`.

use serde_json::{Value, json};

/// A topic's last part, its schema's name, and the schema.
pub fn all() -> [(&'static str, &'static str, String); 4] {
    let [frame, image] = [
        include_str!("../../../../tool/src/messages/frame.json"),
        include_str!("../../../../tool/src/messages/raw_image.json"),
    ];
    [
        ("scalars", "fingertip.Scalars", scalars().to_string()),
        ("frame", "fingertip.Frame", frame.into()),
        ("image", "foxglove.RawImage", image.into()),
        ("core", "fingertip.Core", core().to_string()),
    ]
}

/// The scalars: names in the order in which they are written, with what they are.
pub const SCALARS: [(&str, &str); 20] = [
    ("time_s", "Virtual time from the scene's start"),
    ("goal_n", "The force asked for"),
    ("sensed_force_n", "Normal force as the controller senses it"),
    ("true_force_n", "Normal force between tip and object"),
    ("indentation_mm", "Indentation of the tip"),
    ("travel_mm", "Way of the tip from its start"),
    ("speed_mm_per_s", "Speed of the tip"),
    ("duty_percent", "Share of the supply at the motor; positive presses"),
    ("current_a", "Winding current"),
    ("supply_v", "Supply at the bridge"),
    ("winding_c", "Temperature of the winding"),
    ("centre_x_mm", "Sensed centre of the contact along the columns"),
    ("centre_y_mm", "Sensed centre of the contact along the rows"),
    ("confidence_percent", "Confidence that the contact is a tip on a plane"),
    ("mode", "Mode, by its number on the bus"),
    ("fault", "Fault, by its number on the bus; 0 is none"),
    ("limits", "Limits, a bit each as on the bus"),
    ("tangential_n", "Tangential force on the object, upwards"),
    ("slip_mm", "Way that the contact has slipped"),
    ("object_height_mm", "Height of the object"),
];

fn scalars() -> Value {
    let properties: serde_json::Map<_, _> = SCALARS
        .iter()
        .map(|(name, about)| ((*name).to_owned(), json!({ "type": "number", "description": about })))
        .collect();
    json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties })
}

fn core() -> Value {
    let record = "Frame, sense and command in the layout of images::record::Record, base64";
    let digest = "CRC-64/XZ of the duty and of every field of the status, hexadecimal";
    json!({
        "title": "fingertip.Core",
        "type": "object",
        "properties": {
            "record": { "type": "string", "contentEncoding": "base64", "description": record },
            "duty": { "type": "integer", "description": "The duty that the core answered, Q15" },
            "digest": { "type": "string", "description": digest },
        },
    })
}
