//! The screen: 80 x 24 characters, and more of the past where there is more room.

use super::{PAST_S, Seen};
use crate::state::{SHAPE, State};
use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize as _};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Chart, Dataset, GraphType, Paragraph, Widget as _};

/// Columns of characters for a taxel: three digits of kPa and a space.
const TAXEL: u16 = 4;
/// Of 256 colours, from what is not pressed to what is pressed most.
const HEAT: [u8; 10] = [234, 17, 18, 54, 90, 126, 161, 196, 208, 226];
/// From which of them on writing is dark.
const BRIGHT: usize = 8;
/// Pa that the hottest colour stands for, at least.
const HOTTEST_PA: i64 = 20_000;

/// Draws what is seen.
pub fn draw(seen: &Seen, area: Rect, buffer: &mut Buffer) {
    let [rows, columns] = SHAPE.map(|side| side as u16);
    let [head, middle, past, foot] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(rows + 1),
        Constraint::Min(5),
        Constraint::Length(1),
    ])
    .areas(area);
    let [map, words] = Layout::horizontal([Constraint::Length(TAXEL * columns + 1), Constraint::Min(20)]).areas(middle);
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
    let millimetres = |um: i64| um as f64 * 1e-3;
    let newtons = |mn: i64| mn as f64 * 1e-3;
    let fault = state.fault_name();
    let limits = state.limit_names();
    let limits = if limits.is_empty() { "none".into() } else { limits.join(", ") };
    let lines = vec![
        Line::from(vec!["force   ".into(), format!("{:8.3} N", newtons(state.force_mn)).bold()]),
        Line::from(format!("goal    {:8.3} N", newtons(state.goal_mn))),
        Line::from(vec!["mode    ".into(), Span::from(format!("  {}", state.mode_name())).cyan()]),
        Line::from(vec![
            "fault   ".into(),
            fault.map_or("  none".into(), |name| format!("  {} {name}", state.fault).red().bold()),
        ]),
        Line::from(format!("centre  {:8.2} {:.2} mm", millimetres(state.centre_x_um), millimetres(state.centre_y_um))),
        Line::from(format!("depth   {:8.3} mm", millimetres(state.indentation_um))),
        Line::from(format!(
            "travel  {:8.2} mm at {:.1} mm/s",
            millimetres(state.travel_um),
            millimetres(state.speed_um_per_s)
        )),
        Line::from(format!("duty    {:8.1} %", state.duty_permille as f64 * 0.1)),
        Line::from(format!("limits    {limits}")),
    ];
    Paragraph::new(lines).wrap(ratatui::widgets::Wrap { trim: false }).render(area, buffer);
}

/// Force and goal over the last seconds.
fn draw_past(seen: &Seen, area: Rect, buffer: &mut Buffer) {
    let now_s = seen.past.back().map_or(0.0, |(at_s, ..)| *at_s);
    let of = |value: fn(&(f64, i64, i64)) -> i64| -> Vec<(f64, f64)> {
        seen.past.iter().map(|point| (point.0 - now_s, value(point) as f64 * 1e-3)).collect()
    };
    let (forces, goals) = (of(|point| point.1), of(|point| point.2));
    let most_n = forces.iter().chain(&goals).map(|(_, newtons)| *newtons).fold(0.5, f64::max);
    let top_n = (most_n * 2.0).ceil() / 2.0;
    let line = |points, colour| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(colour))
            .data(points)
    };
    let x = Axis::default().bounds([-PAST_S, 0.0]).labels([format!("-{PAST_S:.0} s"), "now".into()]);
    let y = Axis::default().bounds([0.0, top_n]).labels(["0".to_owned(), format!("{top_n:.1} N")]);
    Chart::new(vec![line(&goals, Color::DarkGray), line(&forces, Color::Green)])
        .x_axis(x)
        .y_axis(y)
        .render(area, buffer);
}
