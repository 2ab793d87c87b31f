//! `fingertip view`.

mod draw;

use crate::state::{Clock, State};
use crate::{Client, Error, numbers};
use crossterm::event::{self, Event, KeyCode, KeyModifiers};
use std::collections::VecDeque;
use std::io::{self, IsTerminal as _};
use std::time::{Duration, Instant};

pub use draw::draw;

/// How much of the past is shown.
const PAST_S: f64 = 10.0;

/// How to watch.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  fingertip view --rate-hz 30    (q ends)")]
pub struct Args {
    /// Updates a second
    #[arg(long, default_value_t = 30.0, value_parser = numbers::rate_hz)]
    rate_hz: f64,
    /// Ends after so long
    #[arg(long, value_parser = numbers::seconds)]
    seconds: Option<f64>,
}

/// What is shown.
#[derive(Debug, Default)]
pub struct Seen {
    /// Whom it is of, for the first line.
    pub name: String,
    /// The newest state; none before the first.
    pub state: Option<State>,
    /// The force over the last seconds: the controller's time, mN, and the goal.
    pub past: VecDeque<(f64, i64, i64)>,
    /// Updates a second, as they come.
    pub rate_hz: f64,
    /// Why there is nothing new.
    pub lost: Option<String>,
    /// The controller's time.
    pub clock: Clock,
}

impl Seen {
    /// Takes the next state, or why there is none.
    pub fn take(&mut self, read: Result<State, Error>) {
        match read {
            Ok(state) => {
                let time_s = self.clock.time_s(&state).unwrap_or_else(|| {
                    // The past is another run's.
                    self.past.clear();
                    self.clock.time_s(&state).unwrap_or_default()
                });
                self.past.push_back((time_s, state.force_mn, state.goal_mn));
                while self.past.front().is_some_and(|(at_s, ..)| time_s - at_s > PAST_S) {
                    self.past.pop_front();
                }
                self.state = Some(state);
                self.lost = None;
            }
            Err(why) => self.lost = Some(why.to_string()),
        }
    }
}

/// Watches until `q`, Escape, Ctrl-C, or the time is over.
///
/// # Errors
/// The output is no terminal, or the line is lost.
pub fn run(args: &Args, client: &mut Client) -> Result<(), Error> {
    if !io::stdout().is_terminal() {
        return Err("the output is no terminal: `fingertip record` writes states to a file or a pipe".into());
    }
    let period = Duration::from_secs_f64(1.0 / args.rate_hz.clamp(0.1, 1e3));
    let mut seen = Seen { name: format!("ID {} on {}", client.id, client.port()), ..Seen::default() };
    let failed = |why: io::Error| Error::Other(format!("the terminal: {why}"));
    let mut terminal = ratatui::try_init().map_err(failed)?;
    let watched = watch(args, period, client, &mut seen, &mut terminal).map_err(failed);
    ratatui::try_restore().map_err(failed)?;
    watched
}

fn watch(
    args: &Args,
    period: Duration,
    client: &mut Client,
    seen: &mut Seen,
    terminal: &mut ratatui::DefaultTerminal,
) -> io::Result<()> {
    let begun = Instant::now();
    let (mut due, mut counted, mut updates) = (begun, begun, 0);
    loop {
        let read = State::read_picture(client);
        if matches!(read, Err(Error::Port { .. })) {
            // The port may come back. Until then the screen shows the last state and the reason.
            let _ = client.reopen();
        }
        seen.take(read);
        updates += 1;
        if counted.elapsed() >= Duration::from_secs(1) {
            seen.rate_hz = f64::from(updates) / counted.elapsed().as_secs_f64();
            (counted, updates) = (Instant::now(), 0);
        }
        terminal.draw(|frame| draw(seen, frame.area(), frame.buffer_mut()))?;
        if args.seconds.is_some_and(|seconds| begun.elapsed().as_secs_f64() >= seconds) {
            return Ok(());
        }
        due = (due + period).max(Instant::now().checked_sub(period).unwrap_or(due));
        while event::poll(due.saturating_duration_since(Instant::now()))? {
            if let Event::Key(key) = event::read()? {
                let control = key.modifiers.contains(KeyModifiers::CONTROL);
                if matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) || control && key.code == KeyCode::Char('c') {
                    return Ok(());
                }
            }
        }
    }
}
