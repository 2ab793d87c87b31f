//! Modes, faults and limits over time, as they are drawn where no script runs.

use super::states::{Row, Strip};
use crate::metrics::shown;
use maud::{Markup, html};

/// Parts of the whole width.
const WIDE: f64 = 1000.0;

/// The strip: a line of text and a bar for each that occurred.
pub fn strip(Strip(rows): &Strip, times: &[f64]) -> Markup {
    let end = times.last().copied().unwrap_or(0.0).max(1e-9);
    // What holds in a stretch holds until the next one.
    let place = |at: usize| times.get(at).map_or(WIDE, |time_s| if at == 0 { 0.0 } else { WIDE * time_s / end });
    html! {
        div.strip {
            @for Row { kind, name, spans } in rows {
                @let about = format!("{kind} {name}: {} times", spans.len());
                div.row {
                    span { (kind) ": " (name) }
                    @let all = format!("0 0 {WIDE} 10");
                    svg.(kind) viewBox=(all) preserveAspectRatio="none" role="img" aria-label=(about) {
                        @for [from, to] in spans {
                            rect x=(format!("{:.2}", place(*from))) y="0" height="10"
                                width=(format!("{:.2}", (place(*to) - place(*from)).max(1.0))) {}
                        }
                    }
                }
            }
            p.note { "From 0 to " (shown(times.last().copied())) " s." }
        }
    }
}
