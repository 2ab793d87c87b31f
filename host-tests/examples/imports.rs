//! Prints a picture of which stage of the core uses which: the last stage is at the top, so each arrow points down.

use host_tests::imports::{board, stages};
use std::collections::BTreeSet;
use std::error::Error;
use std::path::Path;

/// From stage to stage, px.
const STEP: usize = 34;
/// Where the arrows leave, px.
const LEFT: usize = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let core = Path::new(env!("FINGERTIP_ROOT")).join("src");
    let mut stages = stages(&core)?;
    stages.push(board(&core)?);
    let mut names: Vec<_> = stages.iter().rev().map(|stage| stage.name.as_str()).collect();
    names.push("lanes");
    let y = |name: &str| names.iter().position(|other| *other == name).map(|place| STEP * place + STEP);
    let height = STEP * (names.len() + 1);
    // Three quarters of the reach below, and some air.
    let width = LEFT + height * 45 / 100 + 10;
    println!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\">"
    );
    println!("<rect width=\"{width}\" height=\"{height}\" fill=\"#FFFFFF\"/>");
    println!("<g fill=\"none\" stroke=\"#14285A\" stroke-opacity=\"0.45\">");
    for stage in &stages {
        let from = y(&stage.name).ok_or("a stage has its place")?;
        let used: BTreeSet<_> = stage.uses.iter().filter_map(|(name, _)| y(name)).collect();
        for to in used {
            // The farther, the wider; an arrow that points up would be drawn on the other side, in red.
            let (reach, colour) = if to > from {
                (LEFT + (to - from) * 6 / 10, "")
            } else {
                (LEFT.saturating_sub((from - to) * 6 / 10), " stroke=\"#C80000\"")
            };
            let tip = LEFT + 6;
            println!("<path d=\"M{LEFT} {from} C{reach} {from} {reach} {to} {tip} {to}\"{colour}/>");
            println!("<path d=\"M{} {} L{LEFT} {to} L{} {}\"{colour}/>", tip + 2, to - 3, tip + 2, to + 3);
        }
    }
    println!("</g>\n<g font-family=\"sans-serif\" font-size=\"15\" text-anchor=\"end\" fill=\"#000000\">");
    for name in &names {
        let y = y(name).ok_or("a stage has its place")?;
        println!("<text x=\"{}\" y=\"{}\">{name}</text>", LEFT - 8, y + 5);
    }
    println!("</g>\n</svg>");
    Ok(())
}
