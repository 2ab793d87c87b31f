//! `fingertip stream`, heard over its WebSocket.

use crate::served::{Served, line_with};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::process::Child;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

type Listener = WebSocket<MaybeTlsStream<TcpStream>>;

fn connect(address: &str) -> Listener {
    let mut request = format!("ws://{address}").into_client_request().expect("an address");
    request.headers_mut().insert("Sec-WebSocket-Protocol", "foxglove.sdk.v1".parse().expect("a name"));
    tungstenite::connect(request).expect("it listens").0
}

/// The next message in JSON that does this.
fn told(listener: &mut Listener, operation: &str) -> Value {
    loop {
        if let Message::Text(text) = listener.read().expect("a message") {
            let message: Value = serde_json::from_str(&text).expect("JSON");
            if message["op"] == operation {
                return message;
            }
        }
    }
}

fn address(child: &mut Child) -> String {
    let line = line_with("ws://", child.stderr.take().expect("a pipe"));
    line.split("ws://").nth(1).and_then(|rest| rest.split(';').next()).expect("an address").to_owned()
}

#[test]
fn foxglove_is_sent_the_numbers_and_the_picture() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let mut child = finger.start(&["stream", "--tcp", "0", "--rate-hz", "200"]);
    let mut listener = connect(&address(&mut child));
    assert_eq!(told(&mut listener, "serverInfo")["name"], "fingertip");
    let advertised = told(&mut listener, "advertise");
    let channels = advertised["channels"].as_array().expect("channels").clone();
    let of = |topic: &str| {
        let channel = channels.iter().find(|channel| channel["topic"] == topic);
        channel.unwrap_or_else(|| panic!("{topic}: {channels:?}")).clone()
    };
    let (scalars, image) = (of("/finger0/scalars"), of("/finger0/image"));
    assert_eq!(image["schemaName"], "foxglove.RawImage");
    assert!(scalars["schema"].as_str().expect("a schema").contains("sensed_force_n"));
    for (id, channel) in [(7, &scalars), (8, &image)] {
        let subscriptions = json!([{ "id": id, "channelId": channel["id"] }]);
        let subscribe = json!({ "op": "subscribe", "subscriptions": subscriptions });
        listener.send(Message::text(subscribe.to_string())).expect("it hears");
    }
    let (mut numbers, mut pictures, mut last_ns) = (0, 0, 0);
    while numbers < 50 || pictures < 50 {
        let Message::Binary(data) = listener.read().expect("a message") else { continue };
        assert_eq!(data[0], 1, "a message");
        let time_ns = u64::from_le_bytes(data[5..13].try_into().expect("eight bytes"));
        let message: Value = serde_json::from_slice(&data[13..]).expect("JSON");
        match data[1] {
            7 => {
                assert!(time_ns > last_ns, "{time_ns} after {last_ns}");
                last_ns = time_ns;
                assert!(message["sensed_force_n"].is_number() && message["fault"] == 0, "{message}");
                numbers += 1;
            }
            8 => {
                assert_eq!((&message["width"], &message["height"]), (&json!(10), &json!(10)));
                pictures += 1;
            }
            other => panic!("subscription {other}"),
        }
    }
    Served::interrupt(&child);
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn a_port_that_is_taken_is_told() {
    let finger = Served::begin("wall");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    finger.refuses(&["stream", "--tcp", &port], &[&format!("127.0.0.1:{port}"), "in use"]);
}
