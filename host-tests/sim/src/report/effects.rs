//! What each effect cost, and what it changes.

use super::Report;
use crate::ledger::{difference, differences, rows};
use crate::metrics::shown;
use maud::{Markup, html};

/// What each cost.
pub fn ledger(report: &Report) -> Markup {
    html! {
        div.scroll tabindex="0" { table {
            thead { tr {
                th scope="col" { "effect" } th.number scope="col" { "evaluations" }
                th.number scope="col" { "time, s" } th.number scope="col" { "share, %" }
            } }
            tbody { @for (effect, evaluations, seconds, percent) in rows(&report.outcome.summary) { tr {
                td { (effect) }
                td.number { @if let Some(evaluations) = evaluations { (evaluations) } }
                td.number { (format!("{seconds:.4}")) }
                td.number { (format!("{percent:.1}")) }
            } } }
        } }
    }
}

/// What each changes.
pub fn ablation(report: &Report) -> Markup {
    html! {
        p.note { "What each effect adds to a metric: the run as it is, less a run without the effect." }
        div.scroll tabindex="0" { table {
            thead { tr {
                th scope="col" { "metric" } th.number scope="col" { "all effects" }
                @for without in report.ablated { th.number scope="col" { (without.effect) } }
            } }
            tbody { @for (name, value, others) in differences(&report.outcome.measured, report.ablated) { tr {
                td { code { (name) } }
                td.number { (shown(value)) }
                @for other in others { td.number { (difference(value, other)) } }
            } } }
        } }
    }
}
