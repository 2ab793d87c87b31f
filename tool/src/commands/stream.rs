//! `fingertip stream`.

use crate::numbers;
#[cfg(feature = "foxglove")]
pub use server::run;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip stream    (in Foxglove: Open connection, Foxglove WebSocket, ws://localhost:8765)")]
pub struct Args {
    /// Address to listen on; 0.0.0.0 lets other machines in
    #[arg(long, default_value = "127.0.0.1")]
    listen: String,
    /// TCP port to listen on; 0 takes a free one
    #[arg(long, default_value_t = 8765)]
    tcp: u16,
    /// States a second
    #[arg(long, default_value_t = 60.0, value_parser = numbers::rate_hz)]
    rate_hz: f64,
}

#[cfg(not(feature = "foxglove"))]
pub fn run(_: &Args, _: &mut crate::Client) -> Result<(), crate::Error> {
    Err("this build does not stream: `cargo install --path tool --features foxglove` makes one that does".into())
}

#[cfg(feature = "foxglove")]
mod server {
    use super::Args;
    use crate::commands::{Interrupt, aside};
    use crate::recordings::{Topic, device};
    use crate::state::{Stamps, State};
    use crate::{Client, Error};
    use foxglove::{ChannelBuilder, Context, PartialMetadata, Schema, WebSocketServer};
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    const LOOK: Duration = Duration::from_millis(50);
    const TOPICS: [Topic; 2] = [Topic::Scalars, Topic::Image];

    /// Streams until Ctrl-C. Without a client the bus is not used.
    pub fn run(args: &Args, client: &mut Client) -> Result<(), Error> {
        let interrupt = Interrupt::catch()?;
        let context = Context::new();
        let device = device(client)?;
        let channel = |topic: Topic| {
            let schema = Schema::new(topic.schema_name(), "jsonschema", topic.schema());
            let channel = ChannelBuilder::new(topic.name(client.id)).context(&context).message_encoding("json");
            let channel = channel.metadata(device.clone()).schema(schema).build_raw();
            Ok((topic, channel.map_err(|why| Error::Other(why.to_string()))?))
        };
        let channels = TOPICS.into_iter().map(channel).collect::<Result<Vec<_>, Error>>()?;
        let server = WebSocketServer::new().name("fingertip").bind(&args.listen, args.tcp).context(&context);
        let server = server.start_blocking().map_err(|why| format!("{}:{}: {why}", args.listen, args.tcp))?;
        aside(format_args!("streaming at ws://{}:{}; Ctrl-C ends it", args.listen, server.port()));
        let period = Duration::from_secs_f64(1.0 / args.rate_hz.clamp(0.1, 1e3));
        let (mut stamps, mut lost) = (Stamps::default(), false);
        let mut due = Instant::now();
        while !interrupt.came() {
            if !channels.iter().any(|(_, channel)| channel.has_sinks()) {
                sleep(LOOK);
                continue;
            }
            match State::read_picture(client) {
                Ok(state) => {
                    lost = false;
                    // After a restart of the controller its time counts on from now.
                    let stamp = stamps.stamp(&state).or_else(|| stamps.stamp(&state)).unwrap_or_default();
                    for (topic, channel) in &channels {
                        let when = PartialMetadata::with_log_time(stamp.read_ns);
                        channel.log_with_meta(&topic.message(&stamp, &state), when);
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
}
