//! `fingertip view`.

use crate::state::{Clock, SHAPE, State};
use crate::{Client, Error, numbers};
use crossterm::event::{self, Event, KeyCode, KeyModifiers};
use ratatui::DefaultTerminal;
use ratatui::buffer::Buffer;
use ratatui::layout::Constraint::{Length, Min};
use ratatui::layout::{Layout, Rect};
use ratatui::style::{Color, Style, Stylize as _};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Chart, Dataset, GraphType, Paragraph, Widget as _};
use std::collections::VecDeque;
use std::io::{self, IsTerminal as _};
use std::time::{Duration, Instant};

const PAST_S: f64 = 10.0;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  fingertip view --rate-hz 30    (q ends)")]
pub struct Args {
    /// Updates a second
    #[arg(long, default_value_t = 30.0, value_parser = numbers::rate_hz)]
    rate_hz: f64,
    /// Time after which it ends
    #[arg(long, value_parser = numbers::seconds)]
    seconds: Option<f64>,
}

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
    pub lost: Option<String>,
    pub clock: Clock,
}

impl Seen {
    pub fn take(&mut self, read: Result<State, Error>) {
        match read {
            Ok(state) if self.state.as_ref().is_some_and(|last| last.time_us == state.time_us) => {
                self.state = Some(state);
                self.lost = Some("no new frame: all that is measured is old".into());
            }
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
pub fn run(args: &Args, client: &mut Client) -> Result<(), Error> {
    if !io::stdout().is_terminal() {
        return Err("the output is no terminal: `fingertip record` writes states to a file or a pipe".into());
    }
    let mut seen = Seen { name: format!("ID {} on {}", client.id, client.port), ..Seen::default() };
    let failed = |why: io::Error| Error::Other(format!("the terminal: {why}"));
    let mut terminal = ratatui::try_init().map_err(failed)?;
    let watched = watch(args, client, &mut seen, &mut terminal).map_err(failed);
    ratatui::try_restore().map_err(failed)?;
    watched
}

fn watch(args: &Args, client: &mut Client, seen: &mut Seen, terminal: &mut DefaultTerminal) -> io::Result<()> {
    let period = Duration::from_secs_f64(1.0 / args.rate_hz.clamp(0.1, 1e3));
    let begun = Instant::now();
    let (mut due, mut counted, mut updates) = (begun, begun, 0);
    loop {
        let read = State::read_picture(client);
        if matches!(read, Err(Error::Port(..))) {
            // The port may come back. Until then the screen shows the last state and the reason.
            let _ = client.reopen();
        }
        seen.take(read);
        updates += u32::from(seen.lost.is_none());
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

/// Columns of characters for a taxel: three digits of kPa and a space.
const TAXEL: u16 = 4;
/// Terminal colours (of 256), from no pressure to the highest.
const HEAT: [u8; 10] = [234, 17, 18, 54, 90, 126, 161, 196, 208, 226];
/// First of these colours on which the text is dark.
const BRIGHT: usize = 8;
/// Least pressure of the hottest colour, Pa.
const HOTTEST_PA: i64 = 20_000;

pub fn draw(seen: &Seen, area: Rect, buffer: &mut Buffer) {
    let [rows, columns] = SHAPE.map(|side| side as u16);
    let [head, middle, past, foot] = Layout::vertical([Length(1), Length(rows + 1), Min(5), Length(1)]).areas(area);
    let [map, words] = Layout::horizontal([Length(TAXEL * columns + 1), Min(20)]).areas(middle);
    let rate = format!("{:.0} updates a second", seen.rate_hz);
    Line::from(vec!["fingertip ".bold(), Span::from(seen.name.as_str()), "  ".into(), rate.dim()]).render(head, buffer);
    match &seen.state {
        Some(state) => {
            draw_map(state, map, buffer);
            draw_words(state, words, buffer);
            draw_past(seen, past, buffer);
        }
        None => Paragraph::new("waiting for the first state").render(words, buffer),
    }
    match &seen.lost {
        Some(why) => Line::from(why.as_str()).red().render(foot, buffer),
        None => Line::from("q ends").dim().render(foot, buffer),
    }
}

/// The pressures, a number of kPa in a coloured field for each taxel.
fn draw_map(state: &State, area: Rect, buffer: &mut Buffer) {
    let top_pa = state.pressures_pa.iter().copied().max().unwrap_or(0).max(HOTTEST_PA);
    for (row, taxels) in state.pressures_pa.chunks(SHAPE[1]).enumerate() {
        for (column, &pa) in taxels.iter().enumerate() {
            let heat = (pa.max(0) * (HEAT.len() as i64 - 1) / top_pa) as usize;
            let ink = if heat >= BRIGHT { Color::Black } else { Color::White };
            // The last row on top, as in recordings.
            let y = area.y + (SHAPE[0] - 1 - row) as u16;
            let (x, text) = (area.x + column as u16 * TAXEL, format!("{:>3} ", (pa + 500) / 1_000));
            if y < area.bottom() && x + TAXEL <= area.right() {
                buffer.set_string(x, y, text, Style::new().fg(ink).bg(Color::Indexed(HEAT[heat.min(HEAT.len() - 1)])));
            }
        }
    }
    let scale = Line::from(format!("kPa; the lightest is {}", top_pa / 1_000)).dim();
    scale.render(Rect { y: area.bottom().saturating_sub(1), height: 1, ..area }, buffer);
}

fn draw_words(state: &State, area: Rect, buffer: &mut Buffer) {
    // Of a mN and of a um.
    let thousandths = |number: i64| number as f64 * 1e-3;
    let fault = state.fault_name();
    let fault = fault.map_or("  none".into(), |name| format!("  {} {name}", state.fault).red().bold());
    let [x_mm, y_mm, travel_mm, mm_per_s] =
        [state.centre_x_um, state.centre_y_um, state.travel_um, state.speed_um_per_s].map(thousandths);
    let lines = vec![
        Line::from(vec!["force   ".into(), format!("{:8.3} N", thousandths(state.force_mn)).bold()]),
        Line::from(format!("goal    {:8.3} N", thousandths(state.goal_mn))),
        Line::from(vec!["mode    ".into(), Span::from(format!("  {}", state.mode_name())).cyan()]),
        Line::from(vec!["fault   ".into(), fault]),
        Line::from(format!("centre  {x_mm:8.2} {y_mm:.2} mm")),
        Line::from(format!("depth   {:8.3} mm", thousandths(state.indentation_um))),
        Line::from(format!("travel  {travel_mm:8.2} mm at {mm_per_s:.1} mm/s")),
        Line::from(format!("duty    {:8.1} %", state.duty_permille as f64 * 0.1)),
        Line::from(format!("limits    {}", state.limits_text())),
    ];
    Paragraph::new(lines).wrap(ratatui::widgets::Wrap { trim: false }).render(area, buffer);
}

fn draw_past(seen: &Seen, area: Rect, buffer: &mut Buffer) {
    let now_s = seen.past.back().map_or(0.0, |(at_s, ..)| *at_s);
    let of = |value: fn(&(f64, i64, i64)) -> i64| -> Vec<(f64, f64)> {
        seen.past.iter().map(|point| (point.0 - now_s, value(point) as f64 * 1e-3)).collect()
    };
    let (forces, goals) = (of(|point| point.1), of(|point| point.2));
    let most_n = forces.iter().chain(&goals).map(|(_, newtons)| *newtons).fold(0.5, f64::max);
    let top_n = (most_n * 2.0).ceil() / 2.0;
    let line = |points, colour| {
        let style = Style::new().fg(colour);
        Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(style).data(points)
    };
    let x = Axis::default().bounds([-PAST_S, 0.0]).labels([format!("-{PAST_S:.0} s"), "now".into()]);
    let y = Axis::default().bounds([0.0, top_n]).labels(["0".to_owned(), format!("{top_n:.1} N")]);
    let chart = Chart::new(vec![line(&goals, Color::DarkGray), line(&forces, Color::Green)]);
    chart.x_axis(x).y_axis(y).render(area, buffer);
}
