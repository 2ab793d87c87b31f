//! The WebSocket that Foxglove opens, by its own SDK.

use super::Args;
use crate::commands::{Interrupt, aside};
use crate::messages::Topic;
use crate::state::{Clock, State};
use crate::{Client, Error};
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer};
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How often to look for who wants the stream.
const LOOK: Duration = Duration::from_millis(50);
const TOPICS: [Topic; 2] = [Topic::Scalars, Topic::Image];

/// Streams until Ctrl-C. The bus is left alone while nobody looks.
///
/// # Errors
/// The port is taken.
pub(super) fn run(args: &Args, client: &mut Client) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let context = Context::new();
    let channel = |topic| Ok((topic, channel(&context, topic, client.id)?));
    let channels = TOPICS.into_iter().map(channel).collect::<Result<Vec<_>, Error>>()?;
    let server = WebSocketServer::new().name("fingertip").bind(&args.listen, args.tcp).context(&context);
    let server = server.start_blocking().map_err(|why| format!("{}:{}: {why}", args.listen, args.tcp))?;
    aside(format_args!("streaming at ws://{}:{}; Ctrl-C ends it", args.listen, server.port()));
    let period = Duration::from_secs_f64(1.0 / args.rate_hz.clamp(0.1, 1e3));
    let (mut clock, mut begun, mut lost) = (Clock::default(), None, false);
    let mut due = Instant::now();
    while !interrupt.came() {
        if !channels.iter().any(|(_, channel)| channel.has_sinks()) {
            sleep(LOOK);
            continue;
        }
        match State::read_picture(client) {
            Ok(state) => {
                lost = false;
                let time_s = clock.time_s(&state).unwrap_or_else(|| {
                    // It started anew: its time counts on from now.
                    begun = None;
                    clock.time_s(&state).unwrap_or_default()
                });
                let begun = *begun.get_or_insert_with(SystemTime::now);
                let at = (begun + Duration::from_secs_f64(time_s)).duration_since(UNIX_EPOCH).unwrap_or_default();
                for (topic, channel) in &channels {
                    let when = PartialMetadata::with_log_time(at.as_nanos() as u64);
                    channel.log_with_meta(&topic.message(time_s, &state), when);
                }
            }
            Err(why) if lost => drop(why),
            Err(why) => {
                lost = true;
                aside(format_args!("nothing new: {why}"));
            }
        }
        due = (due + period).max(Instant::now().checked_sub(period).unwrap_or(due));
        interrupt.pause(due);
    }
    server.stop().wait_blocking();
    Ok(())
}

fn channel(context: &Arc<Context>, topic: Topic, id: u8) -> Result<Arc<RawChannel>, Error> {
    let schema = Schema::new(topic.schema_name(), "jsonschema", topic.schema());
    let channel = ChannelBuilder::new(topic.name(id)).context(context).message_encoding("json").schema(schema);
    channel.build_raw().map_err(|why| Error::Other(why.to_string()))
}
