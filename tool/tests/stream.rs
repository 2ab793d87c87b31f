//! `fingertip stream`, heard over its WebSocket by nothing but a socket.
#![cfg(feature = "foxglove")]

mod served;

use serde_json::{Value, json};
use served::{Served, line_with};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::Child;

/// Lengths that a frame's second byte encodes.
const SHORT: u8 = 126;
const TEXT: u8 = 1;
const BINARY: u8 = 2;

struct Listener(BufReader<TcpStream>);

impl Listener {
    fn connect(address: &str) -> Self {
        let mut socket = TcpStream::connect(address).expect("it listens");
        let request = format!(
            "GET / HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
        );
        socket.write_all(request.as_bytes()).expect("it hears");
        let mut reader = BufReader::new(socket);
        let mut answer = String::new();
        while !answer.ends_with("\r\n\r\n") {
            assert!(reader.read_line(&mut answer).expect("it answers") > 0, "{answer}");
        }
        assert!(answer.starts_with("HTTP/1.1 101"), "{answer}");
        Self(reader)
    }

    /// The next frame that is text or binary: which, and what is in it.
    fn next(&mut self) -> (u8, Vec<u8>) {
        loop {
            let [kind, length] = self.bytes();
            let length = match length {
                SHORT => u64::from(u16::from_be_bytes(self.bytes())),
                127 => u64::from_be_bytes(self.bytes()),
                length => length.into(),
            };
            let mut data = vec![0; usize::try_from(length).expect("it fits")];
            self.0.read_exact(&mut data).expect("a frame");
            if [TEXT, BINARY].contains(&(kind & 0x0f)) {
                return (kind & 0x0f, data);
            }
        }
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).expect("a frame");
        bytes
    }

    /// The next message in JSON that does this.
    fn told(&mut self, operation: &str) -> Value {
        loop {
            if let (TEXT, data) = self.next() {
                let message: Value = serde_json::from_slice(&data).expect("JSON");
                if message["op"] == operation {
                    return message;
                }
            }
        }
    }

    /// Sends a short text under a mask of zeros.
    fn say(&mut self, message: &Value) {
        let text = message.to_string();
        let length = u8::try_from(text.len()).ok().filter(|length| *length < SHORT).expect("a short text");
        let mut frame = vec![0x80 | TEXT, 0x80 | length, 0, 0, 0, 0];
        frame.extend(text.bytes());
        self.0.get_mut().write_all(&frame).expect("it hears");
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
    let mut listener = Listener::connect(&address(&mut child));
    assert_eq!(listener.told("serverInfo")["name"], "fingertip");
    let advertised = listener.told("advertise");
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
        listener.say(&json!({ "op": "subscribe", "subscriptions": subscriptions }));
    }
    let (mut numbers, mut pictures, mut last_ns) = (0, 0, 0);
    while numbers < 50 || pictures < 50 {
        let (BINARY, data) = listener.next() else { continue };
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
    finger.end();
}

#[test]
fn a_port_that_is_taken_is_told() {
    let finger = Served::begin("wall");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let told = finger.refused(&["stream", "--tcp", &port]);
    assert!(told.contains(&format!("127.0.0.1:{port}")) && told.contains("in use"), "{told}");
    finger.end();
}
