//! What this program records and streams has the names of a scene's recording.

use fingertip_cli::messages::Topic;
use fingertip_cli::state::{Stamp, State};
use serde_json::Value;
use sim::recording::{SCALARS, schemas};

/// A schema that both have.
fn both(topic: Topic) -> [Value; 2] {
    let name = topic.schema_name();
    let scenes = schemas().into_iter().find(|(_, known, _)| *known == name);
    let (kind, _, scenes) = scenes.unwrap_or_else(|| panic!("the scenes have no {name}"));
    assert_eq!(topic.name(1), format!("/finger0/{kind}"));
    [scenes.into_bytes(), topic.schema()].map(|schema| serde_json::from_slice(&schema).expect("JSON"))
}

fn names(schema: &Value) -> Vec<&str> {
    schema["properties"].as_object().expect("a map").keys().map(String::as_str).collect()
}

#[test]
fn the_scalars_are_those_of_the_scenes_that_a_controller_knows() {
    let [scenes, own] = both(Topic::Scalars);
    let own = names(&own);
    assert_eq!(names(&scenes), SCALARS.map(|(name, _)| name));
    let known: Vec<&str> = names(&scenes).into_iter().filter(|name| own.contains(name)).collect();
    assert_eq!(known, own, "by the same names, in the same order");
    let message: Value =
        serde_json::from_slice(&Topic::Scalars.message(&Stamp::default(), &State::default())).expect("JSON");
    assert_eq!(message.as_object().expect("a map").keys().collect::<Vec<_>>(), own);
}

#[test]
fn the_picture_is_that_of_the_scenes() {
    let [scenes, own] = both(Topic::Image);
    assert_eq!(scenes, own);
    let message: Value =
        serde_json::from_slice(&Topic::Image.message(&Stamp::default(), &State::default())).expect("JSON");
    assert_eq!(message.as_object().expect("a map").keys().collect::<Vec<_>>(), names(&own));
}
